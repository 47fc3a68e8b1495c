"""One line of time for rows of several files, and of a clock that jumped.

Readers see the tables `reply`, `reduced` and `event` through temporary views, in which `utc` never
goes back from one row to the next. It is the time by the last clock of a boot.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from operator import attrgetter

from .reduction import CLOCK_JUMP

LONGEST_SLEEP = 86400 * 1_000_000
"""Microseconds up to which a jump forward may be a computer that slept: it stays a gap."""
_FILE_STEP = 1 << 40
"""From the row numbers of one file to those of the next one."""
_SHIFTED = ("reply", "reduced", "event")


@dataclass(slots=True)
class ClockSpan:
    """Rows of one session between two jumps of the clock; times in microseconds."""

    file: int
    session: int
    boot: str
    begin: float
    """Monotonic time of the first row; -inf for the begin of the session."""
    offset: int
    """Time of day minus monotonic time."""
    mono: int
    """A monotonic time near the begin."""
    end: float = math.inf
    shift: int = 0
    """To be added to the times of day."""


def unfold(base: sqlite3.Connection, files: Sequence[str]) -> None:
    """Create the views if they are needed. `files` are the names of the attached files."""
    spans = [span for number in range(len(files)) for span in _spans(base, files[number], number)]
    _shift(base, files, spans)
    moved = [span for span in spans if span.shift]
    if not moved and len(files) < 2:
        return
    for table in (*_SHIFTED, "who"):
        selects = [
            text
            for number, file in enumerate(files)
            for text in _selects(
                table,
                number,
                file,
                [span for span in moved if span.file == number],
                [row[1] for row in base.execute(f"PRAGMA {file}.table_info({table})")],
            )
        ]
        base.execute(f"CREATE TEMP VIEW {table} AS {' UNION ALL '.join(selects)}")


def _spans(base: sqlite3.Connection, file: str, number: int) -> Iterable[ClockSpan]:
    jumps = base.execute(
        f"SELECT session, mono, utc - mono FROM {file}.event WHERE kind = 'clock' ORDER BY id"
    ).fetchall()
    sessions = base.execute(f"SELECT id, mono, utc - mono, boot FROM {file}.session ORDER BY id")
    for id, mono, offset, boot in sessions.fetchall():
        boot = boot or f"{number} {id}"  # some systems do not name it
        own = [ClockSpan(number, id, boot, -math.inf, offset, mono)]
        own += [ClockSpan(number, id, boot, at, to, at) for of, at, to in jumps if of == id]
        for before, after in pairwise(own):
            before.end = after.begin
        yield from own


def _shift(base: sqlite3.Connection, files: Sequence[str], spans: list[ClockSpan]) -> None:
    """Set the shifts: within each boot by the monotonic clock, then from boot to boot."""
    boots = []
    for _, same in groupby(sorted(spans, key=attrgetter("boot")), key=attrgetter("boot")):
        boot = sorted(same, key=attrgetter("mono"))
        least = boot[-1].offset
        for span in reversed(boot):
            if abs(span.offset - least) > CLOCK_JUMP:
                if not 0 < least - span.offset <= LONGEST_SLEEP:
                    span.shift = least - span.offset
                else:
                    least = span.offset
        boots.append(boot)
    boots.sort(key=lambda boot: boot[0].mono + boot[0].offset + boot[0].shift)
    following: int | None = None
    for boot in reversed(boots):
        last = boot[-1]
        end = _last_time(base, files[last.file], last) if following is not None else None
        if end is not None and following is not None and end + last.shift > following:
            for span in boot:
                span.shift -= end + last.shift - following
        following = boot[0].mono + boot[0].offset + boot[0].shift


def _last_time(base: sqlite3.Connection, file: str, span: ClockSpan) -> int | None:
    """Return the end of the last reply of a session."""
    row = base.execute(
        f"SELECT utc + took FROM {file}.reply WHERE session = ? ORDER BY id DESC LIMIT 1",
        (span.session,),
    ).fetchone()
    return None if row is None else int(row[0])


def _selects(
    table: str, number: int, file: str, moved: Sequence[ClockSpan], names: Sequence[str]
) -> Iterable[str]:
    """Yield a query for the rows that keep their time, and one for each span that moves."""
    numbered = {"id", "who", "session"}

    def query(shift: int, where: str) -> str:
        columns = [
            f"{name} + {number * _FILE_STEP} AS {name}" if number and name in numbered
            else f"utc + {shift} AS utc" if shift and name == "utc"
            else name
            for name in names
        ]  # fmt: skip
        return f"SELECT {', '.join(columns)} FROM {file}.{table}{where}"

    own = [(span.shift, _condition(span)) for span in moved if table in _SHIFTED]
    rest = "".join(f" AND NOT ({condition})" for _, condition in own)
    yield query(0, f" WHERE 1{rest}" if rest else "")
    for shift, condition in own:
        yield query(shift, f" WHERE {condition}")


def _condition(span: ClockSpan) -> str:
    ends = [f"session = {span.session}"]
    if math.isfinite(span.begin):
        ends.append(f"mono >= {span.begin}")
    if math.isfinite(span.end):
        ends.append(f"mono < {span.end}")
    return " AND ".join(ends)
