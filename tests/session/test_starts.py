"""Starts on record: there before the run frame, found by the next program, in no stop's way."""

from __future__ import annotations

import errno
import json
import logging
import os
import stat
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.programs import PATIENCE, wait_until
from tui.bus.fake import FakeLine
from tui.bus.program import Program
from tui.drive.profile import library
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.line_key import line_key
from tui.session.drive import DriveSession
from tui.session.starts.keeper import NothingToTakeOver, StartKeeper
from tui.session.starts.processes import Processes
from tui.session.starts.record import StartNotRecorded, StartOvertaken, StartRecord
from tui.session.starts.starts import Starts

LINE = "tcp:gateway"
IDENTITY = DriveIdentity(2, "V", "R", "0201", "MACHINE 4", "atv71", ("atv71",))
LIVING, ENDED = 900_001, 900_002

PROGRAM = """
import sys
from pathlib import Path
from tui.drive.profile import library
from tui.session.connect.identify import DriveIdentity
from tui.session.starts.starts import Starts
starts = Starts(Path(sys.argv[1]))
for line in sys.stdin:
    word, device = line.split()
    if word == "begin":
        identity = DriveIdentity(int(device), "V", "R", "0201", "MACHINE 4", "atv71", ("atv71",))
        record = starts.record("tcp:gateway", identity, "atv71", "forward", program="run")
        starts.begin(record, 60)
        starts.sent("tcp:gateway", int(device))
    else:
        starts.end("tcp:gateway", int(device))
        starts.close(60)
    print("done", flush=True)
"""


class MadeUp(Processes):
    """This program, one other that lives, and no more."""

    def started(self, pid: int) -> str | None:
        return "100" if pid in (os.getpid(), LIVING) else None


class Other:
    """Another program that records starts on command."""

    def __init__(self, folder: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def does(self, word: str, device: int = 2) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{word} {device}\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == "done\n"

    def kill(self) -> None:
        """SIGKILL, and its status fetched."""
        self.process.kill()
        self.process.communicate(timeout=PATIENCE)


@contextmanager
def other_program(folder: Path) -> Iterator[Other]:
    program = Other(folder)
    try:
        yield program
    finally:
        program.kill()


@pytest.fixture
def starts(tmp_path: Path) -> Iterator[Starts]:
    made = Starts(tmp_path, MadeUp())
    yield made
    assert made.close(PATIENCE)


@pytest.fixture
def hung(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """A disk that hangs in flushing once the event is clear; it resumes at the end of the test."""
    works, real = threading.Event(), os.fsync
    works.set()

    def flush(number: int) -> None:
        assert works.wait(PATIENCE)
        real(number)

    monkeypatch.setattr(os, "fsync", flush)
    yield works
    works.set()


def start(pid: int = ENDED, line: str = LINE, device: int = 2, **more: Any) -> StartRecord:
    """A start by the program of that number."""
    record = Starts(processes=MadeUp()).record(
        line, replace(IDENTITY, device=device), "atv71", "forward", program="panel"
    )
    return replace(record, **{"pid": pid, "started": "100", **more})


def files(starts: Starts) -> list[Path]:
    return sorted(starts.folder.glob("*.json"))


def test_start_of_a_killed_program_is_found(tmp_path: Path) -> None:
    starts = Starts(tmp_path)
    with other_program(tmp_path) as program:
        program.does("begin")
        assert starts.found(LINE, 2) is None, "its program lives: the motor is that one's"
        program.kill()
    found = starts.found(LINE, 2)
    assert found is not None
    assert (found.pid, found.program, found.name) == (program.process.pid, "run", "MACHINE 4")
    starts.end(LINE, 2)
    assert starts.found(LINE, 2) is None
    assert starts.close(PATIENCE)
    assert files(starts) == []


def test_two_programs_keep_the_records_of_each_other(tmp_path: Path) -> None:
    starts = Starts(tmp_path)
    with other_program(tmp_path) as item, other_program(tmp_path) as other:
        devices = range(1, 9)

        def busy(program: Other, mine: int) -> None:
            for device in devices:
                program.does("begin", device)
                if device % 2 == mine:
                    program.does("end", device)

        with ThreadPoolExecutor(2) as pool:
            list(pool.map(busy, [item, other], [0, 1]))
        kept = [json.loads(file.read_text()) for file in files(starts)]
        by_pid = {
            program.process.pid: sorted(
                record["device"] for record in kept if record["pid"] == program.process.pid
            )
            for program in (item, other)
        }
        assert by_pid == {item.process.pid: [1, 3, 5, 7], other.process.pid: [2, 4, 6, 8]}
        item.kill()
        assert [record.device for record in starts.all_found(LINE)] == [1, 3, 5, 7]
        other.kill()
        assert [record.device for record in starts.all_found(LINE)] == [*devices]


def test_standstill_seen_by_another_program_keeps_a_running_programs_start(starts: Starts) -> None:
    starts.begin(start(LIVING))
    starts.sent(LINE, 2)
    starts.end(LINE, 2)
    assert starts.close(PATIENCE)
    assert len(files(starts)) == 1


def test_reused_pid_is_not_the_program_that_started(starts: Starts) -> None:
    starts.begin(start(LIVING, started="99"))
    assert starts.found(LINE, 2) is not None


def test_reboot_ends_all_programs(starts: Starts) -> None:
    starts.begin(start(LIVING, boot_id="another"))
    assert starts.found(LINE, 2) is not None


def test_start_is_found_for_any_spelling_of_the_line(starts: Starts, tmp_path: Path) -> None:
    port, link = tmp_path / "ttyUSB0", tmp_path / "adapter"
    port.touch()
    link.symlink_to(port)
    starts.begin(start(line=f"serial:{link},9600,8N1"))
    assert starts.found(str(port), 2) is not None
    starts.end(str(port), 2)
    assert starts.close(PATIENCE)
    assert files(starts) == []


def test_renumbered_port_is_found_by_its_link(starts: Starts, tmp_path: Path) -> None:
    link = tmp_path / "adapter"
    link.symlink_to(tmp_path / "ttyUSB0")
    starts.begin(start(line=f"serial:{link}"))
    link.unlink()
    link.symlink_to(tmp_path / "ttyUSB1")
    assert starts.found(f"serial:{tmp_path / 'ttyUSB1'}", 2) is not None
    assert starts.found(f"serial:{tmp_path / 'ttyUSB0'}", 2) is None


def test_two_lines_with_the_same_device_address_are_distinct(starts: Starts) -> None:
    starts.begin(start(line="tcp:one", name="A"))
    starts.begin(start(line="tcp:two", name="B"))
    starts.note_stop("tcp:one", 2)
    assert starts.found("tcp:one", 2) is None
    assert starts.all_found("tcp:two")[0].name == "B"
    assert starts.close(PATIENCE)
    assert len(files(starts)) == 1


def test_newest_start_counts_in_any_time_zone(starts: Starts) -> None:
    starts.begin(start(name="new", pid=ENDED, wall="2026-03-05T16:00:00+00:00"))
    starts.begin(start(name="old", pid=ENDED + 1, wall="2026-03-05T17:30:00+02:00"))
    found = starts.found(LINE, 2)
    assert found is not None
    assert found.name == "new"


def test_motor_taken_over_is_no_longer_offered(starts: Starts) -> None:
    starts.begin(start())
    found = starts.found(LINE, 2)
    assert found is not None
    mine = starts.taken_over(found, "TCP:Gateway", program="panel")
    starts.begin(mine)
    assert starts.found(LINE, 2) is None
    assert (mine.wall, mine.pid) == (found.wall, os.getpid())
    starts.note_stop("TCP:Gateway", 2)
    assert starts.close(PATIENCE)
    assert files(starts) == []


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("intended", [True, False])
def test_new_commander_sets_the_effect_of_its_own_loss(
    starts: Starts, before: bool, intended: bool
) -> None:
    starts.begin(replace(start(), left_running=before))
    keeper = StartKeeper("panel", starts)
    keeper.left_running = intended
    session: Any = SimpleNamespace(line_text=LINE, line=FakeLine({}), device=2)
    keeper.look(session)
    keeper.take_over(session)
    (mine,) = [record for record in starts._files.records() if record.pid == os.getpid()]
    assert mine.left_running is intended


def test_taking_over_one_of_two_motors_keeps_the_other_offered(
    starts: Starts,
) -> None:
    keeper = StartKeeper("panel", starts)
    line = FakeLine({})
    left: list[Any] = [
        SimpleNamespace(line_text=LINE, line=line, device=device, identity=None, commanded=False)
        for device in (2, 3)
    ]
    for session in left:
        starts.begin(start(device=session.device))
        keeper.look(session)
    keeper.take_over(left[0])
    assert keeper.offered(left[0], runs=True) == ""
    assert keeper.offered(left[1], runs=True)
    with pytest.raises(NothingToTakeOver):
        keeper.take_over(left[0])
    keeper.take_over(left[1])
    assert starts.found(LINE, 2) is starts.found(LINE, 3) is None


def test_reopened_line_keeps_the_motor_started_by_this_program(
    starts: Starts, tmp_path: Path
) -> None:
    profile = library.load("atv71")
    session = DriveSession(FakeLine({2: {}}), 2, profile, IDENTITY)
    StartKeeper("panel", starts).begin(session, "forward")
    again = DriveSession(FakeLine({2: {}}), 2, profile, IDENTITY)
    keeper = StartKeeper("panel", Starts(starts.folder.parent, MadeUp()))
    keeper.look(again)
    assert keeper.holds(2)
    assert again.commanded
    assert keeper.stopped_by_others(2)
    keeper.standing(again, time.monotonic() + 1)
    keeper.close()
    assert files(starts) == []
    # and another drive's start is not this one's
    other = DriveSession(FakeLine({3: {}}), 3, profile)
    keeper.look(other)
    assert not keeper.holds(3)
    assert not other.commanded


def test_motor_of_a_running_program_is_offered_until_it_returns(starts: Starts) -> None:
    frozen, line = Program("frozen", "run", LIVING), FakeLine({})
    line.facts.set_programs((line.facts.me, frozen))
    line.facts.set_programs((line.facts.me,))
    starts.begin(start(LIVING))
    keeper = StartKeeper("panel", starts)
    session: Any = SimpleNamespace(
        line_text=LINE, line=line, device=2, identity=None, commanded=False
    )
    keeper.look(session)
    assert f"process {LIVING}, which does not answer on this line" in keeper.offered(
        session, runs=True
    )
    line.facts.set_programs((line.facts.me, frozen))
    assert keeper.offered(session, runs=True) == ""
    with pytest.raises(NothingToTakeOver):
        keeper.take_over(session)


def test_standstill_read_before_the_run_frame_keeps_the_record(starts: Starts) -> None:
    starts.begin(start(os.getpid()))
    starts.end(LINE, 2)
    read = time.monotonic()
    starts.sent(LINE, 2)
    starts.end(LINE, 2, seen=read)
    assert starts.close(PATIENCE)
    assert len(files(starts)) == 1
    starts.end(LINE, 2)
    assert starts.close(PATIENCE)
    assert files(starts) == []


def test_start_recorded_after_an_end_stays(starts: Starts, hung: threading.Event) -> None:
    starts.begin(start())
    starts.sent(LINE, 2)
    hung.clear()
    starts.end(LINE, 2)
    assert starts.found(LINE, 2) is None, "it is on its way out"
    with ThreadPoolExecutor(1) as pool:
        begun = pool.submit(starts.begin, start(name="again"), PATIENCE)
        hung.set()
        begun.result(PATIENCE)
    found = starts.found(LINE, 2)
    assert found is not None
    assert found.name == "again"


@pytest.mark.parametrize("nothing", ["end", "note_stop"])
def test_hung_disk_does_not_delay_a_stop(
    starts: Starts, hung: threading.Event, nothing: str
) -> None:
    starts.begin(start())
    starts.sent(LINE, 2)
    hung.clear()
    for _ in range(1000):
        getattr(starts, nothing)(LINE, 2)
        getattr(starts, nothing)(LINE, 3)
    assert len(starts._waiting) <= 2
    assert not starts.close(0.01)
    hung.set()
    assert starts.close(PATIENCE)
    assert files(starts) == []


def test_hung_disk_refuses_a_start_and_leaves_no_record(
    starts: Starts, hung: threading.Event
) -> None:
    starts.folder.mkdir(parents=True)
    hung.clear()
    for _ in range(3):
        with pytest.raises(StartNotRecorded, match=r"the disk did not answer within 0\.01 s"):
            starts.begin(start(), 0.01)
    assert not starts._waiting
    hung.set()
    assert starts.close(PATIENCE)
    assert [*starts.folder.iterdir()] == []


def test_refused_start_keeps_the_start_of_the_running_motor(
    starts: Starts, hung: threading.Event
) -> None:
    starts.begin(start(name="first"))
    starts.sent(LINE, 2)
    hung.clear()
    with pytest.raises(StartNotRecorded):
        starts.begin(start(name="second"), 0.01)
    hung.set()
    assert starts.close(PATIENCE)
    found = starts.found(LINE, 2)
    assert found is not None
    assert found.name == "first"
    starts.end(LINE, 2)
    assert starts.close(PATIENCE)
    assert files(starts) == [], "its standstill counts as before"


@pytest.mark.parametrize("ahead", [None, "tcp:elsewhere"], ids=["written", "waiting"])
def test_stop_overtakes_a_start_being_recorded(
    starts: Starts, hung: threading.Event, ahead: str | None
) -> None:
    starts.folder.mkdir(parents=True)
    hung.clear()
    with ThreadPoolExecutor(2) as pool:
        if ahead:
            first = pool.submit(starts.begin, start(line=ahead), PATIENCE)
            wait_until(lambda: starts._current is not None, "the disk at work")
        begun = pool.submit(starts.begin, start(), PATIENCE)
        wait_until(
            lambda: bool(starts._waiting if ahead else starts._current), "the start on its way"
        )
        starts.note_stop(LINE, 2)
        with pytest.raises(StartOvertaken, match="a stop of drive 2 came before its start"):
            begun.result(PATIENCE)
        hung.set()
        if ahead:
            first.result(PATIENCE)
    assert starts.close(PATIENCE)
    assert len(files(starts)) == (1 if ahead else 0)
    starts.begin(start())
    assert starts.found(LINE, 2) is not None


def test_standstill_seen_during_recording_does_not_refuse_the_start(
    starts: Starts, hung: threading.Event
) -> None:
    hung.clear()
    with ThreadPoolExecutor(1) as pool:
        begun = pool.submit(starts.begin, start(), PATIENCE)
        wait_until(lambda: starts._current is not None, "the disk at work")
        starts.end(LINE, 2)
        hung.set()
        begun.result(PATIENCE)
    assert starts.found(LINE, 2) is not None


def a_file(folder: Path) -> Path:
    folder.write_text("no folder")
    return folder


@pytest.mark.parametrize(
    "place", [a_file, lambda _: Path("/proc/self"), lambda _: Path("/dev/full")]
)
def test_unwritable_folder_refuses_the_start(tmp_path: Path, place: Callable[[Path], Path]) -> None:
    starts = Starts(place(tmp_path / "place"), MadeUp())
    with pytest.raises(StartNotRecorded) as caught:
        starts.begin(start(), PATIENCE)
    assert str(caught.value).startswith(f"The start of drive 2 was not recorded in {starts.folder}")
    assert "DRIVEPANEL_STATE" in str(caught.value)
    starts.end(LINE, 2)
    starts.note_stop(LINE, 2)
    assert starts.found(LINE, 2) is None
    assert starts.close(PATIENCE)


def test_full_disk_refuses_the_start_and_leaves_nothing(
    starts: Starts, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    starts.begin(start(name="first"))
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(StartNotRecorded, match="No space left on device"):
            starts.begin(start(name="second"), PATIENCE)
    found = starts.found(LINE, 2)
    assert found is not None
    assert found.name == "first"
    assert [file.suffix for file in starts.folder.iterdir()] == [".json"]


def test_record_is_flushed_before_it_is_renamed(
    starts: Starts, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[list[str]] = []
    starts.folder.mkdir(parents=True)
    monkeypatch.setattr(
        os, "fsync", lambda _: seen.append([file.suffix for file in starts.folder.iterdir()])
    )
    starts.begin(start(), PATIENCE)
    assert seen == [[".part"], [".json"]], "the file, then the folder"


def test_missing_thread_refuses_a_start_but_not_a_stop(
    starts: Starts, monkeypatch: pytest.MonkeyPatch
) -> None:
    starts.begin(start())
    assert starts.close(PATIENCE)

    def none_left(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", none_left)
        starts.note_stop(LINE, 2)
        with pytest.raises(StartNotRecorded, match="can't start new thread"):
            starts.begin(start(), PATIENCE)
    assert starts.found(LINE, 2) is None, "its stop is not forgotten"
    starts.note_stop(LINE, 2)
    assert starts.close(PATIENCE)
    assert files(starts) == []


@pytest.mark.parametrize(
    "text", [b"", b"{", b"[]", b'{"line": "tcp:gateway"}', b"\xff\xfe", b'{"line": 3}']
)
def test_damaged_file_is_set_aside(
    starts: Starts, text: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    starts.begin(start())
    (file,) = files(starts)
    file.write_bytes(text)
    with caplog.at_level(logging.ERROR, logger="drivepanel"):
        assert starts.found(LINE, 2) is None
    assert "is damaged and was renamed" in caplog.text
    assert file.with_suffix(".damaged").read_bytes() == text
    starts.begin(start(ENDED + 1))
    assert starts.found(LINE, 2) is not None


def test_foreign_file_is_ignored(starts: Starts) -> None:
    starts.begin(start())
    (starts.folder / "folder.json").mkdir()
    (starts.folder / "notes.txt").write_text("mine")
    starts.note_stop(LINE, 2)
    assert starts.close(PATIENCE)
    assert sorted(file.name for file in starts.folder.iterdir()) == ["folder.json", "notes.txt"]


def test_records_are_in_the_state_folder(tmp_path: Path) -> None:
    assert Starts().folder == tmp_path / "state" / "starts"


def test_record_names_this_program() -> None:
    record = Starts().record(LINE, IDENTITY, "atv71", "reverse", program="run", left_running=True)
    here = Processes()
    assert (record.pid, record.boot_id) == (os.getpid(), here.boot_id())
    assert record.started == here.started(os.getpid())
    assert (record.order, record.left_running, record.program) == ("reverse", True, "run")
    assert record.begun is not None


DRIVES = st.tuples(st.sampled_from(["tcp:one", "TCP:One:502", "tcp:two"]), st.integers(1, 2))
STEPS = st.one_of(
    st.tuples(st.just("begin"), DRIVES, st.sampled_from([os.getpid(), LIVING, ENDED, ENDED + 1])),
    st.tuples(st.sampled_from(["sent", "end", "note_stop", "close"]), DRIVES, st.just(0)),
)
Drive = tuple[str, int]


class Model:
    """Starts without disk and threads: which program started which drive, in order."""

    def __init__(self) -> None:
        self.begun: dict[tuple[Drive, int], int] = {}
        self.under_way: set[Drive] = set()

    def begin(self, drive: Drive, pid: int, number: int) -> None:
        self.begun[drive, pid] = number
        self.under_way.add(drive)

    def remove(self, drive: Drive) -> None:
        self.under_way.discard(drive)
        gone = [pair for pair in self._of(drive) if pair[1] != LIVING]
        self.begun = {pair: number for pair, number in self.begun.items() if pair not in gone}

    def found(self, drive: Drive) -> int | None:
        mine = self._of(drive)
        if any(pid in (LIVING, os.getpid()) for _, pid in mine):
            return None
        return max((self.begun[pair] for pair in mine), default=None)

    def _of(self, drive: Drive) -> list[tuple[Drive, int]]:
        key = (line_key(drive[0]), drive[1])
        return [pair for pair in self.begun if (line_key(pair[0][0]), pair[0][1]) == key]


@settings(max_examples=60)
@given(st.lists(STEPS, max_size=14))
def test_any_order_of_calls_matches_the_model(steps: list[tuple[str, Drive, int]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        starts, model = Starts(Path(folder), MadeUp()), Model()
        for number, (word, drive, pid) in enumerate(steps):
            line, device = drive
            if word == "begin":
                wall = f"2026-03-05T17:{number:02}:00+01:00"
                starts.begin(start(pid, line, device, name=str(number), wall=wall), PATIENCE)
                model.begin(drive, pid, number)
            elif word == "close":
                assert starts.close(PATIENCE)
            else:
                getattr(starts, word)(line, device)
                if word == "sent":
                    model.under_way.discard(drive)
                elif word == "note_stop" or drive not in model.under_way:
                    model.remove(drive)
            found = starts.found(line, device)
            wanted = model.found(drive)
            assert (found and found.name) == (None if wanted is None else str(wanted))
        assert starts.close(PATIENCE)
        assert len(files(starts)) == len(model.begun)


def test_start_is_recorded_for_other_users_of_the_group(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program of another user may own the line, and has to stop a motor that was left."""

    def user(name: str) -> Starts:
        monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / name))
        return Starts(processes=MadeUp())

    folder = tmp_path / "group"
    monkeypatch.setenv("DRIVEPANEL_SHARE_FOLDER", str(folder))
    starts, other = user("one"), user("other")
    starts.begin(start(line=LINE))
    assert other.found(LINE, 2) is None  # there is no such folder: the line is not shared
    folder.mkdir()
    folder.chmod(0o2770)
    starts.begin(start(line=LINE))
    record = other.found(LINE, 2)
    assert record is not None
    assert [record] == starts.all_found(LINE)
    (shared,) = (folder / "starts").glob("*.json")
    modes = [stat.S_IMODE(path.stat().st_mode) for path in (shared, shared.parent)]
    assert modes == [0o660, 0o2770]
    other.end(LINE, 2)
    starts.note_stop(LINE, 2)
    assert starts.close(PATIENCE)
    assert other.close(PATIENCE)
    assert not list((folder / "starts").iterdir())
    assert starts.found(LINE, 2) is None


def test_unknown_group_does_not_block_a_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "own"))
    monkeypatch.setenv("DRIVEPANEL_SHARE_FOLDER", str(tmp_path))
    (tmp_path / "starts").write_text("no folder")
    starts = Starts(processes=MadeUp())
    starts.begin(start())
    assert starts.found(LINE, 2) is not None
    assert starts.close(PATIENCE)


def test_program_of_another_user_hidden_by_proc_counts_as_alive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where /proc is mounted with hidepid, and in a service with ProtectProc."""
    (tmp_path / "self").mkdir()

    def not_ours(pid: int, number: int) -> None:
        assert number == 0
        raise PermissionError

    monkeypatch.setattr(os, "kill", not_ours)
    assert Processes(tmp_path).lives("", 4711, "100")

    def nobody(pid: int, number: int) -> None:
        raise ProcessLookupError

    monkeypatch.setattr(os, "kill", nobody)
    assert not Processes(tmp_path).lives("", 4711, "100")


def test_record_of_another_pid_namespace_is_kept_until_its_program_ends(tmp_path: Path) -> None:
    """Its process id says nothing here: a container has its own."""
    starts = Starts(tmp_path, processes=MadeUp())
    there = replace(start(pid=ENDED), space="pid:[1]")
    starts.begin(there)
    assert starts.is_alive(there)
    starts.end(LINE, there.device)
    assert starts.close(PATIENCE)
    assert starts.found(LINE, there.device) is None
    assert starts.found(LINE, there.device, {there.process}) == there
    assert starts.found(LINE, there.device, {("pid:[2]", ENDED)}) is None


def test_record_of_an_earlier_container_does_not_hide_a_later_start(tmp_path: Path) -> None:
    """The life of a program of another PID namespace is unknown: the last start counts."""
    starts = Starts(tmp_path, processes=MadeUp())
    there = replace(start(pid=ENDED), space="pid:[1]", wall="2026-11-01T10:00:00.000+00:00")
    here = start(pid=ENDED, started="101", wall="2026-11-02T10:00:00.000+00:00")
    starts.begin(there)
    starts.begin(here)
    assert starts.found(LINE, there.device, {here.process}) == here
    later = replace(there, started="102", wall="2026-11-03T10:00:00.000+00:00")
    starts.begin(later)
    assert starts.found(LINE, there.device, {here.process}) is None
