"""Lines to choose from: named lines, serial ports, recent lines and simulated ones."""

from __future__ import annotations

import os
import re
from functools import lru_cache
from typing import Literal, NamedTuple

from rich.style import Style
from rich.text import Text

from tui.bus.errors import LinkSyntaxError
from tui.drive.plain import plain
from tui.drive.profile.library import demo_drives
from tui.session.connect.line_key import SIMULATED_PREFIX, line_key
from tui.session.connect.named_lines import LineSettings, line_named
from tui.session.connect.open_line import check_line
from tui.session.connect.port_settings import PortSettings, last_settings, port_of
from tui.widgets.drawing import short
from tui.widgets.palette import FAINT, FAULT, PLAIN, RUNNING, STRONG

_LASTING = re.compile(r"(?:serial:)?/dev/serial/by-(?:id|path)/(?:usb-)?")
COUNTED = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def line_forms() -> tuple[str, ...]:
    """Return an example of each kind of LINE."""
    return (
        "serial:/dev/ttyUSB0,19200,8E1 (and ,timeout=2 for slow drives)",
        "tcp:192.168.0.10:502",
        "rtu-tcp:192.168.0.10:4001",
        *(text for text, _ in simulated_lines()[2:]),
    )


@lru_cache(maxsize=1)
def simulated_lines() -> tuple[tuple[str, str], ...]:
    """Return simulated lines with descriptions; empty if no profile has a demo drive.

    They have all demo drives, the fastest one alone, and the fastest with the first.
    """
    shown = demo_drives()
    if not shown:
        return ()
    count = COUNTED[len(shown)] if len(shown) < len(COUNTED) else str(len(shown))
    first, fastest = next(iter(shown)), max(shown, key=lambda text: shown[text][1])
    name = shown[fastest][0]
    return (
        (f"sim:{','.join(shown)}", f"{count} drives"),
        (f"sim:{fastest}@2", f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}"),
        (f"sim:{fastest}@2,{first}", "two drives"),
    )


class LineChoice(NamedTuple):
    """Line to open; `path` is set for a serial port, which gets its settings from the form."""

    text: str
    description: str
    path: str = ""
    name: str = ""
    """Name in the settings file."""
    device: int | None = None
    """Address of the drive that the name includes; None if it names only a line."""
    settings: PortSettings | None = None
    """Last settings of a serial port; None if it was not used before."""


ListMark = Literal["", "open", "shown", "fault"]
LIST_MARKS: dict[ListMark, tuple[str, Style]] = {
    "": ("  ", PLAIN),
    "open": ("● ", PLAIN),
    "shown": ("● ", RUNNING),
    "fault": ("■ ", FAULT),
}
"""Sign and style by mark; `fault` is an open line in the background with a drive in fault."""


class Group(NamedTuple):
    """Heading with its choices; `empty` is the note if there are none."""

    title: str
    choices: tuple[LineChoice, ...]
    empty: str = ""


def groups(
    ports: list[tuple[str, str]], recent: list[str], settings: LineSettings | None = None
) -> list[Group]:
    """Return the groups in display order; `ports` are pairs of path and description.

    `recent` are lines used lately, the last one first. A listed port takes its last settings from
    them: it has one entry, whatever name it was used by. The port of a named line is listed there.
    """
    used = last_settings(recent) if ports else {}
    named = {port_of(line.line) for line in settings.lines.values()} if settings else set()
    serial = tuple(
        LineChoice(path, description, path, settings=used.get(os.path.realpath(path)))
        for path, description in ports
        if os.path.realpath(path) not in named
    )
    listed = {os.path.realpath(choice.path) for choice in serial}
    lately = tuple(
        LineChoice(text, "")
        for text in recent
        if not _offered_simulated(text) and port_of(text) not in listed
    )
    return [
        *_named(settings),
        Group("Serial ports", serial, "" if ports else "none found"),
        Group("Recent", lately, "none yet (n: type one)"),
        Group("Simulated", tuple(LineChoice(text, about) for text, about in simulated_lines()[:2])),
    ]


def _named(settings: LineSettings | None) -> list[Group]:
    """Return the group of named lines, with a note if the settings file has errors."""
    if settings is None or not (settings.lines or settings.faults):
        return []
    fault = f"error in {settings.path.name}" if settings.faults else ""
    lines = tuple(
        LineChoice(line.line, _without_settings(line.line), name=line.name, device=line.device)
        for line in settings.lines.values()
    )
    return [Group("Named", lines, fault)]


def _without_settings(line: str) -> str:
    """Drop the settings of a line on an adapter's permanent name, which leaves no room for them."""
    return line.partition(",")[0] if _LASTING.match(line) else line


def _offered_simulated(text: str) -> bool:
    """Return True for a simulated line that the list offers anyway."""
    # compare spellings: importing the simulator would delay the first screen
    offered = [item for item, _ in simulated_lines()[:2]]
    return text.replace(" ", "").casefold() in (*offered, *map(_with_addresses, offered))


def _with_addresses(line: str) -> str:
    """Add addresses, counted from 1, to a simulated line that names none."""
    ids = line.removeprefix("sim:").split(",")
    if "@" in line:
        return line
    return "sim:" + ",".join(f"{text}@{place}" for place, text in enumerate(ids, 1))


def fault_of_line(text: str) -> str:
    """Return the error text for a typed LINE or name; empty if it is valid."""
    try:
        named = line_named(text.strip())
        check_line(named.line if named else text)
    except LinkSyntaxError as error:
        return str(error)
    return ""


def same_line(item: str, other: str) -> bool:
    """Return True if two texts, in any spelling, are the same line with the same settings."""
    if item == other:
        return True
    from tui.bus.link import SerialLink, parse_link

    if len({text.casefold().startswith(SIMULATED_PREFIX) for text in (item, other)}) > 1:
        return False  # before line_key, which would import the simulator
    if line_key(item) != line_key(other):
        return False
    try:
        links = [parse_link(item), parse_link(other)]
    except LinkSyntaxError:
        return True  # simulated: it has no settings
    settings = [
        (link.timeout, *((link.baud, link.format) if isinstance(link, SerialLink) else ()))
        for link in links
    ]
    return settings[0] == settings[1]


def line_in(text: str, width: int) -> str:
    """Shorten a line to `width` cells.

    An adapter's permanent name keeps its end, which identifies the adapter.
    """
    found = _LASTING.match(text)
    if found is None or len(text) <= width:
        return short(text, width)
    rest = text[found.end() :].replace("-if00-port0", "", 1)
    return short(rest, width) if len(rest) <= width else f"…{plain(rest)[1 - width :]}"


def choice_line(choice: LineChoice, width: int, mark: ListMark = "") -> Text:
    """Draw a line with its mark, and with its description if at least 6 cells are free."""
    here = bool(mark)
    sign, style = LIST_MARKS[mark]
    text = Text().append(sign, style)
    text.append(line_in(choice.name or choice.text, width - 2), STRONG if here else PLAIN)
    room = width - text.cell_len - 2
    if choice.description and room >= 6:
        drive = "" if choice.device is None else f"{choice.device} on "
        text.append(f"  {drive}{line_in(choice.description, room - len(drive))}", FAINT)
    return text
