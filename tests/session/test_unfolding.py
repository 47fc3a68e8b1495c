"""A record whose clock jumped, and files of several days, are one line of time."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from tui.bus.errors import LinkSyntaxError
from tui.session.connect.recorded_line import replayed
from tui.session.record.reader import RecordReader
from tui.session.record.record_file import RecordFile
from tui.session.record.replay_line import ReplayLine
from tui.session.record.schema import EventRow, ReplyRow

from .test_replay import BEGIN, LINE, words

DAY = 86_400
Span = tuple[float, float, str]
"""Monotonic time of its begin, jump of the clock to it, and its boot."""


def at(mono: float, offset: float, word: int, took: int = 0) -> ReplyRow:
    times = round((BEGIN + mono + offset) * 1e6), round(mono * 1e6), took
    return ReplyRow(*times, 1, 3, 100, 1, 0, word.to_bytes(2, "big"), None, None, 0, "panel")


def written(path: Path, *spans: Span) -> Path:
    """A file with a reply each second for 10 s after the begin of each span; words count up.

    A span of another boot is another session.
    """
    before, offset, last = "", 0.0, None
    for number, (mono, jump, boot) in enumerate(spans):
        file = RecordFile(path, LINE, "test")
        offset = jump if boot != before else offset + jump
        session = round((BEGIN + mono + offset) * 1e6), round(mono * 1e6)
        rows = [at(mono + second, offset, 10 * number + second) for second in range(10)]
        events = [EventRow(*session, None, "clock", "")] if jump and boot == before else []
        if boot == before:
            file._session = last
        file.write(rows, events)
        last = file._session
        file.close()
        with closing(sqlite3.connect(path)) as base, base:
            base.execute("DELETE FROM reduced")
            if boot != before:
                changed = "UPDATE session SET utc = ?, mono = ?, boot = ? WHERE id = ?"
                base.execute(changed, (*session, boot, last))
        before = boot
    return path


def shown(*paths: Path) -> list[tuple[int, float]]:
    """The words in the order of their times, with the seconds from the begin."""
    with closing(RecordReader(*paths)) as reader:
        rows = reader.words(1, 100, 0, 1 << 62)
        return [(row.word or 0, row.utc / 1e6 - BEGIN) for row in rows]


def order(*paths: Path) -> list[int]:
    return [word for word, _ in shown(*paths)]


@pytest.mark.parametrize(
    ("jumps", "begins"),
    [
        ((), (0.0,)),
        ((-5.0,), (-5.0, 5.0)),  # the clock was set back: the time before is moved
        ((600.0,), (0.0, 610.0)),  # the computer may have slept: a gap
        ((600.0, -600.0), (0.0, 10.0, 20.0)),  # and back
        ((-600.0, 600.0), (-600.0, -590.0, 20.0)),
        ((400.0 * DAY,), (400.0 * DAY, 400.0 * DAY + 10)),  # no clock until the network
    ],
)
def test_jumps_of_the_clock_leave_the_order_and_the_last_clock(
    jumps: tuple[float, ...], begins: tuple[float, ...], tmp_path: Path
) -> None:
    spans = [(10.0 * number, jump, "boot") for number, jump in enumerate((0.0, *jumps))]
    found = shown(written(tmp_path / "a.sqlite", *spans))
    assert [word for word, _ in found] == list(range(10 * len(spans)))
    assert [round(second, 3) for word, second in found if not word % 10] == list(begins)


def test_value_before_a_jump_back_is_not_newer_than_one_after_it(tmp_path: Path) -> None:
    path = written(tmp_path / "a.sqlite", (0.0, 0.0, "boot"), (10.0, -8.0, "boot"))
    line = ReplayLine(path, BEGIN + 3.5)
    with closing(line):
        assert words(line) == (11,)
        assert (line.clock.begin - BEGIN, line.clock.end - BEGIN) == (-8.0, 11.0)


def test_boot_with_an_earlier_clock_does_not_overlap_the_one_after_it(tmp_path: Path) -> None:
    path = written(tmp_path / "a.sqlite", (50.0, -50.0, "one"), (5.0, 2.0, "two"))
    found = shown(path)
    assert [word for word, _ in found] == list(range(20))
    assert found[-1] == (19, 16.0)


def test_files_of_several_days_follow_each_other(tmp_path: Path) -> None:
    folder = tmp_path / "kept"
    folder.mkdir()
    first = written(folder / "2026-11-18_line-1.sqlite", (0.0, 0.0, "boot"))
    second = written(folder / "2026-11-19_line-1.sqlite", (DAY, 0.0, "boot"))
    assert order(first, second) == [*range(10), *range(10)]
    with closing(replayed(f"replay:{folder}")) as line:
        assert line.clock.end - line.clock.begin == DAY + 9
        assert line.devices == (1,)
    other = written(folder / "2026-11-19_line-2.sqlite", (0.0, 0.0, "boot"))
    with pytest.raises(LinkSyntaxError, match="several lines: line-1, line-2"):
        replayed(f"replay:{folder}")
    with pytest.raises(LinkSyntaxError, match="is not a file"):
        replayed(f"replay:{tmp_path / 'none'}")
    other.write_bytes(b"damaged" * 1000)
    with pytest.raises(LinkSyntaxError, match="cannot be replayed"):
        replayed(f"replay:{other}")


def test_clock_that_jumped_from_one_file_to_the_next_is_one_time(tmp_path: Path) -> None:
    later = written(tmp_path / "2026-11-19_a.sqlite", (0.0, 300.0, "boot"))
    earlier = written(tmp_path / "2026-11-18_a.sqlite", (10.0, 0.0, "boot"))
    assert [word for word, _ in shown(earlier, later)] == [*range(10), *range(10)]
    assert shown(earlier, later)[-1] == (9, 19.0)
