"""Where the cycles of `watch` go: JSON lines, a table that stays in place, lines, a CSV file."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TextIO

from .errors import USAGE, Failure
from .output import console, iso_time, print_json, readings_json, readings_table
from .say import say

if TYPE_CHECKING:
    from rich.live import Live

    from tui.session.drive import DriveSession
    from tui.session.monitor.snapshot import Snapshot
    from tui.session.reading import Reading


class Output(Protocol):
    """Takes one cycle after the other."""

    def take(self, snapshot: Snapshot) -> None:
        """Put one cycle out, at once."""


class JsonOutput:
    """One object a line on standard output; trouble goes to standard error when it begins."""

    def __init__(
        self, line_text: str, session: DriveSession, timeout: Mapping[str, Any] | None
    ) -> None:
        self._timeout = timeout
        self._line_text = line_text
        self._session = session
        self._trouble = False

    def take(self, snapshot: Snapshot) -> None:
        """Print one cycle as an object."""
        data = readings_json(self._line_text, self._session, snapshot.readings)
        told = {"time": iso_time(snapshot.wall), **data, "timeout": self._timeout}
        print_json(told, compact=True)
        if snapshot.error and not self._trouble:
            say(f"drivepanel: {snapshot.error}", err=True)
        self._trouble = bool(snapshot.error)


class LineOutput:
    """One line of text a cycle, for a file or another program."""

    def take(self, snapshot: Snapshot) -> None:
        """Print one cycle as a line; a value that is not good is in brackets."""
        values = "  ".join(_shown(code, one) for code, one in snapshot.readings.items())
        parts = (_clock(snapshot), snapshot.state.headline, values, snapshot.error)
        say("  ".join(part for part in parts if part))


class TableOutput:
    """A table that stays in its place on a terminal."""

    def __init__(self, live: Live) -> None:
        self._live = live

    def take(self, snapshot: Snapshot) -> None:
        """Show one cycle in place of the one before."""
        parts = (_clock(snapshot)[:8], snapshot.state.headline, snapshot.error)
        title = "  ".join(part for part in parts if part)
        width = self._live.console.width
        table = readings_table(snapshot.readings, title, width=width)
        self._live.update(table, refresh=True)


class CsvOutput:
    """Engineering values in a CSV file; a cell without a good value is empty."""

    def __init__(self, file: TextIO, session: DriveSession, codes: Sequence[str]) -> None:
        self._file = file
        self._rows = csv.writer(file)
        self._units = {code: session.profile[code].unit for code in codes}
        taught = session.profile.taught
        marked = {c: f"{u}, taught" if c in taught and u else u for c, u in self._units.items()}
        titles = [f"{code} [{unit}]" if unit else code for code, unit in marked.items()]
        self._rows.writerow(["time", *titles, "error"])

    def take(self, snapshot: Snapshot) -> None:
        """Write one cycle as a row."""
        cells = [self._cell(code, snapshot.readings[code]) for code in self._units]
        self._rows.writerow([iso_time(snapshot.wall), *cells, snapshot.error])
        self._file.flush()

    def _cell(self, code: str, reading: Reading) -> str:
        if reading.quality != "good":
            return ""
        # a value whose scale is not known is a raw one, not one in the unit of its column
        same = reading.unit == self._units[code]
        return reading.text if same else f"{reading.text} {reading.unit}"


@contextmanager
def text_output() -> Iterator[Output]:
    """What suits standard output: a table on a terminal, else lines."""
    if not sys.stdout.isatty():
        yield LineOutput()
        return
    from rich.live import Live

    with Live(console=console(), auto_refresh=False) as live:
        yield TableOutput(live)


@contextmanager
def csv_output(path: Path, session: DriveSession, codes: Sequence[str]) -> Iterator[Output]:
    """A CSV file with these columns; raises Failure where it cannot be written."""
    try:
        file = path.open("w", newline="", encoding="utf-8")
    except OSError as error:
        raise Failure(f"{path} cannot be written: {error.strerror}.", USAGE) from error
    with file:
        yield CsvOutput(file, session, codes)


def _clock(snapshot: Snapshot) -> str:
    return iso_time(snapshot.wall)[11:23]


def _shown(code: str, reading: Reading) -> str:
    text = f"{reading.text} {reading.unit}".rstrip() if reading.value else reading.text
    if reading.value is not None and reading.value.taught:
        text += " taught"
    return f"{code} {text}" if reading.quality == "good" else f"{code} ({text}, {reading.quality})"
