"""The record of a line: what is written is read back, whatever the disk and the clock do."""

from __future__ import annotations

import errno
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.programs import wait_until
from tests.sources import ROOT
from tui.bus.model import EndedExchange
from tui.session.record import record_file, recorder
from tui.session.record.disk_trouble import disk_words, from_sqlite
from tui.session.record.reader import RecordedWord, RecordReader
from tui.session.record.record_file import RecordFile
from tui.session.record.recorder import LineRecorder
from tui.session.record.reduction import Extent, ReductionWindow, extent_of
from tui.session.record.ring import make_room, record_path
from tui.session.record.schema import EventRow, RecordDamaged, ReplyRow, reply_row

LINE = "line-1"
HOUR = 3600.0
EVER = -(1 << 62), 1 << 62
REGISTER = 100
A_DAY = 86400
START = time.monotonic() // 10 * 10 + 1


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of the record."""
    made = tmp_path / "record"
    made.mkdir()
    return made


def read_of(
    *words: int, mono: float = 0.0, wall: float = 1e9, device: int = 1, result: str = "reply"
) -> EndedExchange:
    """A read of registers from REGISTER on; its reply ended at `wall`, and `mono` after START."""
    mono += START
    request = bytes([3, 0, REGISTER, 0, len(words)])
    data = b"".join(word.to_bytes(2, "big") for word in words)
    reply = bytes([3, len(data)]) + data if result == "reply" else b"\x83\x02"
    return EndedExchange(device, request, result, reply, mono - 0.02, mono, wall)


def read_now(*words: int) -> EndedExchange:
    """A read that has just ended."""
    return read_of(*words, mono=time.monotonic() - START, wall=time.time())


def row_of(*words: int, **times: Any) -> ReplyRow:
    return reply_row(read_of(*words, **times), "")


def opened(folder: Path, **options: Any) -> LineRecorder:
    return LineRecorder(folder, "serial:x", LINE, **options)


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.sqlite"))


def words_in(path: Path, register: int = REGISTER) -> list[RecordedWord]:
    with closing(RecordReader(path)) as reader:
        return list(reader.words(1, register, *EVER))


def events_in(path: Path, kind: str) -> list[EventRow]:
    with closing(RecordReader(path)) as reader:
        return [event for event in reader.events(*EVER) if event.kind == kind]


def test_closed_record_opens_read_only_in_a_folder_that_cannot_be_written(folder: Path) -> None:
    record = opened(folder)
    record.note(read_of(7))
    assert record.close(60)
    (path,) = files(folder)
    assert os.listdir(folder) == [path.name]  # no log is left that a reader would need
    assert path.read_bytes()[18:20] == b"\1\1"  # no log, by the format of SQLite's files
    with closing(sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)) as base:
        assert base.execute("SELECT words FROM reply").fetchall() == [(b"\0\7",)]
    assert path.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize(
    ("ended", "expected"),
    [
        (read_of(5, 6), (3, REGISTER, 2, 0, b"\0\5\0\6", None, None)),
        (read_of(5, result="exception"), (3, REGISTER, 1, 1, None, None, b"\x83\x02")),
        (
            EndedExchange(1, b"\6\0\x64\x12\x34", "reply", b"\6\0\x64\x12\x34", 1, 2, 1e9),
            (6, REGISTER, 1, 0, b"\x12\x34", None, None),
        ),
        (
            EndedExchange(1, b"\x10\0\x64\0\2\4\1\2\3\4", "nothing", b"", 1, 2, 1e9),
            (16, REGISTER, 2, 2, b"\1\2\3\4", None, None),
        ),
        (
            EndedExchange(1, b"\x17\0\x64\0\1\0\1\0\1\2\1\2", "reply", b"\x17\2\7\7", 1, 2, 1e9),
            (23, REGISTER, 1, 0, b"\7\7", b"\x17\0\x64\0\1\0\1\0\1\2\1\2", None),
        ),
        (
            EndedExchange(1, b"\3\0\x64\0\1", "damaged", b"\1\3\2\xff", 1, 2, 1e9),
            (3, REGISTER, 1, 3, None, None, b"\1\3\2\xff"),
        ),
    ],
)
def test_exchange_is_one_row_with_its_words_and_quality(
    ended: EndedExchange, expected: tuple[object, ...]
) -> None:
    row = reply_row(ended, "")
    found = (row.function, row.address, row.registers, row.quality, row.words, row.sent)
    assert (*found, row.received) == expected


def test_row_has_request_and_answer_time_of_both_clocks() -> None:
    row = reply_row(read_of(1, mono=100.5 - START, wall=2e9), "")
    assert (row.mono, row.took, row.utc) == (100_480_000, 20_000, 2_000_000_000_000_000 - 20_000)


# Reduction

WORD = st.integers(0, 0xFFFF)
REPLIES = st.integers(1, 3).flatmap(
    lambda count: st.lists(st.tuples(*[WORD] * count), min_size=1, max_size=8)
)


@given(REPLIES)
def test_reduced_row_has_the_extent_of_each_register_signed_or_not(
    replies: list[tuple[int, ...]],
) -> None:
    window = ReductionWindow()
    for at, words in enumerate(replies):
        assert window.add(row_of(*words, mono=at, wall=1e9 + at)) == []
    (reduced,) = window.end()
    assert (reduced.good, reduced.bad) == (len(replies), 0)
    for index, column in enumerate(zip(*replies, strict=True)):
        for signed in (False, True):
            plain = [word - 0x10000 if signed and word > 0x7FFF else word for word in column]
            found = extent_of(reduced.words or b"", len(replies[0]), index, signed=signed)
            assert (found.least, found.most) == (min(plain), max(plain))
            assert found.mean == pytest.approx(sum(plain) / len(plain), abs=0.02)


def test_window_ends_after_ten_seconds_and_at_a_jump_of_the_clock() -> None:
    window = ReductionWindow()
    assert window.add(row_of(1, mono=11.0, wall=1e9)) == []
    assert window.add(row_of(2, mono=19.0, wall=1e9 + 8)) == []
    (first,) = window.add(row_of(3, mono=21.0, wall=1e9 + 10))
    assert (first.good, first.took) == (2, 8_020_000)
    # the time of day is set back by an hour
    (second,) = window.add(row_of(4, mono=22.0, wall=1e9 - HOUR))
    assert (second.good, second.words) == (1, b"\0\3")


def test_failed_reads_count_as_bad_and_have_no_extent() -> None:
    window = ReductionWindow()
    window.add(row_of(1, result="exception"))
    (reduced,) = window.end()
    assert (reduced.good, reduced.bad, reduced.words) == (0, 1, None)


# What is written is read back


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(0, 0xFFFF), st.sampled_from([0.1, 3.0, 11.0])), max_size=30))
def test_written_words_are_read_back(
    tmp_path_factory: pytest.TempPathFactory, replies: list[tuple[int, float]]
) -> None:
    folder = tmp_path_factory.mktemp("record")
    record, mono = opened(folder), 0.0
    expected = []
    for word, pause in replies:
        mono += pause
        record.note(read_of(word, mono=mono, wall=1e9 + mono))
        expected.append((round((START + mono - 0.02) * 1e6), "good", word))
    assert record.close(60)
    assert record.lost == 0
    found = [item for path in files(folder) for item in words_in(path)]
    assert [(item.mono, item.quality, item.word) for item in found] == expected
    for path in files(folder):
        with closing(RecordReader(path)) as reader:
            assert sum(item.good for item in reader.reduced(1, REGISTER, *EVER)) == len(replies)


WRITER = """
import sys, time
from pathlib import Path
from tui.session.record.recorder import LineRecorder
from tests.session.test_record import LINE, read_now
record = LineRecorder(Path(sys.argv[1]), "serial:x", LINE)
for number in range(60000):
    record.note(read_now(number))
    print(number, time.monotonic(), flush=True)
    time.sleep(0.005)
"""


def test_killed_writer_loses_one_second_at_most_and_the_next_one_reduces_the_rest(
    folder: Path,
) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(folder)], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as writer:
        assert writer.stdout is not None
        wait_until(lambda: any(_size(path) > 0 for path in files(folder)), "a file")
        time.sleep(1.5)
        writer.send_signal(signal.SIGKILL)
        noted = [line.split() for line in writer.stdout.read().splitlines() if line.count(" ") == 1]
    record = opened(folder)
    record.note(read_now(1, 2))
    assert record.close(60)
    (path,) = files(folder)
    found = [item.word for item in words_in(path)]
    assert found[:-1] == [int(number) for number, _ in noted][: len(found) - 1]
    killed = float(noted[-1][1])
    lost = [number for number, when in noted[len(found) - 1 :] if killed - float(when) > 1.0]
    assert lost == []
    with closing(RecordReader(path)) as reader:
        assert sum(item.good for item in reader.reduced(1, REGISTER, *EVER)) == len(found)


def _size(path: Path) -> int:
    wal = path.with_name(f"{path.name}-wal")
    return wal.stat().st_size if wal.exists() else 0


def on_the_disk(folder: Path, base: bytes, log: bytes) -> list[int | None]:
    """The words that the next program finds after a power cut that left these bytes."""
    path = folder / "cut.sqlite"
    path.write_bytes(base)
    path.with_name("cut.sqlite-wal").write_bytes(log)
    RecordFile(path, "serial:x", "next").close()
    with closing(sqlite3.connect(path)) as opened_again:
        assert opened_again.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    found = [item.word for item in words_in(path)]
    path.unlink()
    return found


def test_power_cut_keeps_what_was_flushed_wherever_it_cuts(folder: Path) -> None:
    path = folder / "a.sqlite"
    file = RecordFile(path, "serial:x", "test")
    file.write([row_of(number, mono=number) for number in range(50)], ())
    file.flush()
    before = path.read_bytes()
    for number in range(50, 90):
        file.write([row_of(number, mono=number)], ())
    log = path.with_name("a.sqlite-wal").read_bytes()
    assert path.read_bytes() == before
    cuts = [log[:size] for size in range(0, len(log) + 1, len(log) // 12)]
    torn = [log[:at] + bytes(4096) + log[at + 4096 :] for at in (0, len(log) // 2)]
    for left in (*cuts, *torn):
        found = on_the_disk(folder, before, left)
        assert found == list(range(len(found)))
        assert 50 <= len(found) <= 90
    file.flush()
    after = path.read_bytes()
    pages = range(0, len(after), 4096)
    for begin in (0, 1):  # half of the pages had been flushed
        mixed = [(after if at // 4096 % 2 == begin else before)[at : at + 4096] for at in pages]
        whole = [page.ljust(4096, b"\0") for page in mixed]
        assert on_the_disk(folder, b"".join(whole), log) == list(range(90))
    file.close()


def test_recorder_flushes_in_time_for_a_power_cut(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert recorder.FLUSHED_EVERY + recorder.WRITTEN_EVERY < 30
    monkeypatch.setattr(recorder, "FLUSHED_EVERY", 0.0)
    record = opened(folder)
    record.note(read_now(7))

    def flushed() -> bool:
        bases = [path.read_bytes() for path in files(folder)]
        return any(bases) and on_the_disk(tmp_path, bases[0], b"") == [7]

    wait_until(flushed, "the row is on the disk without the log")
    assert record.close(60)


def test_record_is_read_while_it_is_written(folder: Path) -> None:
    record = opened(folder)
    record.note(read_of(3))
    wait_until(lambda: bool(files(folder)) and _readable(folder) == [3], "it is readable")
    assert record.close(60)


def _readable(folder: Path) -> list[int | None]:
    try:
        return [item.word for item in words_in(files(folder)[0])]
    except (sqlite3.Error, RecordDamaged):
        return []


# Days, and clocks that jump


def test_each_day_has_its_own_file(folder: Path) -> None:
    record = opened(folder)
    record.note(read_of(1, mono=10, wall=5 * A_DAY - 1))
    record.note(read_of(2, mono=12, wall=5 * A_DAY + 1))
    assert record.close(60)
    assert [[item.word for item in words_in(path)] for path in files(folder)] == [[1], [2]]


def test_clock_that_jumps_both_ways_is_stored_as_it_was(folder: Path) -> None:
    walls = [5 * A_DAY + 10.0, 5 * A_DAY + HOUR, 5 * A_DAY + 11.0]
    reported: list[str] = []
    record = opened(folder, report=reported.append)
    for at, wall in enumerate(walls):
        record.note(read_of(at, mono=at, wall=wall))
    assert record.close(60)
    (path,) = files(folder)
    with closing(sqlite3.connect(path)) as base:
        rows = base.execute("SELECT utc + took, mono + took FROM reply ORDER BY id").fetchall()
    assert rows == [
        (int(wall * 1e6), round(START + at) * 1_000_000) for at, wall in enumerate(walls)
    ]
    jumps = [event.text for event in events_in(path, "clock")]
    assert jumps == [
        "The computer's clock jumped by +3589.000 s.",
        "The computer's clock jumped by -3590.000 s.",
    ]
    assert reported == jumps


def test_each_file_begins_with_the_profiles_of_its_drives(folder: Path) -> None:
    record = opened(folder)
    record.note(EventRow(5, 5, 1, "profile", "atv71"))
    record.note(read_of(1, mono=10, wall=5 * A_DAY - 1))
    record.note(read_of(2, mono=12, wall=5 * A_DAY + 1))
    assert record.close(60)
    for path in files(folder)[-2:]:
        assert [event.text for event in events_in(path, "profile")] == ["atv71"]


def test_event_has_the_program_that_caused_it(folder: Path) -> None:
    file = RecordFile(record_path(folder, LINE, 3), "serial:x", "")
    file.write((), [EventRow(1, 1, 2, "stop", "Space", "panel on pts/3")])
    file.close()
    (event,) = events_in(file.path, "stop")
    assert (event.device, event.who) == (2, "panel on pts/3")


# Old data


def written(path: Path, rows: Sequence[ReplyRow]) -> RecordFile:
    file = RecordFile(path, "serial:x", "")
    file.write(rows, ())
    return file


def test_reads_older_than_an_hour_are_reduced_and_writes_are_kept(folder: Path) -> None:
    write = EndedExchange(1, b"\6\0\x64\0\1", "reply", b"", 0, START - HOUR - 90, 1e9)
    rows = [row_of(at, mono=at - HOUR - 100, wall=1e9 + at) for at in range(90)]
    rows += [reply_row(write, ""), row_of(77, mono=60 - HOUR)]
    path = record_path(folder, LINE, 3)
    file = written(path, rows)
    while file.expire(1e9, START):
        pass
    file.close(shrink=True)
    with closing(sqlite3.connect(path)) as base:
        assert base.execute("SELECT function FROM reply ORDER BY id").fetchall() == [(6,), (3,)]
    assert [item.word for item in words_in(path)] == [77]
    with closing(RecordReader(path)) as reader:
        reduced = [item.extent for item in reader.reduced(1, REGISTER, *EVER)]
    assert all(isinstance(extent, Extent) for extent in reduced)
    assert min(extent.least for extent in reduced if extent) == 0
    assert max(extent.most for extent in reduced if extent) == 89
    assert len(reduced) in (10, 11)


def test_last_two_files_of_a_program_that_ended_are_reduced_by_the_next_one(folder: Path) -> None:
    for day in (3, 4):
        written(record_path(folder, LINE, day), [row_of(day, mono=-2 * HOUR)]).abandon()
    left = files(folder)
    record = opened(folder)
    record.note(read_now(1))
    wait_until(lambda: not any(_raw_rows(path) for path in left), "they are reduced")
    assert record.close(60)
    assert [path.name for path in folder.glob("*-wal")] == []
    for path in left:
        with closing(RecordReader(path)) as reader:
            assert [item.good for item in reader.reduced(1, REGISTER, *EVER)] == [1]


def _raw_rows(path: Path) -> int:
    with closing(sqlite3.connect(path)) as base:
        return int(base.execute("SELECT count(*) FROM reply").fetchone()[0])


def test_rows_after_all_others_were_removed_are_kept_and_reduced(folder: Path) -> None:
    file = written(record_path(folder, LINE, 3), [row_of(1, mono=-2 * HOUR)])
    file.end_window(round(START * 1e6))
    file.expire(1e9, START)
    assert not file.has_raw
    file.write([row_of(2)], ())
    assert file.has_raw
    file.expire(1e9, START)
    assert file.has_raw
    file.close()


def test_oldest_days_make_room_and_open_files_stay(folder: Path) -> None:
    paths = [record_path(folder, LINE, day) for day in range(4)]
    for path in paths:
        path.write_bytes(bytes(1000))
    paths[1].with_name(paths[1].name + "-wal").write_bytes(bytes(10))
    excess, closed = make_room(folder, [paths[0]], 2200)
    assert files(folder) == [paths[0], paths[1], paths[3]]  # the second may be in use elsewhere
    assert (0 < excess < 1000, closed) == (True, paths[3])  # of the last, a part has to go
    assert make_room(folder, [paths[0]], 1100) == (978, None)


def test_closed_day_that_is_too_large_loses_its_oldest_rows_only(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "ROOM_MADE_EVERY", 0.0)
    monkeypatch.setattr(record_file, "SHED_AT_A_TIME", 100)
    path = record_path(folder, LINE, 3)
    rows = [row_of(at % 7, mono=at - 2 * HOUR, wall=3 * A_DAY + at) for at in range(0, 60_000, 10)]
    file = RecordFile(path, "serial:x", "")
    file.write(rows, [EventRow(1, 1, 1, "profile", "atv71")])
    file.close(shrink=True)
    before = path.stat().st_size
    for day in (4, 5):  # the recorder opens the last two
        written(record_path(folder, LINE, day), [row_of(1)]).close()
    record = opened(folder, most=before)
    record.note(read_now(1))
    wait_until(lambda: path.stat().st_size < before, "it is smaller")
    assert record.close(60)
    assert before // 2 < path.stat().st_size < before * 15 // 16
    with closing(RecordReader(path)) as reader:
        kept = [item.utc for item in reader.reduced(1, REGISTER, *EVER)]
        whole = [item.utc for item in reader.words(1, REGISTER, *EVER)]
    assert kept[-1] == rows[-1].utc
    assert len(kept) < len(rows)
    assert whole[0] > kept[0] - 1_100_000_000  # 100 reduced rows are 1000 s
    assert [event.text for event in events_in(path, "profile")] == ["atv71"]


def test_file_gives_the_room_of_removed_rows_back_to_the_disk(folder: Path) -> None:
    path = record_path(folder, LINE, 3)
    file = written(path, [row_of(at, mono=at / 10 - 2 * HOUR) for at in range(6000)])
    file.end_window(round(START * 1e6))
    file.flush()
    before = path.stat().st_size
    while file.expire(1e9, START):
        pass
    file.close(shrink=True)
    assert path.stat().st_size < before / 2
    with closing(sqlite3.connect(path)) as base:
        assert base.execute("PRAGMA freelist_count").fetchone() == (0,)


def test_file_that_is_too_large_alone_loses_its_oldest_rows(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "ROOM_MADE_EVERY", 0.0)
    monkeypatch.setattr(record_file, "SHED_AT_A_TIME", 500)
    monkeypatch.setattr(record_file, "USUAL_WAL", 20_000)
    most = 600_000
    record = opened(folder, most=most)
    for number in range(18_000):
        record.note(read_now(number))
        if number % 3000 == 2999:
            time.sleep(0.6)
    assert record.close(60)
    (path,) = files(folder)
    found = [item.word for item in words_in(path)]
    assert found == list(range(18_000))[-len(found) :]
    assert 0 < len(found) < 12_000
    assert path.stat().st_size < 2 * most


# What goes wrong


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "RETRIED_AFTER", 0.1)
    monkeypatch.setattr(recorder, "SETTLED_AFTER", 0.3)
    monkeypatch.setattr(recorder, "HELD_PATIENCE", 0.0)
    monkeypatch.setattr(recorder, "WRITTEN_EVERY", 0.05)


Reports = list[str]


@pytest.fixture
def noting() -> Iterator[tuple[Reports, Callable[[Path], LineRecorder]]]:
    """Recorders, with what they report."""
    reports: Reports = []
    begun: list[LineRecorder] = []

    def begin(folder: Path) -> LineRecorder:
        begun.append(opened(folder, report=reports.append))
        return begun[-1]

    yield reports, begin
    for record in begun:
        record.close(10)


Noting = tuple[Reports, Callable[[Path], LineRecorder]]


@pytest.mark.usefixtures("quick")
def test_folder_that_cannot_be_written_is_reported_once_and_recording_resumes(
    folder: Path, noting: Noting
) -> None:
    reports, begin = noting
    folder.rmdir()
    folder.write_text("a file in the place of the folder")  # root may write to any folder
    record = begin(folder)
    record.note(read_of(1))
    wait_until(lambda: bool(record.trouble), "trouble")
    time.sleep(0.4)
    assert [text.split(":")[0] for text in reports] == ["Nothing is recorded"]
    folder.unlink()
    wait_until(lambda: len(reports) == 2, "it records again")
    assert reports[1:] == ["Recording again."]
    assert record.close(60)
    assert [item.word for item in words_in(files(folder)[0])] == [1]


@pytest.mark.usefixtures("quick")
def test_rows_beyond_the_backlog_are_lost_counted_and_recorded(
    folder: Path, noting: Noting, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "RECORD_BACKLOG", 10)
    reports, begin = noting
    folder.rmdir()
    folder.write_text("")
    record = begin(folder)
    record.note(read_now(0))
    wait_until(lambda: bool(record.trouble), "trouble")
    for number in range(1, 21):
        record.note(read_now(number))
    assert record.lost == 10
    folder.unlink()
    wait_until(lambda: len(reports) == 2, "it records again")
    assert reports[1] == "Recording again. 10 rows were not recorded."
    assert record.close(60)
    (path,) = files(folder)
    assert [item.word for item in words_in(path)] == list(range(11))
    assert [event.text for event in events_in(path, "lost")] == ["10 rows were not recorded."]


FULL_DISK = """
import resource, signal, sys, time
from pathlib import Path
from tests.programs import wait_until
from tests.session.test_record import LINE, read_now
from tui.session.record import recorder
recorder.RETRIED_AFTER, recorder.SETTLED_AFTER = 0.1, 1.0
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
reports = []
record = recorder.LineRecorder(Path(sys.argv[1]), "serial:x", LINE, report=reports.append)
soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, hard))
for number in range(6000):
    record.note(read_now(number))
wait_until(lambda: bool(record.trouble), "trouble")
time.sleep(0.5)
resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
wait_until(lambda: len(reports) == 2, "it records again")
assert record.close(60)
print(record.lost, *reports, sep="|")
"""


def test_full_disk_is_reported_once_and_nothing_is_lost_once_there_is_room(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(folder)],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    lost, first, second = done.stdout.strip().split("|")
    assert lost == "0"
    assert first.startswith("Nothing is recorded: ")
    assert second == "Recording again."
    (path,) = files(folder)
    assert [item.word for item in words_in(path)] == list(range(6000))
    with closing(RecordReader(path)) as reader:
        assert sum(item.good for item in reader.reduced(1, REGISTER, *EVER)) == 6000


@pytest.mark.parametrize(
    ("code", "cause", "words"),
    [
        (sqlite3.SQLITE_IOERR, errno.EROFS, "the disk is read-only"),
        (sqlite3.SQLITE_IOERR | 3 << 8, errno.ENOSPC, "the disk is full"),
        (sqlite3.SQLITE_IOERR, None, "the disk reports an error"),
        (sqlite3.SQLITE_FULL, None, "the disk is full"),
        (sqlite3.SQLITE_CANTOPEN, errno.EACCES, "this user may not write there"),
        (sqlite3.SQLITE_ERROR, None, "as SQLite says"),
    ],
)
def test_disk_error_is_reported_with_its_cause_in_plain_words(
    folder: Path, monkeypatch: pytest.MonkeyPatch, code: int, cause: int | None, words: str
) -> None:
    if cause is not None:
        monkeypatch.setattr("tempfile.TemporaryFile", Mock(side_effect=OSError(cause, "x")))
    error = sqlite3.OperationalError("as SQLite says")
    error.sqlite_errorcode = code
    assert disk_words(from_sqlite(error, folder / "a.sqlite")) == words
    assert os.listdir(folder) == []


@pytest.mark.parametrize("damage", ["no record", "damaged page", "another version"])
@pytest.mark.usefixtures("quick")
def test_damaged_file_is_set_aside_and_the_next_one_begins(
    folder: Path, noting: Noting, damage: str
) -> None:
    reports, begin = noting
    path = record_path(folder, LINE, int(time.time() // A_DAY))
    if damage == "no record":
        path.write_bytes(b"not a database at all, but a text" * 100)
    else:
        written(path, [row_of(at) for at in range(500)]).close()
        if damage == "another version":
            with closing(sqlite3.connect(path)) as base:
                base.execute("PRAGMA user_version = 99")
        else:
            with path.open("r+b") as file:
                file.seek(4096)
                file.write(b"\xff" * 30_000)
    record = begin(folder)
    record.note(read_now(8))
    wait_until(lambda: any("damaged-" in name for name in os.listdir(folder)), "set aside")
    assert record.close(60)
    assert [item.word for item in words_in(path)] == [8]
    assert len([text for text in reports if "was damaged" in text]) == 1


@pytest.mark.usefixtures("quick")
def test_reader_that_does_not_let_go_bounds_the_log_and_loses_nothing(
    folder: Path, noting: Noting, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(record_file, "USUAL_WAL", 20_000)
    monkeypatch.setattr(record_file, "MOST_WAL", 100_000)
    monkeypatch.setattr(record_file, "LOCK_PATIENCE", 0.0)
    reports, begin = noting
    record = begin(folder)
    record.note(read_now(0))
    wait_until(lambda: bool(files(folder)) and _readable(folder) == [0], "a file")
    (path,) = files(folder)
    with closing(sqlite3.connect(path)) as base:
        base.execute("BEGIN")
        base.execute("SELECT count(*) FROM reply").fetchone()
        for number in range(1, 5000):
            record.note(read_now(number))
        wait_until(lambda: bool(record.trouble), "it waits")
        assert _size(path) < 100_000 + 200_000  # one transaction beyond
        base.execute("COMMIT")
    wait_until(lambda: len(reports) == 2, "it records again")
    assert record.close(60)
    assert [item.word for item in words_in(path)] == list(range(5000))


def test_recorder_that_is_off_keeps_nothing_and_writes_nothing(folder: Path) -> None:
    record = opened(folder, is_on=lambda: False)
    record.note(read_now(1))
    wait_until(lambda: not record.waiting, "it finds out")
    record.note(read_now(2))
    assert record.waiting == 0
    assert record.close(60)
    assert files(folder) == []


def test_disk_that_hangs_delays_no_row_and_no_end(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hung = []

    def hang(self: RecordFile, *rows: object) -> None:
        hung.append(rows)
        time.sleep(5.0)

    monkeypatch.setattr(RecordFile, "write", hang)
    record = opened(folder)
    record.note(read_of(1))
    wait_until(lambda: bool(hung), "the disk hangs")
    begun = time.monotonic()
    for number in range(recorder.RECORD_BACKLOG + 5):
        record.note(read_of(number))
    assert not record.close(0.1)
    assert time.monotonic() - begun < 4.0
    assert record.lost >= 5
