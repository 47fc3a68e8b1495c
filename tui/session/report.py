"""A report on one drive as Markdown: what it is, how it is set up, and what was changed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, tzinfo

from tui.drive.blocks.assignment import slot_target
from tui.drive.channel import switch_texts
from tui.drive.chart import read_chart
from tui.drive.control_source import source_in_force
from tui.drive.hints import advice_now, hint_markdown, reset_text
from tui.drive.model import model_read
from tui.drive.plain import markdown_cell, markdown_table, plain
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block, Quantity
from tui.drive.settings.compare import compare_settings, factory_side, side_of
from tui.drive.settings.parameter_set import ParameterSet, lacking
from tui.drive.shown import shown
from tui.drive.values import NOT_AVAILABLE, set_bits

from .journal import FAULT_WHYS, RECORD_SHOWS_IT, Entry

ENTRIES_SHOWN = 200
"""Most journal entries in a report; it has the latest ones."""
CHANNEL_QUANTITIES: tuple[Quantity, ...] = ("command_channel", "reference_channel")


def report_text(
    profile: Profile,
    values: ParameterSet,
    entries: Sequence[Entry],
    trends: Sequence[str] = (),
    start_up: Sequence[str] = (),
) -> str:
    """Return the report as Markdown; `entries` are the drive's journal entries, oldest first.

    `trends` are lines about its last trip and run, `start_up` those about its start-up.
    """
    maker = ReportParts.from_entries(profile, values, entries)
    parts = (
        maker.head(),
        maker.line(),
        maker.changed(),
        maker.control(),
        maker.blocks(),
        maker.watch(),
        maker.faults(),
        maker.seen(),
        *([trends] if trends else []),
        *([start_up] if start_up else []),
        maker.journal(),
    )
    return plain("\n".join(line for part in parts for line in (*part, "")), lines=True)


PARAMETERS_READ = "- Parameters: {read} read", "- Parameters: {read} read, {absent} not"
"""Without and with parameters that could not be read."""


@dataclass(frozen=True, slots=True)
class ReportParts:
    """The parts of a report on one drive, each as lines of Markdown."""

    profile: Profile
    values: ParameterSet
    entries: Sequence[Entry]
    trips: Sequence[Entry]
    proofs: Sequence[Entry] = ()

    @classmethod
    def from_entries(
        cls, profile: Profile, values: ParameterSet, entries: Sequence[Entry]
    ) -> ReportParts:
        """Return the parts; `entries` are the drive's journal entries, oldest first."""
        written, trips, proofs = (
            [entry for entry in entries if entry.kind == kind]
            for kind in ("write", "fault", "proof")
        )
        return cls(profile, values, written, trips, proofs)

    @property
    def zone(self) -> tzinfo:
        """Time zone of all times in the report: that of the computer that read the drive."""
        return _zone_of(self.values.head.time)

    def zone_text(self) -> str:
        """Return the zone as its difference from UTC."""
        offset = datetime.now(self.zone).strftime("%z")
        return f"UTC{offset[:3]}:{offset[3:5]}"

    def head(self) -> list[str]:
        """Return the identity of the drive, and when and where it was read."""
        head = self.values.head
        known = [
            f"- {key.capitalize()}: {markdown_cell(text)}" for key, text in head.identity.items()
        ]
        model = model_read(self.profile, self.values.raws)
        absent = len(self.values.absent)
        known += [f"- Model by its own code: {markdown_cell(model)}"] if model else []
        return [
            f"# {self.profile.name} at {head.line}, address {head.device}",
            "",
            f"- Read: {zoned_time(head.time, self.zone)}; times here are {self.zone_text()}",
            f"- Profile: {self.profile.id}, version {head.profile_version}; panel {head.panel}",
            *(known or ["- The drive does not identify itself."]),
            PARAMETERS_READ[bool(absent)].format(read=len(self.values.raws), absent=absent),
        ]

    def line(self) -> list[str]:
        """Return the drive's communication settings."""
        rows = [
            (s.parameter, self.profile[s.parameter].name, self.text(s.parameter))
            for s in self.profile.data.link.settings
        ]
        table = table_markdown(("code", "name", "value"), rows)
        return ["## Line settings of the drive", "", *table]

    def changed(self) -> list[str]:
        """Return the settings that differ from the factory's, with the first old value written."""
        before: dict[str, str] = {}
        for entry in self.entries:
            before.setdefault(entry.code, entry.old)
        sides = factory_side(self.profile, self.values), side_of("now", self.values)
        rows = [
            (row.code, row.name, row.a, row.b, before.get(row.code, ""))
            for row in compare_settings(self.profile, *sides)
        ]
        known = len(sides[0].raws)
        return [
            "## Settings changed from the factory",
            "",
            f"The factory settings of {known} parameters are known; ? marks those that no document"
            " of this family states. Before: the first old value in the journal.",
            "",
            *table_markdown(("code", "name", "factory", "now", "before"), rows),
        ]

    def control(self) -> list[str]:
        """Return the commander of the drive and the source of its reference."""
        raws = self.values.raws
        lines = [f"- Configuration: {self._configuration()}"]
        reported = read_chart(self.profile, raws)
        lines += [f"- Commanded by: {reported.channel}"] if reported.channel else []
        lines += [f"- Reference from: {reported.reference}"] if reported.reference else []
        lines += [f"- {text}" for text in switch_texts(self.profile, raws)]
        for quantity in CHANNEL_QUANTITIES:
            parameter = self.profile.quantity(quantity)
            if parameter is None or parameter.code not in raws:
                continue
            text = self.text(parameter.code)
            if parameter.bits:
                bits = set_bits(parameter.bits, raws[parameter.code])
                text = ", ".join(bit.name for bit in bits) or "none"
            lines.append(f"- {parameter.name} ({parameter.code}): {text}")
        return ["## Control source", "", *lines]

    def _configuration(self) -> str:
        """Return the name of the configuration of control sources, or why there is none."""
        sources, raws = self.profile.data.control_sources, self.values.raws
        if (source := source_in_force(self.profile, raws)) is not None:
            return source.name
        if not sources:
            return "the profile of this family lists none"
        possible = [
            source
            for source in sources
            if all(raws.get(word.parameter, word.value) == word.value for word in source.settings)
        ]
        words = (word.parameter for source in possible for word in source.settings)
        if unread := list(dict.fromkeys(code for code in words if code not in raws)):
            return f"not known (not read: {', '.join(unread)})"
        return "none of those in the manual"

    def blocks(self) -> list[str]:
        """Return the contents of indirect blocks and the communication scanner."""
        lines: list[str] = ["## Indirect blocks and scanner", ""]
        if not self.profile.data.blocks:
            return [*lines, "This family has none."]
        for block in self.profile.data.blocks:
            rows = [(slot, self._target(block, slot)) for slot in block.slots]
            lines += [f"{block.name}:", "", *table_markdown(("place", "mapped to"), rows), ""]
        return lines[:-1]

    def _target(self, block: Block, slot: str) -> str:
        raw = self.values.raws.get(slot)
        if raw is None:
            return NOT_AVAILABLE
        if (parameter := slot_target(self.profile, block, raw & 0xFFFF)) is not None:
            return f"{parameter.code} {parameter.name}"
        return "nothing" if not raw else f"raw {raw}"

    def watch(self) -> list[str]:
        """Return the drive's reaction to loss of communication."""
        watch = self.profile.data.communication_fault
        lines = ["## Loss of communication", ""]
        if watch is None:
            return [*lines, "What this family does then is in no document at hand."]
        raw = self.values.raws.get(watch.timeout)
        reported = self.text(watch.timeout)
        if raw is not None and raw == watch.off and reported.casefold() != "off":
            reported = f"{reported}, the watch is off"
        lines.append(f"- Timeout ({watch.timeout}): {reported}")
        if watch.reaction:
            held = self.values.raws.get(watch.reaction)
            known = next((r for r in watch.reactions if r.raw == held), None)
            row = f"- Reaction ({watch.reaction}): {self.text(watch.reaction)}"
            lines.append(f"{row}: {known.does}" if known else row)
        elif watch.reactions:
            lines.append(f"- Reaction: {watch.reactions[0].does}")
        lines.append(f"- The watch begins: {watch.starts}")
        if not self.proofs:
            return [*lines, "- Not tested. Run `drivepanel prove`, or press P on Control."]
        last = self.proofs[-1]
        return [*lines, f"- Tested {zoned_time(last.time, self.zone)}: {last.new}"]

    def faults(self) -> list[str]:
        """Return the present or last fault, and the drive's fault history."""
        data = self.profile.data.faults
        codes = list(dict.fromkeys(code for code in (data.parameter, *data.history) if code))
        if not codes:
            text = "No available document names a fault register of this family."
            return ["## Faults", "", text]
        rows = [(code, self.profile[code].name, self.fault_text(code)) for code in codes]
        lines = ["## Faults", "", *table_markdown(("code", "name", "fault"), rows)]
        for code, stored in zip(data.history, data.stored, strict=False):
            if self.values.raws.get(code) in (None, data.none):
                continue
            kept = [(text, self.profile[text].name, self.text(text)) for text in stored]
            head = f"What the drive stored with {code}, {self.fault_text(code)}:"
            lines += ["", head, "", *table_markdown(("code", "name", "value"), kept)]
        return [*lines, *self._pointed_at(codes)]

    def _pointed_at(self, codes: Sequence[str]) -> list[str]:
        """Return the causes of the faults in these words, each once."""
        lines: list[str] = []
        raws = (self.values.raws.get(code) for code in codes)
        for raw in dict.fromkeys(raw for raw in raws if raw is not None):
            fault, help_ = self.profile.fault(raw), self.profile.guide.fault(raw)
            if fault is None or help_ is None:
                continue
            reset = reset_text(help_, None, "a fault reset").text
            held = self.values.raws
            latest = raw == held.get(self.profile.data.faults.parameter)
            left = advice_now(self.profile, help_, held, present=False, latest=latest)
            reported = hint_markdown(self.profile, help_, left, self.text, reset)
            lines += ["", f"What {fault.code} {fault.name} points at:", "", *reported]
        return lines

    def fault_text(self, code: str) -> str:
        """Return the fault in a word of the drive, with its code and name."""
        raw = self.values.raws.get(code)
        if raw is None:
            return NOT_AVAILABLE
        fault = self.profile.fault(raw)
        if fault is None:
            return "none" if raw == self.profile.data.faults.none else self.text(code)
        return f"{fault.code} {fault.name}"

    def seen(self) -> list[str]:
        """Return the trips of this drive that Drive Panel observed on this computer."""
        rows = [
            (
                zoned_time(trip.tripped, self.zone) if trip.tripped else "not seen",
                zoned_time(trip.seen, self.zone),
                trip.code,
                trip.name,
                zoned_time(trip.reset, self.zone) if trip.reset else "",
            )
            for trip in trips_of(self.trips)[-ENTRIES_SHOWN:]
        ]
        head = ("tripped at", "seen since", "fault", "name", "reset seen at")
        return ["## Trips seen by Drive Panel", "", *table_markdown(head, rows)] if rows else []

    def journal(self) -> list[str]:
        """Return the writes to this drive from this computer."""
        last = self.entries[-ENTRIES_SHOWN:]
        left = len(self.entries) - len(last)
        rows = [
            (zoned_time(e.time, self.zone), e.code, e.old, e.new, e.answer, e.why) for e in last
        ]
        head = ("time", "code", "old", "new", "answer", "why")
        earlier = [f"{left} earlier ones are in the journal.", ""] if left else []
        return ["## Writes by Drive Panel", "", *earlier, *table_markdown(head, rows)]

    def text(self, code: str) -> str:
        """Return a parameter's value with its unit, or dashes."""
        raw = self.values.raws.get(code)
        if raw is None:
            return NOT_AVAILABLE
        raws = self.values.raws
        parameter = self.profile[code]
        return shown(self.profile, parameter, raw, raws, lacking(self.profile, raws)).display


def zoned_time(text: str, zone: tzinfo | None) -> str:
    """Format an ISO time in a zone, to the second; return an invalid time unchanged."""
    try:
        return f"{datetime.fromisoformat(text).astimezone(zone):%Y-%m-%d %H:%M:%S}"
    except ValueError:
        return text


def _zone_of(text: str) -> tzinfo:
    """Return the time zone of an ISO time; UTC if it has none."""
    try:
        return datetime.fromisoformat(text).tzinfo or UTC
    except ValueError:
        return UTC


def table_markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return rows as a Markdown table; "None." without a row."""
    lines = markdown_table(head, rows)
    return lines if len(lines) > 2 else ["None."]


@dataclass(frozen=True, slots=True)
class Trip:
    """One trip; times as texts of the journal."""

    code: str
    name: str
    seen: str
    """The first time that the drive was seen in this fault."""
    tripped: str = ""
    """The time of the trip itself; empty if it was not seen."""
    reset: str = ""
    """The time at which its end was seen; empty if it was not."""


def trips_of(entries: Iterable[Entry]) -> list[Trip]:
    """One record per trip of one drive, oldest first; `entries` are its `fault` entries.

    A fault that is seen again without an end or another fault in between is the same trip.
    """
    found: list[Trip] = []
    for entry in entries:
        last = found[-1] if found else None
        ongoing = last is not None and not last.reset and last.code in ("", entry.code)
        if entry.answer == "reset":
            if last is not None and ongoing:
                found[-1] = replace(last, code=entry.code, name=entry.new, reset=entry.time)
            continue
        # older files say "tripped" of each fault that was there when a panel was opened
        known = entry.why in (FAULT_WHYS["tripped"], RECORD_SHOWS_IT)
        tripped = entry.answer == "tripped" and known
        if last is not None and ongoing and not tripped:
            found[-1] = replace(last, code=entry.code, name=entry.new)
        else:
            found.append(Trip(entry.code, entry.new, entry.time, entry.time if tripped else ""))
    return found
