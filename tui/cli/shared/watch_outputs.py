"""Outputs of `watch`: JSON lines, a table that stays in place, lines, a CSV file."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from .csv_files import CsvFile
from .output import (
    console,
    drive_fields,
    iso_time,
    print_json,
    readings_table,
    value_field,
)
from .rows import Column, row_text
from .say import say

if TYPE_CHECKING:
    from rich.live import Live

    from tui.session.drive import DriveSession
    from tui.session.drive_state import DriveState
    from tui.session.monitor.snapshot import Snapshot
    from tui.session.reading import Reading

    from ..documents.drive_documents import CycleDocument
    from ..documents.parts import WatchedValueField


@dataclass(frozen=True, slots=True, eq=False)
class WatchedDrive:
    """A drive that is watched, with its line."""

    session: DriveSession
    codes: list[str]
    """All that is reported about it."""
    line_text: str
    line_name: str
    """The line as typed: its name in the settings file if it has one."""


@dataclass(frozen=True, slots=True)
class LabelsNeeded:
    """There are several of them, so each is named."""

    lines: bool
    drives: bool

    def who(self, drive: WatchedDrive) -> str:
        """Which drive on which line, as far as that is a question."""
        return self.named(drive.line_name, drive.session.device)

    def named(self, line_name: str, device: int) -> str:
        """The same for a drive named by its line, as typed, and its address."""
        line = line_name if self.lines else ""
        drive = f"device {device}" if self.drives else ""
        return row_text((Column(), Column()), (line, drive))

    def cells(self, drive: WatchedDrive) -> list[str]:
        """The same for the columns()."""
        line = [drive.line_name] if self.lines else []
        return [*line, *([str(drive.session.device)] if self.drives else [])]

    def columns(self) -> list[Column]:
        """The columns that identify it."""
        return [Column(name) for name, is_needed in self._names() if is_needed]

    def _names(self) -> tuple[tuple[str, bool], ...]:
        return ("line", self.lines), ("device", self.drives)


class Output(Protocol):
    """Takes one cycle after the other."""

    def take(self, drive: WatchedDrive, snapshot: Snapshot) -> None:
        """Put one cycle of a drive out, at once."""


class JsonOutput:
    """One object a line on standard output; trouble goes to standard error when it begins."""

    def __init__(self, several: LabelsNeeded) -> None:
        self._several = several
        self._in_trouble: set[WatchedDrive] = set()

    def take(self, drive: WatchedDrive, snapshot: Snapshot) -> None:
        """Print one cycle as an object."""
        print_json(cycle_document(drive.line_text, drive.session, snapshot), compact=True)
        if snapshot.error and drive not in self._in_trouble:
            where = f"{drive.line_name}: " if self._several.lines else ""
            say(f"drivepanel: {where}{snapshot.error}", err=True)
        (self._in_trouble.add if snapshot.error else self._in_trouble.discard)(drive)


def cycle_document(line_text: str, session: DriveSession, snapshot: Snapshot) -> CycleDocument:
    """One cycle: values with their own times, state, direction and error."""
    from tui.session.reading import with_text

    from ..documents.drive_documents import CycleDocument, CycleTime

    return CycleDocument(
        time=iso_time(snapshot.wall),
        **drive_fields(line_text, session),
        values={
            code: _cycle_value(snapshot, read)
            for code, read in with_text(snapshot.readings).items()
        },
        state=known_state(snapshot.state),
        direction=snapshot.state.direction,
        error=snapshot.error or None,
        contact=snapshot.contact,
        cycle=CycleTime(seconds=round(snapshot.period, 3), wished=snapshot.wished),
    )


def _cycle_value(snapshot: Snapshot, reading: Reading) -> WatchedValueField:
    """One value, with the time at which it was read."""
    from msgspec.structs import asdict

    from ..documents.parts import WatchedValueField

    read_at = snapshot.wall - (snapshot.time - reading.time)
    return WatchedValueField(
        **asdict(value_field(reading)),
        time=None if reading.raw is None else iso_time(read_at),
        error=reading.error or None,
    )


def known_state(state: DriveState) -> str | None:
    """The kind of a state that was read; None if its words are missing, or show nothing."""
    return state.kind if state.headline and state.kind != "unknown" else None


def late_text(snapshot: Snapshot) -> str:
    """The cycle time as it is, if the line does not keep the wished one; else nothing."""
    if not snapshot.too_slow or snapshot.error:
        return ""
    return f"(a cycle takes {snapshot.period:.1f} s, not {snapshot.wished:g} s: the line is full)"


class LineOutput:
    """One line of text a cycle, for a file or another program."""

    def __init__(self, several: LabelsNeeded) -> None:
        self._several = several

    def take(self, drive: WatchedDrive, snapshot: Snapshot) -> None:
        """Print one cycle as a line; a value that is not good is in brackets."""
        from tui.session.reading import with_text

        values = [_shown(code, read) for code, read in with_text(snapshot.readings).items()]
        head = (_clock(snapshot), self._several.who(drive), snapshot.state.headline)
        cells = (*head, *values, snapshot.error, late_text(snapshot))
        say(row_text((Column(),) * len(cells), cells))


class TableOutput:
    """A table for each drive that stays in its place on a terminal."""

    def __init__(self, live: Live, watched: Sequence[WatchedDrive], several: LabelsNeeded) -> None:
        self._live = live
        self._several = several
        self._latest: dict[WatchedDrive, Snapshot | None] = dict.fromkeys(watched)

    def take(self, watched_drive: WatchedDrive, snapshot: Snapshot) -> None:
        """Replace the shown cycle of this drive."""
        from rich.console import Group

        from tui.session.reading import with_text

        self._latest[watched_drive] = snapshot
        tables = []
        for drive, latest in self._latest.items():
            if latest is None:
                continue
            parts = (
                _clock(latest)[:8], self._several.who(drive), latest.state.headline, latest.error,
                late_text(latest),
            )  # fmt: skip
            title = row_text((Column(),) * len(parts), parts)
            readings, width = with_text(latest.readings), self._live.console.width
            tables.append(readings_table(readings, title, width=width))
        self._live.update(Group(*tables), refresh=True)


class CsvOutput:
    """Engineering values in a CSV file; a cell without a good value is empty."""

    def __init__(self, file: CsvFile, units: Mapping[str, str], several: LabelsNeeded) -> None:
        self._file = file
        self._units = units
        self._several = several

    def take(self, drive: WatchedDrive, snapshot: Snapshot) -> None:
        """Write one cycle as a row."""
        from tui.session.reading import with_text

        readings = with_text(snapshot.readings)
        cells = [self._cell(code, readings.get(code)) for code in self._units]
        state = snapshot.state
        reported = [snapshot.error, known_state(state) or "", state.direction or ""]
        self._file.write([iso_time(snapshot.wall), *self._several.cells(drive), *cells, *reported])

    def _cell(self, code: str, reading: Reading | None) -> str:
        if reading is None or reading.quality != "good":
            return ""
        # a value whose scale is not known is a raw one, not one in the unit of its column
        same = reading.unit == self._units[code]
        return reading.text if same else f"{reading.text} {reading.unit}"


def csv_units(watched: Sequence[WatchedDrive]) -> dict[str, str]:
    """The unit of each column: that of the first drive which has the code."""
    units: dict[str, str] = {}
    for drive in watched:
        for code in drive.codes:
            units.setdefault(code, drive.session.profile[code].unit)
    return units


def csv_columns(
    watched: Sequence[WatchedDrive], units: Mapping[str, str], several: LabelsNeeded
) -> list[Column]:
    """Return the columns of the file; a learned scale is marked."""
    taught = {code for drive in watched for code in drive.session.profile.taught}
    marked = {c: f"{u}, taught" if c in taught and u else u for c, u in units.items()}
    values = [Column(code, unit) for code, unit in marked.items()]
    state = map(Column, ("error", "state", "direction"))
    return [Column("time"), *several.columns(), *values, *state]


@contextmanager
def text_output(watched: Sequence[WatchedDrive], several: LabelsNeeded) -> Iterator[Output]:
    """Yield the output for standard output: a table on a terminal, else lines."""
    if not sys.stdout.isatty():
        yield LineOutput(several)
        return
    from rich.live import Live

    with Live(console=console(), auto_refresh=False) as live:
        yield TableOutput(live, watched, several)


def _clock(snapshot: Snapshot) -> str:
    return iso_time(snapshot.wall)[11:23]


def _shown(code: str, reading: Reading) -> str:
    text = f"{reading.text} {reading.unit}".rstrip() if reading.value else reading.text
    if reading.value is not None and reading.value.taught:
        text = f"{text} taught"
    return f"{code} {text}" if reading.quality == "good" else f"{code} ({text}, {reading.quality})"
