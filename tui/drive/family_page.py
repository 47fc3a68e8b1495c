"""Facts about a family and its line, in sections.

Warnings come first, then waiting time, pins, rules, addresses, servers, lamps, commands, and errors
of its manuals. All facts are from the profile.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Literal

from .plain import plain
from .profile.profile import Profile
from .profile.schema import Confidence, Connector, LineSchematic, ProfileData

SURENESS: dict[Confidence, str] = {
    "site": "proved on this site",
    "manual": "",
    "manual+public": "",
    "public-x2": "public documents",
    "public": "public document",
    "analogy": "sister family ?",
    "unverified": "not verified ?",
}
"""Certainty of a fact that no manual of the family states."""
HEAD_WIDTH = 18
"""Columns before a text, including an indent of two and a space after it."""
MARKS, MARK_WIDTH = ("!", "*"), 4
"""Marks that replace the name before a text, and their width in columns."""


@dataclass(frozen=True, slots=True)
class PageRow:
    """A fact with its heading and its certainty."""

    head: str
    text: str
    sure: str = ""
    warns: bool = False
    drawn: bool = False
    """True for a line of a drawing, which is not wrapped."""


@dataclass(frozen=True, slots=True)
class PageSection:
    """Rows of one subject."""

    title: str
    rows: tuple[PageRow, ...]


@dataclass(frozen=True, slots=True)
class PageLine:
    """One line of the page as drawn."""

    kind: Literal["title", "row", "warning", "gap"]
    head: str
    """A title, or a heading padded to the column of the text."""
    text: str = ""


def family_page(profile: Profile) -> list[PageSection]:
    """Return the sections about which the profile has facts."""
    data = profile.data
    sections = [
        PageSection("Warnings", tuple(_warnings(data))),
        PageSection("Before you open the drive", tuple(_opening(data))),
        *(PageSection(f"Pins: {c.name}", tuple(_pins(c))) for c in data.connectors),
        PageSection("Signal names", tuple(_signals(data))),
        PageSection("Line", tuple(_line(data))),
        PageSection("Schematics", tuple(_schematics(data))),
        PageSection("Parts to order", tuple(_parts(data))),
        PageSection("Cables by master", tuple(_masters(data))),
        PageSection("Addresses", tuple(_addresses(data))),
        PageSection("On a communication loss", tuple(_silence(data))),
        PageSection("After a fault reset", tuple(_after_reset(data))),
        PageSection("Lamps and display", tuple(_lamps(data))),
        PageSection("On the keypad only", tuple(_keypad_functions(data))),
        PageSection("Command words", tuple(_commands(data))),
        PageSection("Errors in the manuals", tuple(_errata(data))),
    ]
    return [section for section in sections if section.rows]


def page_lines(sections: Sequence[PageSection], width: int) -> list[PageLine]:
    """Lay out the page in lines of this width: heading, text, and certainty after the text."""
    lines: list[PageLine] = []
    for section in sections:
        if lines:
            lines.append(PageLine("gap", ""))
        lines.append(PageLine("title", plain(section.title)))
        for row in section.rows:
            lines += _flowed(row, width)
    return lines


def _flowed(row: PageRow, width: int) -> Iterator[PageLine]:
    if row.drawn:
        yield PageLine("row", "  ", plain(row.text)[: width - 2])
        return
    before = MARK_WIDTH if row.head in MARKS else HEAD_WIDTH
    text = plain(f"{row.text} [{row.sure}]" if row.sure else row.text)
    parts = textwrap.wrap(text, max(20, width - before)) or [""]
    heads = textwrap.wrap(plain(row.head), before - 3) or [""]
    kind: Literal["row", "warning"] = "warning" if row.warns else "row"
    for head, part in zip_longest(heads, parts, fillvalue=""):
        yield PageLine(kind, f"  {head:<{before - 2}}", part)


def _warnings(data: ProfileData) -> Iterator[PageRow]:
    message = [*data.wiring.warnings]
    for warning in message:
        yield PageRow("!", warning.text, SURENESS[warning.confidence], True)
    watch = data.communication_fault
    known = {warning.text for warning in message}
    for text in watch.warnings if watch else ():
        if text not in known:
            yield PageRow("!", text, "", True)


_WAIT = {
    (True, False): "{opening.minutes} minutes",
    (True, True): "{opening.minutes} minutes; DC bus below {opening.below_volts} V, measured",
    (False, False): "unknown",
    (False, True): "unknown; DC bus below {opening.below_volts} V, measured",
}
"""By whether the minutes and the voltage are known."""


def _opening(data: ProfileData) -> Iterator[PageRow]:
    opening = data.wiring.opening
    if opening is None:
        return
    text = _WAIT[bool(opening.minutes), bool(opening.below_volts)].format(opening=opening)
    yield PageRow("Wait", text, SURENESS[opening.confidence], True)
    if opening.note:
        yield PageRow("", opening.note)


def _pins(connector: Connector) -> Iterator[PageRow]:
    for pin in connector.pins:
        yield PageRow(pin.pin, f"{pin.signal}; {pin.note}" if pin.note else pin.signal)
    for warning in connector.warnings:
        yield PageRow("!", warning, "", True)


def _signals(data: ProfileData) -> Iterator[PageRow]:
    for signal in data.wiring.signals:
        yield PageRow(
            signal.signal, "; ".join(f"{std}: {name}" for std, name in signal.names.items())
        )


def _line(data: ProfileData) -> Iterator[PageRow]:
    link = data.link
    yield PageRow("Factory", f"{link.baud} bit/s, {link.format}")
    if link.bauds or link.formats:
        rates = ", ".join(map(str, link.bauds or [link.baud]))
        yield PageRow("Possible", f"{rates} bit/s; {', '.join(link.formats or [link.format])}")
    if link.note:
        yield PageRow("", link.note)
    for rule in data.line_rules:
        yield PageRow(rule.subject, rule.rule)


TERMINATORS = {"RC": "120 ohm 0.25 W in series with 1 nF 10 V", "R": "150 ohm"}
"""Terminators of a line, by their kind."""


def _schematics(data: ProfileData) -> Iterator[PageRow]:
    if (port := data.wiring.port) is not None:
        yield PageRow("In the drive", port.note)
    for item in data.schematics:
        yield PageRow(item.name, schematic_text(item), SURENESS[item.confidence])
        yield from (PageRow("", line, drawn=True) for line in item.drawing.splitlines())


def schematic_text(item: LineSchematic) -> str:
    """Return the limits of a schematic in sentences."""
    parts = [
        f"{item.slaves + 1} stations without a repeater, the master and {item.slaves} slaves.",
        f"{item.length_m} m at {item.length_baud} bit/s.",
        f"Tap links of {item.tap_m} m.",
    ]
    if item.shared_tap_m:
        parts.append(f"The taps of one box share {item.shared_tap_m} m, divided by their number.")
    if item.master_ohm:
        span = " to ".join(map(str, dict.fromkeys(item.master_ohm)))
        place = "in every station" if item.station_ohm else "in one place, at the master"
        parts.append(f"Polarization of {span} ohm to each of 5 V and common, {place}.")
    if item.total_ohm:
        low, high = item.total_ohm
        parts += [
            f"All polarization resistors in parallel (Re) give {low} to {high} ohm.",
            f"With {item.most_polarized_ohm} ohm at the master, at most {item.most_polarized}"
            " stations have 4.7 kohm.",
        ]
    if item.best_ohm:
        parts.append(f"Recommended are {item.best_ohm} ohm.")
    return " ".join((*parts, f"At both ends: {TERMINATORS[item.terminator]}.", item.cable))


def end_texts(item: LineSchematic) -> Iterator[str]:
    """Return the polarization and the termination of a schematic for a person at the line."""
    if item.master_ohm:
        span = " to ".join(map(str, dict.fromkeys(item.master_ohm)))
        yield f"Polarization: {span} ohm to each of 5 V and common, in one place, at the master."
    yield f"Termination: {TERMINATORS[item.terminator]} at both ends."


def _parts(data: ProfileData) -> Iterator[PageRow]:
    for part in data.parts:
        yield PageRow(part.number, part.text, SURENESS[part.confidence])


_WAYS = {"rj45": "RJ45", "boxes": "Screw terminals", "sub_d": "SUB-D"}
"""By the field of a master, the name of its way to build the line."""


def _masters(data: ProfileData) -> Iterator[PageRow]:
    for master in data.masters:
        head = master.name
        for field, way in _WAYS.items():
            if cable := getattr(master, field):
                yield PageRow(head, f"{way}: {cable}", SURENESS[master.confidence])
                head = ""


def _keypad_functions(data: ProfileData) -> Iterator[PageRow]:
    for function in data.keypad_functions:
        yield PageRow(function.code, function.text, SURENESS[function.confidence])


def _addresses(data: ProfileData) -> Iterator[PageRow]:
    known = data.addresses
    off = known.off is not None and known.factory == known.off
    left = "OFF" if off else str(known.factory)
    yield PageRow("Drive", f"{known.first} to {known.last}; factory setting {left}")
    if known.off is not None:
        yield PageRow("Off", f"{known.off}: the drive does not answer", "", True)
    if known.zero_digit_is_group:
        text = "an address with a digit 0 (10, 20, 100) selects a group of drives"
        yield PageRow("Groups", text, "", True)
    sent = f"address {known.broadcast}" if known.broadcast is not None else "none"
    yield PageRow("Broadcast", sent)
    if known.note:
        yield PageRow("", known.note)
    for server in known.servers:
        text = f"{server.name}: {server.note}" if server.note else server.name
        yield PageRow(server.parameter, f"another server with its own address. {text}")


def _silence(data: ProfileData) -> Iterator[PageRow]:
    watch = data.communication_fault
    if watch is None:
        yield PageRow("", "No available document describes the reaction.", "", True)
        return
    code = watch.timeout
    text = code if watch.off is None else f"{code}; {watch.off} switches it off"
    yield PageRow("Timeout", text)
    yield PageRow("Starts", watch.starts)
    for reaction in watch.reactions:
        head = f"{watch.reaction} = {reaction.raw}" if watch.reaction else reaction.name
        yield PageRow(head, f"{reaction.name}: {reaction.does}", "", reaction.motor_keeps_running)
    if watch.note:
        yield PageRow("", watch.note)


def _after_reset(data: ProfileData) -> Iterator[PageRow]:
    for reset in data.faults.after_reset:
        yield PageRow("*", reset.text, SURENESS[reset.confidence], reset.by == "others")


def _lamps(data: ProfileData) -> Iterator[PageRow]:
    for lamp in data.wiring.lamps:
        yield PageRow(lamp.name, lamp.tells, SURENESS[lamp.confidence])


def _commands(data: ProfileData) -> Iterator[PageRow]:
    for example in data.command_examples:
        text = f"{example.does}. {example.note}" if example.note else example.does
        yield PageRow(f"16#{example.word:04X}", text, SURENESS[example.confidence])


def _errata(data: ProfileData) -> Iterator[PageRow]:
    for erratum in data.errata:
        why = f" {erratum.why}" if erratum.why else ""
        yield PageRow(
            "*", f"{erratum.place}. Printed: {erratum.printed}. Right: {erratum.right}.{why}"
        )
