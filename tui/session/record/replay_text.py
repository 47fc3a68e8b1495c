"""The text that names a replay, `FILE[,at=TIME]`, and its errors."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from tui.bus.errors import LinkSyntaxError

from .replay_line import ReplayLine
from .ring import DAMAGED_MARK, files_of_line
from .schema import RecordDamaged

REPLAY_LEAD = 60.0
"""Seconds before the time of a replay that pass quickly, for curves and counts."""
_AT = ",at="
_TIMES = ("%H:%M", "%H:%M:%S", "%H:%M:%S.%f")


class ReplayText(NamedTuple):
    """A file, a folder of files or a line, and the time at which its replay begins, as typed."""

    path: Path
    at: str = ""
    """Empty for the begin."""

    @property
    def text(self) -> str:
        """The same as one text."""
        return f"{self.path}{_AT if self.at else ''}{self.at}"


def parse_replay(text: str) -> ReplayText:
    """Take a text apart, without opening its file."""
    path, _, at = text.strip().rpartition(_AT)
    if not path:
        path, at = at, ""
    return ReplayText(Path(path).expanduser(), at.strip())


def open_replay(wanted: ReplayText, files: Sequence[Path] = (), *, lead: float = 0.0) -> ReplayLine:
    """Open a record for a replay. `files` are those of the line, if it names one.

    Raises LinkSyntaxError.
    """
    path = wanted.path
    found = [path] if path.is_file() else _files_in(path) if path.is_dir() else [*files]
    if not found:
        raise LinkSyntaxError(f"{path} is not a file. Name a record, as in docs/recording.md.")
    try:
        line = ReplayLine(path, files=found)
        if not wanted.at:
            return line
        at = time_in(wanted.at, line.clock.begin, line.clock.end)
        line.close()
        return ReplayLine(path, at, lead=lead, files=found)
    except RecordDamaged as error:
        raise LinkSyntaxError(f"{path} cannot be replayed: {error}.") from error
    except (OSError, sqlite3.Error) as error:
        raise LinkSyntaxError(f"{path} cannot be replayed: {error}.") from error


def _files_in(folder: Path) -> list[Path]:
    """Return the files of the one line in a folder, the oldest day first."""
    found = [path for path in files_of_line(folder, "*") if DAMAGED_MARK not in path.name]
    names = {path.stem.partition("_")[2] for path in found}
    if len(names) > 1:
        text = f"{folder} has files of several lines: {', '.join(sorted(names))}."
        raise LinkSyntaxError(f"{text} Name one file, or the line.")
    return found


def time_in(text: str, begin: float, end: float) -> float:
    """Return a time of day or a date with a time as seconds since 1970. Raises LinkSyntaxError.

    A time without a date is the first one from `begin` on; without a zone it is local.
    """
    first = datetime.fromtimestamp(begin).astimezone()
    moment = _time_of_day(text, first) or _date_and_time(text)
    if moment is None:
        raise LinkSyntaxError(
            f"{text!r} is not a time. Write HH:MM, HH:MM:SS, or a date with a time, for example"
            f" {first:%Y-%m-%dT%H:%M}."
        )
    last = datetime.fromtimestamp(end).astimezone()
    if not begin - 1 <= moment <= end + 1:
        raise LinkSyntaxError(
            f"{text} is outside the record: it has {first:%Y-%m-%d %H:%M:%S} to"
            f" {last:%Y-%m-%d %H:%M:%S}."
        )
    return min(max(moment, begin), end)


def _time_of_day(text: str, first: datetime) -> float | None:
    for form in _TIMES:
        try:
            time = datetime.strptime(text, form).time()
        except ValueError:
            continue
        moment = datetime.combine(first.date(), time).astimezone()
        if form == _TIMES[0] and moment <= first < moment + timedelta(minutes=1):
            return first.timestamp()  # the minute in which the record begins
        if moment < first.replace(microsecond=0):
            moment = datetime.combine(first.date() + timedelta(days=1), time).astimezone()
        return moment.timestamp()
    return None


def _date_and_time(text: str) -> float | None:
    try:
        return datetime.fromisoformat(text).astimezone().timestamp()
    except ValueError:
        return None
