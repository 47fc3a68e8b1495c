"""Where the cycles of `watch` go: JSON lines, a table that stays in place, lines, a CSV file."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from .csv_files import CsvFile
from .output import console, drive_json, iso_time, print_json, readings_json, readings_table
from .say import say

if TYPE_CHECKING:
    from rich.live import Live

    from tui.session.drive import DriveSession
    from tui.session.drive_state import DriveState
    from tui.session.monitor.snapshot import Snapshot
    from tui.session.reading import Reading


class Output(Protocol):
    """Takes one cycle after the other."""

    def take(self, session: DriveSession, snapshot: Snapshot) -> None:
        """Put one cycle of a drive out, at once."""


class JsonOutput:
    """One object a line on standard output; trouble goes to standard error when it begins."""

    def __init__(self, line_text: str) -> None:
        self._line_text = line_text
        self._in_trouble: set[int] = set()

    def take(self, session: DriveSession, snapshot: Snapshot) -> None:
        """Print one cycle as an object."""
        print_json(cycle_json(self._line_text, session, snapshot), compact=True)
        if snapshot.error and session.device not in self._in_trouble:
            say(f"drivepanel: {snapshot.error}", err=True)
        (self._in_trouble.add if snapshot.error else self._in_trouble.discard)(session.device)


def cycle_json(line_text: str, session: DriveSession, snapshot: Snapshot) -> dict[str, Any]:
    """The object of one cycle: values with their own times, state, direction and error."""
    values = readings_json(line_text, session, snapshot.readings)["values"]
    for code, reading in snapshot.readings.items():
        read_at = snapshot.wall - (snapshot.time - reading.time)
        values[code]["time"] = None if reading.raw is None else iso_time(read_at)
        values[code]["error"] = reading.error or None
    return {
        "time": iso_time(snapshot.wall),
        **drive_json(line_text, session),
        "values": values,
        "state": known_state(snapshot.state),
        "direction": snapshot.state.direction,
        "error": snapshot.error or None,
    }


def known_state(state: DriveState) -> str | None:
    """The kind of a state that was read; None where its words were not, or tell nothing."""
    return state.kind if state.headline and state.kind != "unknown" else None


class LineOutput:
    """One line of text a cycle, for a file or another program."""

    def __init__(self, *, several: bool) -> None:
        self._several = several

    def take(self, session: DriveSession, snapshot: Snapshot) -> None:
        """Print one cycle as a line; a value that is not good is in brackets."""
        values = "  ".join(_shown(code, one) for code, one in snapshot.readings.items())
        who = f"device {session.device}" if self._several else ""
        parts = (_clock(snapshot), who, snapshot.state.headline, values, snapshot.error)
        say("  ".join(part for part in parts if part))


class TableOutput:
    """A table for each drive that stays in its place on a terminal."""

    def __init__(self, live: Live, *, several: bool) -> None:
        self._live = live
        self._several = several
        self._latest: dict[int, tuple[DriveSession, Snapshot]] = {}

    def take(self, session: DriveSession, snapshot: Snapshot) -> None:
        """Show one cycle in place of the one before."""
        from rich.console import Group

        self._latest[session.device] = session, snapshot
        tables = []
        for device, (_, latest) in sorted(self._latest.items()):
            who = f"device {device}" if self._several else ""
            parts = (_clock(latest)[:8], who, latest.state.headline, latest.error)
            title = "  ".join(part for part in parts if part)
            tables.append(readings_table(latest.readings, title, width=self._live.console.width))
        self._live.update(Group(*tables), refresh=True)


class CsvOutput:
    """Engineering values in a CSV file; a cell without a good value is empty."""

    def __init__(self, file: CsvFile, units: Mapping[str, str], *, several: bool) -> None:
        self._file = file
        self._units = units
        self._several = several

    def take(self, session: DriveSession, snapshot: Snapshot) -> None:
        """Write one cycle as a row."""
        who = [str(session.device)] if self._several else []
        cells = [self._cell(code, snapshot.readings.get(code)) for code in self._units]
        state = snapshot.state
        told = [snapshot.error, known_state(state) or "", state.direction or ""]
        self._file.write([iso_time(snapshot.wall), *who, *cells, *told])

    def _cell(self, code: str, reading: Reading | None) -> str:
        if reading is None or reading.quality != "good":
            return ""
        # a value whose scale is not known is a raw one, not one in the unit of its column
        same = reading.unit == self._units[code]
        return reading.text if same else f"{reading.text} {reading.unit}"


def csv_units(watched: Sequence[tuple[DriveSession, Sequence[str]]]) -> dict[str, str]:
    """The unit of each column: that of the first drive which has the code."""
    units: dict[str, str] = {}
    for session, codes in watched:
        for code in codes:
            units.setdefault(code, session.profile[code].unit)
    return units


def csv_titles(
    watched: Sequence[tuple[DriveSession, Sequence[str]]], units: Mapping[str, str]
) -> list[str]:
    """The titles of the columns; a taught scale is marked."""
    taught = {code for session, _ in watched for code in session.profile.taught}
    marked = {c: f"{u}, taught" if c in taught and u else u for c, u in units.items()}
    titles = [f"{code} [{unit}]" if unit else code for code, unit in marked.items()]
    who = ["device"] if len(watched) > 1 else []
    return ["time", *who, *titles, "error", "state", "direction"]


@contextmanager
def text_output(*, several: bool) -> Iterator[Output]:
    """What suits standard output: a table on a terminal, else lines."""
    if not sys.stdout.isatty():
        yield LineOutput(several=several)
        return
    from rich.live import Live

    with Live(console=console(), auto_refresh=False) as live:
        yield TableOutput(live, several=several)


def _clock(snapshot: Snapshot) -> str:
    return iso_time(snapshot.wall)[11:23]


def _shown(code: str, reading: Reading) -> str:
    text = f"{reading.text} {reading.unit}".rstrip() if reading.value else reading.text
    if reading.value is not None and reading.value.taught:
        text += " taught"
    return f"{code} {text}" if reading.quality == "good" else f"{code} ({text}, {reading.quality})"
