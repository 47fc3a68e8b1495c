"""A replay answers as the record says: never more than was read by then, and takes no write."""

from __future__ import annotations

import asyncio
import json
import sqlite3
import time
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    LineFailed,
    LineLost,
    LinkSyntaxError,
    NoAnswer,
    NotRecorded,
    RequestRefused,
)
from tui.bus.link import SerialLink
from tui.bus.poll_plan import PlannedRead
from tui.drive.profile.library import load
from tui.session import replay
from tui.session.connect.identify import DriveIdentity
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.fleet import Fleet
from tui.session.monitor.line_watch import LineWatch
from tui.session.monitor.trend import Trend
from tui.session.record.history import read_history
from tui.session.record.newest import NewestReplies
from tui.session.record.record_file import RecordFile
from tui.session.record.repeated_cycles import RepeatedCycles, cycles_of
from tui.session.record.replay_line import REPLAY_SENDS_NOTHING, ReplayLine
from tui.session.record.replay_text import open_replay, parse_replay, time_in
from tui.session.record.schema import GOOD, SILENT, EventRow, ReplyRow
from tui.session.replay import (
    UnwrittenJournal,
    open_past,
    pass_lead,
    recall_trip,
    take_drives,
)
from tui.session.replay_past import RecordedCycles, recall_past
from tui.session.shown import Quality
from tui.simulator import DriveSpec

from .virtual_line import VirtualLine

BEGIN = 1_795_000_000
LINE = "serial:/dev/ttyUSB0,9600,8N1"


def row(
    at: float, words: tuple[int, ...] = (), *, address: int = 100, registers: int = 0,
    quality: int = 0, received: bytes | None = None, repeat: int = 0, device: int = 1,
) -> ReplyRow:  # fmt: skip
    """A read that ends 10 ms after its request; `at` is its end in seconds after the begin."""
    end = round((BEGIN + at) * 1e6)
    data = b"".join(word.to_bytes(2, "big") for word in words) or None
    return ReplyRow(
        end - 10_000, end - 10_000, 10_000, device, 3, address, registers or len(words), quality,
        data, None, received, repeat, "",
    )  # fmt: skip


def event(at: float, kind: str, text: str, device: int | None = None) -> EventRow:
    when = round((BEGIN + at) * 1e6)
    return EventRow(when, when, device, kind, text)


def record(folder: Path, *rows: ReplyRow, events: tuple[EventRow, ...] = ()) -> Path:
    """A closed record with these rows."""
    path = folder / "run.sqlite"
    file = RecordFile(path, LINE, "test")
    file.write(rows, events)
    file.close()
    return path


@contextmanager
def replayed(path: Path, at: float) -> Iterator[ReplayLine]:
    line = ReplayLine(path, BEGIN + at)
    line.open()
    with closing(line):
        yield line


def words(line: ReplayLine, address: int = 100, count: int = 1) -> tuple[int, ...]:
    return asyncio.run(line.read(1, address, count)).words


def test_read_returns_the_newest_reply_by_then_with_its_time(tmp_path: Path) -> None:
    path = record(tmp_path, row(1, (10, 20)), row(2, (11, 21)), row(3, (12, 22)))
    with replayed(path, 2.5) as line:
        reply = asyncio.run(line.read(1, 100, 2))
        assert reply.words == (11, 21)
        assert reply.time == pytest.approx(BEGIN + 2)
        assert words(line, 101) == (21,)


def test_register_that_was_not_read_by_then_has_no_value(tmp_path: Path) -> None:
    path = record(tmp_path, row(1, (10,)), row(5, (77,), address=200))
    with replayed(path, 4.0) as line:
        assert words(line) == (10,)
        with pytest.raises(NotRecorded, match="Not read by then"):
            words(line, 200)
        with pytest.raises(NotRecorded):
            words(line, 100, 2)


def test_reply_that_had_not_ended_is_not_known_yet(tmp_path: Path) -> None:
    path = record(tmp_path, row(1, (10,)), row(2, (11,)))
    with replayed(path, 1.995) as line:
        assert words(line) == (10,)


def test_words_of_two_reads_are_never_mixed_in_one_reply(tmp_path: Path) -> None:
    path = record(tmp_path, row(1, (10, 20)), row(2, (21,), address=101), row(9, (0,)))
    with replayed(path, 3.0) as line:
        with pytest.raises(NotRecorded):
            words(line, 100, 2)
        assert (words(line, 100), words(line, 101)) == ((10,), (21,))


@pytest.mark.parametrize(
    ("quality", "received", "error"),
    [(2, None, NoAnswer), (3, b"\x01\x03", ChecksumFault), (1, b"\x83\x02", DeviceException)],
)
def test_failed_read_fails_again_until_the_next_good_one(
    tmp_path: Path, quality: int, received: bytes | None, error: type[Exception]
) -> None:
    bad = row(2, registers=1, quality=quality, received=received)
    path = record(tmp_path, row(1, (10,)), bad, row(3, (12,)))
    with replayed(path, 2.5) as line:
        with pytest.raises(error) as raised:
            words(line)
        assert not isinstance(raised.value, NotRecorded)
        if isinstance(raised.value, DeviceException):
            assert raised.value.code == 2
        asyncio.run(line.run_to(BEGIN + 3.5))
        assert words(line) == (12,)


def test_silent_drive_answers_no_request_but_its_last_values_are_known(tmp_path: Path) -> None:
    lost = [row(at, address=200, registers=1, quality=2) for at in (2, 3, 4)]
    path = record(tmp_path, row(1, (10,)), row(1.1, (20,), address=200), *lost, row(9, (0,)))
    with replayed(path, 2.5) as line:
        assert words(line) == (10,)
        asyncio.run(line.run_to(BEGIN + 3.5))
        with pytest.raises(NoAnswer):
            words(line)
        assert [item and item.words for item in line.last_replies(1, [(3, 200, 1)])] == [(20,)]
        assert line.counters.devices[1].timeouts == 1


def test_refused_long_read_leaves_its_registers_readable(tmp_path: Path) -> None:
    refused = row(2, registers=2, quality=1, received=b"\x83\x02")
    path = record(tmp_path, row(1, (10,)), refused, row(9, (0,)))
    with replayed(path, 2.5) as line:
        with pytest.raises(DeviceException):
            words(line, 100, 2)
        assert words(line) == (10,)


def test_failed_try_that_was_repeated_at_once_is_no_failure(tmp_path: Path) -> None:
    lost = row(2, registers=1, quality=2)
    path = record(tmp_path, row(1, (10,)), lost, row(2.2, (12,), repeat=1), row(9, (0,)))
    with replayed(path, 1.0) as line:
        asyncio.run(line.run_to(BEGIN + 2.1))
        assert words(line) == (10,)


def test_line_that_was_lost_is_lost_again(tmp_path: Path) -> None:
    events = event(2, "line", "lost The adapter was unplugged."), event(4, "line", "connected")
    path = record(tmp_path, row(1, (10,)), row(5, (12,)), events=events)
    with replayed(path, 3.0) as line:
        with pytest.raises(LineLost, match="unplugged"):
            words(line)
        asyncio.run(line.run_to(BEGIN + 4.5))
        assert words(line) == (10,)


def reduced_record(folder: Path) -> Path:
    """Ten seconds in which one register changed and one did not; their replies are removed."""
    rows = [row(index, (100 + index, 7)) for index in range(10)]
    path = record(folder, *rows, row(11, (1,), address=300))
    with closing(sqlite3.connect(path)) as base:
        assert base.execute("SELECT count(*) FROM reduced").fetchone()[0] >= 1
        base.execute("DELETE FROM reply WHERE address = 100")
        base.commit()
    return path


def test_reduced_reply_has_a_mean_for_quantities_only(tmp_path: Path) -> None:
    with replayed(reduced_record(tmp_path), 10.5) as line:
        assert words(line, 101) == (7,)
        with pytest.raises(NotRecorded):
            words(line, 100)
        line.use_profile(1, {(3, 100): False}.get, lambda code: None)
        assert words(line, 100)[0] in range(100, 110)


def test_reduced_reply_does_not_replace_the_replies_it_is_made_of(tmp_path: Path) -> None:
    rows = [row(index, (100 + index,)) for index in range(10)]
    with replayed(record(tmp_path, *rows), 9.5) as line:
        line.use_profile(1, {(3, 100): False}.get, lambda code: None)
        assert words(line) == (109,)
        assert line.device_state(1).heard == pytest.approx(BEGIN + 9)


def test_replay_sends_nothing_and_reaches_no_port(tmp_path: Path) -> None:
    path = record(tmp_path, row(1, (10,)))
    with replayed(path, 1.0) as line:
        assert line.read_only
        assert line.held == REPLAY_SENDS_NOTHING
        for request in (
            lambda: line.write(1, 8501, [15]),
            lambda: line.read_write(1, 100, 1, 8501, [15]),
            lambda: line.broadcast(8501, [0]),
            lambda: line.diagnose(1, 0),
        ):
            with pytest.raises(RequestRefused, match="nothing is sent"):
                asyncio.run(request())
        assert line.link == SerialLink("replay", 9600, "8N1")
        refused: list[str] = []
        line.send_prepared((), refused.append)
        assert refused == [REPLAY_SENDS_NOTHING]


def test_time_stands_while_held_and_follows_the_speed(tmp_path: Path) -> None:
    path = record(tmp_path, row(0, (10,)), row(1000, (11,)))
    with replayed(path, 10.0) as line:
        clock = line.clock
        woken: list[float] = []

        async def sleep() -> None:
            while True:
                await clock.sleep(10.0)
                woken.append(clock.monotonic())

        line.spawn(sleep, "sleeper")
        time.sleep(0.1)
        assert clock.monotonic() == BEGIN + 10
        clock.set_speed(100.0)
        clock.play()
        end = time.monotonic() + 20
        while len(woken) < 3 and time.monotonic() < end:
            time.sleep(0.01)
        clock.hold()
        assert woken[:3] == pytest.approx([BEGIN + 20, BEGIN + 30, BEGIN + 40])
        time.sleep(0.05)
        before = clock.monotonic()
        time.sleep(0.1)
        assert clock.monotonic() == before


def test_profile_note_is_the_last_one_by_then(tmp_path: Path) -> None:
    notes = tuple(
        event(at, "profile", json.dumps({"profile": name}), 1)
        for at, name in ((2, "atv71"), (6, "atv312"))
    )
    path = record(tmp_path, row(0, (1,)), row(9, (2,)), events=notes)
    for at, name in ((1, "atv71"), (5, "atv71"), (7, "atv312")):
        with replayed(path, at) as line:
            note = line.profile_note(1)
            assert note is not None
            assert name in note.text


# Errors

LOCAL = time.localtime(BEGIN)


def test_time_without_a_date_is_that_of_the_record() -> None:
    end = BEGIN + 7200
    hour = time.strftime("%H:%M:%S", time.localtime(BEGIN + 3600))
    assert time_in(hour, BEGIN, end) == BEGIN + 3600
    assert time_in(time.strftime("%H:%M", LOCAL), BEGIN + 5, end) == BEGIN + 5
    iso = time.strftime("%Y-%m-%dT%H:%M:%S", time.localtime(BEGIN + 60))
    assert time_in(iso, BEGIN, end) == BEGIN + 60


@pytest.mark.parametrize(
    ("text", "words"), [("noon", "is not a time"), ("2020-01-01T00:00", "outside the record")]
)
def test_wrong_time_is_refused_with_the_form(text: str, words: str) -> None:
    with pytest.raises(LinkSyntaxError, match=words):
        time_in(text, BEGIN, BEGIN + 7200)


def test_file_that_is_no_record_is_refused(tmp_path: Path) -> None:
    for name, content in (("text.sqlite", b"no database" * 100), ("empty.sqlite", b"")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(LinkSyntaxError, match="cannot be replayed"):
            open_replay(parse_replay(str(tmp_path / name)))
    with pytest.raises(LinkSyntaxError, match="is not a file"):
        open_replay(parse_replay(str(tmp_path / "missing.sqlite")))


def test_record_of_a_newer_version_is_refused_by_its_version(tmp_path: Path) -> None:
    path = record(tmp_path, row(1, (10,)))
    with closing(sqlite3.connect(path)) as base:
        base.execute("PRAGMA user_version = 7")
        base.commit()
    with pytest.raises(LinkSyntaxError, match=r"version 7.*install a newer"):
        open_replay(parse_replay(str(path)))


def test_record_without_a_reply_is_refused(tmp_path: Path) -> None:
    path = record(tmp_path, events=(event(1, "program", "It has come."),))
    with pytest.raises(LinkSyntaxError, match="no reply of a drive"):
        open_replay(parse_replay(str(path)))


def test_damaged_record_is_refused_or_fails_as_a_line_does(tmp_path: Path) -> None:
    path = record(tmp_path, *(row(index, (index,) * 50) for index in range(500)))
    data = bytearray(path.read_bytes())
    data[4096 * 3 :] = bytes(len(data) - 4096 * 3)
    path.write_bytes(bytes(data))
    with pytest.raises(LinkSyntaxError, match="cannot be replayed"):
        open_replay(parse_replay(str(path)))


def test_record_that_is_being_written_shows_its_new_replies(tmp_path: Path) -> None:
    path = tmp_path / "run.sqlite"
    file = RecordFile(path, LINE, "test")
    file.write([row(1, (10,)), row(2, (11,))], ())
    with closing(file), replayed(path, 2.0) as line:
        assert words(line) == (11,)
        file.write([row(3, (12,))], ())
        line.clock.end = BEGIN + 10
        asyncio.run(line.run_to(BEGIN + 5))
        assert words(line) == (12,)


def test_frames_before_the_time_are_those_of_the_wire(tmp_path: Path) -> None:
    path = record(tmp_path, row(1, (10,)), row(3, (12,)))
    with replayed(path, 2.0) as line:
        assert [(item.direction, item.data[:-2].hex()) for item in line.trace] == [
            ("out", "010300640001"),
            ("in", "010302000a"),
        ]


@pytest.mark.parametrize("at", [500.0, 501.0, 20.0, 900.0, 3.0])
def test_record_that_is_opened_again_shows_what_a_first_opening_shows(
    at: float, tmp_path: Path
) -> None:
    rows = [row(1, (7,), address=200), row(500.005, (9,), address=300)]
    rows += [row(second, (second,)) for second in range(1, 1000, 2)]
    path = record(tmp_path, *rows)
    for before in (700.0, 500.0, 10.0):  # one is on its way at 500 s
        with replayed(path, before) as line:
            words(line)
    with replayed(path, at) as line:
        assert words(line) == ((int(at) - 1) // 2 * 2 + 1,)
        assert words(line, 200) == (7,)
        if at > 500:
            assert words(line, 300) == (9,)
        else:
            with pytest.raises(NotRecorded):
                words(line, 300)


PEAK = 250


@contextmanager
def replayed_drive(
    path: Path, at: float, device: int | None
) -> Iterator[tuple[ReplayLine, DriveConsole]]:
    """Drive 1 of a record at a time; `device` is the open one."""
    line = ReplayLine(path, BEGIN + at, lead=60.0)
    line.open()
    with closing(line):
        fleet = Fleet(line, UnwrittenJournal(), None, None, line.clock)
        take_drives(line, fleet)
        asyncio.run(pass_lead(line, fleet, device, lambda console, period: None, 1.0))
        yield line, fleet.consoles[0]
        fleet.forget()


def cycles(folder: Path, times: Iterable[float]) -> Path:
    """A record with cycles of drive 1 at these times; one has a peak of the current."""
    rows = [row(at, (0x0637, 300, 300, 200 if at == PEAK else 84), address=3201) for at in times]
    text = json.dumps({"profile": "atv71"})
    return record(folder, *rows, events=(event(0.5, "profile", text, 1),))


def currents(console: DriveConsole) -> dict[float, float | None]:
    """The current of a curve, by the time since the begin."""
    return {round(point.time - BEGIN, 2): point.values[1] for point in console.monitor.trend}


def test_curve_of_the_open_drive_has_each_recorded_cycle(tmp_path: Path) -> None:
    """A sample each 10 s would miss the peak of a second."""
    with replayed_drive(cycles(tmp_path, range(1, 450)), 400, 1) as (_, console):
        found = currents(console)
    assert set(range(1, 340)) <= set(found)
    assert [at for at, value in found.items() if value == 20.0] == [PEAK]


def trip(folder: Path) -> Path:
    """A record with cycles of drive 1 in each second; it is in fault from 200 to 230 s."""
    lft = load("atv71")["LFT"].address
    rows = [
        row(at + place, words, address=address)
        for at in range(1, 450)
        for place, address, words in (
            (0.0, 3201, (0x0238 if 200 <= at < 230 else 0x0637, 300, 300, 84)),
            (0.02, lft, (18 if 200 <= at < 230 else 0,)),
        )
    ]
    profile = event(0.5, "profile", json.dumps({"profile": "atv71"}), 1)
    return record(folder, *rows, events=(profile, event(200.1, "fault", "Tripped.", 1)))


@pytest.mark.parametrize("device", [1, None])
def test_trip_before_a_seek_has_its_fault_after_the_reset(
    device: int | None, tmp_path: Path
) -> None:
    with replayed_drive(trip(tmp_path), 400, device) as (_, console):
        found = [point.codes for point in console.monitor.trend if point.mark == "trip"]
    assert found == [("ObF Overbraking",)]


@pytest.mark.parametrize(("at", "known"), [(400, True), (215, True), (199, False)])
def test_last_trip_before_a_seek_has_the_seconds_before_it(
    at: float, known: bool, tmp_path: Path
) -> None:
    """Also if it was reset since, or the drive is in fault at the begin of the replay."""

    def start(console: DriveConsole, period: float) -> None:
        console.monitor.start(period=period)

    with replayed_drive(trip(tmp_path), at, 1) as (line, console):
        asyncio.run(recall_trip(line, console, start, 1.0))
        found = console.recorder.latest
    assert (found is not None) == known
    if found is not None:
        assert found.wall - BEGIN == pytest.approx(200, abs=0.1)
        assert found.fault is not None
        assert found.fault.code == "ObF"
        assert [round(moment.time - BEGIN) for moment in found.moments] == [*range(170, 201)]
        assert found.moments[-2].texts[0] == "30.0"


def test_curve_has_a_gap_while_the_line_was_lost(tmp_path: Path) -> None:
    """Nothing was sent then. Another read between two checks is not a point."""
    rows = [row(at, (0x0637, 300, 300, 84), address=3201) for at in (*range(1, 40), 60, 61)]
    rows.append(row(30.5, (300,), address=3202))
    states = event(42, "line", "lost The adapter."), event(59, "line", "connected")
    text = json.dumps({"profile": "atv71"})
    path = record(tmp_path, *rows, events=(event(0.5, "profile", text, 1), *states))
    with replayed_drive(path, 61, None) as (line, console):
        open_past(line, console, lambda console, period: None, 1.0)
        end = time.monotonic() + 5
        while 10 not in currents(console) and time.monotonic() < end:
            time.sleep(0.01)
        found = currents(console)
        marks = [round(p.time - BEGIN) for p in console.monitor.trend if p.mark == "lost"]
    assert marks == [42]
    assert 30.5 not in found
    assert [at for at, value in found.items() if value is None] == [42]


async def test_monitor_of_a_replay_fails_when_the_line_is_lost(tmp_path: Path) -> None:
    """It does not wait for the cycle after the loss."""
    rows = [row(at, (10,)) for at in (1, 2, 3, 6)]
    states = event(4, "line", "lost The adapter."), event(5, "line", "connected")
    with replayed(record(tmp_path, *rows, events=states), 3) as line:
        found, ended = RepeatedCycles(line, 1), []

        async def work() -> None:
            turn = await found.next([PlannedRead(100, 1)], BEGIN + 3.5, 0.5)
            ended.append(turn.ended - BEGIN)

        line.spawn(work, "cycle")
        await line.run_to(BEGIN + 4.5)
        assert ended == [pytest.approx(4, abs=1e-3)]


def test_first_cycle_of_a_replay_is_the_last_recorded_one(tmp_path: Path) -> None:
    """A word that failed in an earlier cycle does not make it fail."""
    rows = [
        row(1, (5,), address=900),
        row(2, registers=1, quality=SILENT, address=900),
        row(4, (12,)),
        row(5, registers=1, quality=SILENT),
    ]
    reads = [PlannedRead(100, 1), PlannedRead(900, 1)]
    with replayed(record(tmp_path, *rows), 4.5) as line:
        turn = RepeatedCycles(line, 1).last(reads)
        assert turn is not None
        replies = [turn.take(read, 0.0) for read in reads]
        assert [reply and reply.words for reply in replies] == [(12,), (5,)]
        assert turn.ended == line.clock.monotonic()
        line.clock.skip_to(BEGIN + 5)
        failed = RepeatedCycles(line, 1).last(reads)
        assert failed is not None
        with pytest.raises(NoAnswer):
            failed.take(reads[1], 0.0)
        line.clock.skip_to(BEGIN + 20)
        assert RepeatedCycles(line, 1).last(reads) is None


@pytest.mark.parametrize("at", [40.3, 40.8])
@pytest.mark.parametrize("device", [1, None])
def test_seek_ends_between_two_seconds(at: float, device: int | None, tmp_path: Path) -> None:
    path = cycles(tmp_path, [round(0.25 * number, 2) for number in range(4, 200)])
    with replayed_drive(path, at, device) as (line, _):
        assert line.clock.monotonic() == pytest.approx(BEGIN + at, abs=1e-3)
        reply = asyncio.run(line.read(1, 3201, 1))
    assert reply.time == pytest.approx(BEGIN + at - 0.05, abs=1e-3)


def test_cycles_without_a_reply_are_cycles_too(tmp_path: Path) -> None:
    """A silent drive fails the next cycle as well, whatever that requested first."""
    rows = [
        row(1, (10,)),
        row(2, registers=1, quality=SILENT),
        row(3, registers=1, quality=SILENT, address=900),
        row(4, (12,)),
        row(5, (1,), address=900),
    ]
    with replayed(record(tmp_path, *rows), 6) as line:
        found, is_end = cycles_of(line, 1, BEGIN, [PlannedRead(100, 1)])
    assert is_end
    assert [(cycle.begun + 10_000) / 1e6 - BEGIN for cycle in found] == [1, 2, 3, 4]
    assert [cycle.last.quality for cycle in found] == [GOOD, SILENT, SILENT, GOOD]


def test_curve_of_a_drive_opened_later_has_each_recorded_cycle(tmp_path: Path) -> None:
    with replayed_drive(cycles(tmp_path, range(1, 450)), 400, None) as (line, console):
        assert PEAK - 1 not in currents(console)
        open_past(line, console, lambda console, period: None, 1.0)
        end = time.monotonic() + 5
        while PEAK - 1 not in currents(console) and time.monotonic() < end:
            time.sleep(0.01)
        found = currents(console)
    assert [at for at in found if at < 399.5] == [*range(1, 400)]
    assert [at for at, value in found.items() if value == 20.0] == [PEAK]


def test_checks_of_the_line_read_no_cycles_while_a_curve_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both read by the same object, in two threads."""
    known: list[bool] = []

    def recall(past: RecordedCycles, watch: LineWatch, *times: Any) -> Trend:
        known.append(past.console.device in watch.recorded)
        return recall_past(past, watch, *times)

    monkeypatch.setattr(replay, "recall_past", recall)
    with replayed_drive(cycles(tmp_path, range(1, 50)), 40, None):
        assert known == [False]


def test_curve_on_line_has_the_recorded_checks_and_no_others(tmp_path: Path) -> None:
    """Those of the last minute, and those that follow while the replay goes on."""
    checks = [round(3.07 * number, 2) for number in range(1, 140)]
    with replayed_drive(cycles(tmp_path, checks), 400, None) as (line, console):
        for later in (0, 20):
            asyncio.run(line.run_to(BEGIN + 400 + later))
            found = [at for at in currents(console) if at > 340]
            assert found == [at for at in checks if 340 < at <= 400 + later]


def test_words_of_a_block_are_known_as_those_of_its_parameters(tmp_path: Path) -> None:
    """From the note of a program on; shortly before another note they are unsure."""
    notes = [(3, {50: "A", 51: "B"}), (20.5, {51: "B"})]
    texts = [(at, json.dumps({"places": places})) for at, places in notes]
    rows = [
        row(1, (7,), address=200),
        *(row(at, (at, 100 + at), address=50) for at in range(2, 30)),
    ]
    path = record(tmp_path, *rows, events=tuple(event(at, "block", text, 1) for at, text in texts))
    for at, expected in ((2.5, 7), (4.5, 4), (14.5, 14), (19.5, 7), (29.5, 7)):
        line = ReplayLine(path, BEGIN + at)
        with closing(line):
            line.use_profile(1, lambda place: None, {"A": (3, 200)}.get)
            (reply,) = line.last_replies(1, [(3, 200, 1)])
            assert reply is not None
            assert reply.words == (expected,)


@pytest.mark.sweep
async def test_values_that_came_by_a_block_are_shown_as_live(tmp_path: Path) -> None:
    """Drive 1 has five values of Monitor in its block, which takes their place after 30 s."""
    slots = dict(zip(("F875", "F876", "F877", "F878", "F879"), (2, 3, 11, 1, 4), strict=True))
    path = tmp_path / "run.sqlite"
    live = VirtualLine(path, DriveSpec("atv21", 1, run_hz=30.0, wander=True, sets=slots))
    profile, identity = load("atv21"), DriveIdentity(1, "", "", "", "", "atv21", ("atv21",))
    console = Fleet(live, UnwrittenJournal(), None, None, live.time).take(
        DriveSession(live, 1, profile, identity, live.time)
    )
    console.monitor.start(period=0.5)
    for _ in range(50):
        await live.pass_time(1.0)
    assert console.latest is not None
    assert console.latest.block == "Read block"
    live.end_record()
    line = ReplayLine(path, BEGIN + 48, lead=60.0)
    line.open()
    with closing(line):
        fleet = Fleet(line, UnwrittenJournal(), None, None, line.clock)
        take_drives(line, fleet)
        await pass_lead(
            line, fleet, 1, lambda console, period: console.monitor.start(period=period), 0.5
        )
        found = fleet.consoles[0].latest
        fleet.forget()
    assert found is not None
    assert found.block == "Read block"
    assert found.state.kind == console.latest.state.kind == "running"
    assert {item.quality for item in found.readings.values()} == {Quality.GOOD}
    history = read_history([path], 1, "FD00", BEGIN, BEGIN + 60)
    apart = [b.time - a.time for a, b in pairwise(history.points)]
    assert max(apart) < 1
    assert history.points[-1].time > BEGIN + 49


def test_monitoring_began_with_the_first_cycle_of_the_record(tmp_path: Path) -> None:
    """Not with the requests before it, such as those of a search."""
    rows = [row(at, (0x0637, 300, 300, 84), address=3201) for at in range(5, 50)]
    profile = event(0.5, "profile", json.dumps({"profile": "atv71"}), 1)
    diagnosis = row(0.1)._replace(function=8, address=None)
    search = diagnosis, row(0.2, (7,), address=12000)
    path = record(tmp_path, *search, *rows, events=(profile,))
    with replayed_drive(path, 40, None) as (_, console):
        assert console.recorder.since == pytest.approx(BEGIN + 5, abs=1e-3)


@pytest.mark.parametrize("at", [9.9, 10.0])
async def test_exchanges_of_a_replay_are_counted_in_their_second(at: float, tmp_path: Path) -> None:
    """The figures of the last minute are by seconds: late counts are in a wrong one."""
    times = [round(0.25 * number, 2) for number in range(1, 60)]
    with replayed(record(tmp_path, *(row(each, (1,)) for each in times)), 0.25) as line:
        await line.run_to(BEGIN + at)
        counted = line._tally.frozen().requests
    assert counted == len([each for each in times if 0.25 < each < int(at)])


def test_each_register_of_a_block_is_the_value_in_it(tmp_path: Path) -> None:
    note = json.dumps({"places": {"50": "A", "51": "B", "52": "C"}, "since": 0})
    rows = row(1, (1, 2, 3), address=50), row(2, (4, 5), address=50), row(2.02, (6,), address=52)
    path = record(tmp_path, *rows, events=(event(0.5, "block", note, 1),))
    codes = {"A": (3, 100), "B": (3, 200), "C": (3, 300)}
    for at, values in ((1.5, (1, 2, 3)), (2.5, (4, 5, 6))):
        with replayed(path, at) as line:
            assert words(line, 50) == values[:1]  # counts may be read before the profile is known
            line.use_profile(1, lambda place: None, codes.get)
            assert [*words(line, 100), *words(line, 200), *words(line, 300)] == [*values]
            found, _ = cycles_of(line, 1, BEGIN, [])
            assert [cycle.block for cycle in found] == [50, 52]


def test_drive_that_answers_again_is_not_silent(tmp_path: Path) -> None:
    silent = (row(at, registers=1, quality=SILENT) for at in (2, 3, 4))
    rows = [row(1, (10,)), *silent, row(5, (11,), address=900)]
    with replayed(record(tmp_path, *rows), 1.5) as line:
        assert words(line) == (10,)
        line.clock.skip_to(BEGIN + 4.5)
        with pytest.raises(NoAnswer):
            words(line, 900)
        line.clock.skip_to(BEGIN + 5.5)
        assert words(line, 900) == (11,)
        assert line.device_state(1).failures == 0


def test_replay_plays_up_to_its_end_and_no_further(tmp_path: Path) -> None:
    with replayed(record(tmp_path, *(row(at, (1,)) for at in range(1, 4))), 1) as line:
        line.clock.set_speed(100.0)
        line.clock.play()
        end = time.monotonic() + 5
        while line.clock.playing and time.monotonic() < end:
            time.sleep(0.01)
        time.sleep(0.05)
        assert line.clock.monotonic() == line.clock.end


def test_profile_that_has_changed_since_is_reported(tmp_path: Path) -> None:
    rows = [row(at, (0x0637,), address=3201) for at in (1, 2)]
    named = event(0.5, "profile", json.dumps({"profile": "atv71", "hash": "0" * 64}), 1)
    with replayed(record(tmp_path, *rows, events=(named,)), 2) as line:
        fleet = Fleet(line, UnwrittenJournal(), None, None, line.clock)
        assert take_drives(line, fleet) == [replay.OTHER_PROFILE.format(device=1, profile="atv71")]
        session = fleet.consoles[0].session
        assert session.arming.hindrance == REPLAY_SENDS_NOTHING
        assert not session.reads_blocks
        fleet.forget()


def test_record_that_cannot_be_read_is_an_error_of_the_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(*_: object) -> None:
        raise sqlite3.DatabaseError("malformed")

    with replayed(record(tmp_path, row(1, (10,))), 2) as line:
        monkeypatch.setattr(NewestReplies, "last_words", read)
        with pytest.raises(LineFailed, match=r"^The record cannot be read: malformed\.$"):
            line.last_reply(1, 3, 100, 1)
