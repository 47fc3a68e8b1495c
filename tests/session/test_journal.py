"""The journal: no caller waits for its disk, and no entry is lost while it can be kept."""

from __future__ import annotations

import asyncio
import errno
import json
import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock, Mock, call

import pytest

from tests.programs import PATIENCE, wait_until
from tests.session.sets_bench import bench
from tui.session import journal as module
from tui.session import journal_file
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase
from tui.session.journal import Entry, Journal, entry_time, now_text
from tui.session.journal_reading import entries_of

PROGRAM = """
import os, signal, sys, threading
from pathlib import Path
from tests.session.test_journal import entry
from tui.session.journal import Journal
journal = Journal(Path(sys.argv[1]))
for number in range(3):
    journal.add(entry(number))
assert journal.flush(60)
os.fsync = lambda number: threading.Event().wait()
for number in range(3, 9):
    journal.add(entry(number))
os.kill(os.getpid(), signal.SIGKILL)
"""


class Disk:
    """A disk that flushes, hangs in it, or refuses."""

    def __init__(self) -> None:
        self.real, self.works, self.hangs = os.fsync, threading.Event(), threading.Event()
        self.refuses = False
        self.works.set()
        self.others = set(_journals())

    def fsync(self, number: int) -> None:
        if not self.works.is_set():
            self.hangs.set()
        assert self.works.wait(PATIENCE)
        if self.refuses:
            raise OSError(errno.EIO, "Input/output error")
        self.real(number)


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Disk]:
    """The disk under every journal of the test; it works again at its end."""
    made = Disk()
    monkeypatch.setattr(os, "fsync", made.fsync)
    monkeypatch.setattr(module, "RETRY_DISK_AFTER", 0.01)
    yield made
    made.refuses = False
    made.works.set()


@pytest.fixture
def journal(disk: Disk, tmp_path: Path) -> Iterator[Journal]:
    made = Journal(tmp_path / "state")
    yield made
    disk.refuses = False
    disk.works.set()
    assert made.close(PATIENCE)
    wait_until(lambda: not threads(disk), "the thread ends")


def entry(number: int) -> Entry:
    """An entry that is recognized by its new value."""
    text = str(number)
    return Entry("now", "line", 1, "atv71", "ACC", 9001, 0, "0", number, text, "ok", number, "test")


def threads(disk: Disk) -> list[threading.Thread]:
    """Threads of this test's journals, without those of other tests."""
    return [thread for thread in _journals() if thread not in disk.others]


def _journals() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "journal"]


def kept(journal: Journal) -> list[int]:
    """Content of the file, in its order."""
    lines = journal.path.read_text("utf-8").splitlines()
    return [json.loads(line)["new_raw"] for line in lines]


def test_unused_journal_creates_no_file(disk: Disk, tmp_path: Path) -> None:
    made = Journal(tmp_path / "state")
    assert made.flush(0)
    assert made.close(0)
    assert (made.recent, made.trouble, threads(disk)) == ((), "", [])
    assert not (tmp_path / "state").exists()


def test_hung_disk_delays_no_caller(journal: Journal, disk: Disk) -> None:
    disk.works.clear()
    for number in range(20):
        journal.add(entry(number))
    assert disk.hangs.wait(PATIENCE)
    journal.add(entry(20))
    assert [item.new_raw for item in journal.recent] == list(range(21))
    assert not journal.flush(0.01)
    assert not journal.close(0.01)
    disk.works.set()
    assert journal.flush(PATIENCE)
    assert kept(journal) == list(range(21))


def test_entry_after_the_end_of_the_thread_is_kept(
    journal: Journal, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "IDLE_ENDS_AFTER", 0.01)
    for number in range(3):
        journal.add(entry(number))
        assert journal.flush(PATIENCE)
        wait_until(lambda: not threads(disk), "the thread ends, as nothing comes")
    assert kept(journal) == [0, 1, 2]


def test_hung_disk_is_reported(
    journal: Journal, disk: Disk, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "SLOW", 0.01)
    disk.works.clear()
    journal.add(entry(1))
    wait_until(lambda: "the disk has not answered for" in journal.trouble, "it is told")
    disk.works.set()
    assert journal.flush(PATIENCE)
    assert journal.trouble == ""
    wait_until(lambda: "the disk took" in caplog.text, "it is logged")


async def test_stop_does_not_wait_for_the_disk(disk: Disk) -> None:
    with bench("atv71", run_hz=20.0) as here:
        await asyncio.to_thread(wait_until, lambda: here.drive.motor.frequency > 5, "it runs")
        disk.works.clear()
        stopper = Stopper(here.session.line, here.journal)
        stopper.stop([here.session])
        ended = (Phase.STOPPED, Phase.FAILED)

        def is_over() -> bool:
            return 1 in stopper.reports and stopper.reports[1].phase in ended

        await asyncio.to_thread(wait_until, is_over, "the stop ends")
        assert stopper.reports[1].phase is Phase.STOPPED
        assert here.drive.motor.frequency == 0
        assert disk.hangs.is_set()
        assert here.journal.recent
        disk.works.set()


@pytest.mark.skipif(os.name != "posix", reason="without kill -9")
def test_kill_loses_only_unflushed_entries(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path)], timeout=PATIENCE, check=False
    )
    assert done.returncode == -signal.SIGKILL
    # the fourth was being flushed, the others waited for that
    assert kept(Journal(tmp_path)) in ([0, 1, 2], [0, 1, 2, 3])


def test_entries_of_several_threads_keep_their_order(journal: Journal) -> None:
    def add(first: int) -> None:
        for number in range(first, first + 50):
            journal.add(entry(number))

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(add, range(0, 400, 100)))
    order = [item.new_raw for item in journal.recent]
    assert len(order) == 200
    assert journal.flush(PATIENCE)
    assert kept(journal) == order


def test_unwritable_folder_is_reported(
    disk: Disk, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").touch()
    made = Journal(tmp_path / "file")
    made.add(entry(1))
    wait_until(lambda: bool(made.trouble), "it is told")
    assert made.trouble.startswith("The journal cannot be written: ")
    assert "the journal cannot be written" in caplog.text
    # waiting callers are notified once the disk refuses again
    assert not made.flush(PATIENCE * 10)
    assert not made.close(PATIENCE * 10)
    wait_until(lambda: not threads(disk), "nobody tries any more")
    assert [item.new_raw for item in made.recent] == [1]
    # the disk is repaired
    (tmp_path / "file").unlink()
    made.add(entry(2))
    assert made.close(PATIENCE)
    assert kept(made) == [1, 2]
    assert made.trouble == ""


def refusing(disk: Disk, tmp_path: Path) -> tuple[Callable[[], None], Callable[[], None]]:
    """A disk whose flush fails."""
    return lambda: setattr(disk, "refuses", True), lambda: setattr(disk, "refuses", False)


def full(disk: Disk, tmp_path: Path) -> tuple[Callable[[], None], Callable[[], None]]:
    """A file that cannot be written: a folder has its name."""
    aside, path = tmp_path / "aside", tmp_path / "state" / journal_file.JOURNAL_NAME

    def breaks() -> None:
        path.rename(aside)
        path.mkdir()

    def mended() -> None:
        path.rmdir()
        aside.rename(path)

    return breaks, mended


@pytest.mark.parametrize("how", [refusing, full])
def test_recovered_disk_gets_the_missed_entries(
    journal: Journal,
    disk: Disk,
    tmp_path: Path,
    how: Callable[[Disk, Path], tuple[Callable[[], None], Callable[[], None]]],
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.WARNING)
    journal.add(entry(0))
    assert journal.flush(PATIENCE)
    breaks, mended = how(disk, tmp_path)
    breaks()
    for number in range(1, 6):
        journal.add(entry(number))
    wait_until(lambda: bool(journal.trouble), "it is told")
    assert not journal.flush(PATIENCE)
    mended()
    # it happens without a request
    wait_until(lambda: journal.trouble == "" and journal.flush(), "it is written")
    assert kept(journal) == list(range(6))
    assert [item.new_raw for item in entries_of(journal, "line", 1)] == list(range(6))
    assert journal.lost == 0
    assert caplog.text.count("the journal cannot be written") == 1
    assert "written again" in caplog.text


def test_events_beyond_the_limit_are_lost_and_counted(
    journal: Journal,
    disk: Disk,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr(module, "JOURNAL_BACKLOG", 5)
    disk.refuses = True
    for number in range(12):
        journal.add(entry(number))
    wait_until(lambda: "7 entries lost" in journal.trouble, "it is told")
    disk.refuses = False
    wait_until(lambda: journal.trouble == "" and journal.flush(), "it is written")
    # an abandoned one may be there, its flush failed
    assert [number for number in kept(journal) if number >= 7] == [7, 8, 9, 10, 11]
    assert journal.lost == 7
    assert "7 lost" in caplog.text


def test_old_files_are_removed(journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
    journal.add(entry(0))
    assert journal.flush(PATIENCE)
    size = journal.path.stat().st_size
    monkeypatch.setattr(journal_file, "LARGEST_FILE", 2 * size)
    for number in range(1, 30):
        journal.add(entry(number % 10))
    assert journal.flush(PATIENCE)
    there = sorted(path.name for path in journal.path.parent.iterdir())
    assert there == [
        journal_file.JOURNAL_NAME,
        *(f"{journal_file.JOURNAL_NAME}.{n}" for n in range(1, 10)),
    ]
    held = [item.new_raw for item in entries_of(journal, "line", 1)]
    assert held == [number % 10 for number in range(10, 30)]


def test_truncated_line_does_not_damage_others(journal: Journal) -> None:
    journal.path.parent.mkdir()
    journal.path.write_text('{"time": "a power cut')
    journal.add(entry(1))
    assert [item.new_raw for item in entries_of(journal, "line", 1)] == [1]


def test_reader_sees_latest_entry(journal: Journal) -> None:
    for number in range(30):
        journal.add(entry(number))
        assert entries_of(journal, "line", 1)[-1].new_raw == number


def test_entries_wait_if_there_is_no_thread_to_write_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Journal(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", no_thread)
        made.add(entry(1))
        assert "no thread can be started" in made.trouble
        assert (made.unkept, made.lost) == (1, 0)
    made.add(entry(2))
    assert made.flush()
    assert (made.unkept, made.trouble) == (0, "")
    made.close()


def no_thread(thread: threading.Thread) -> None:
    raise RuntimeError("no thread can be started")


@pytest.mark.parametrize(("wall", "millis"), [(5.0, "05.000"), (5.1239, "05.123")])
def test_time_of_an_entry_has_milliseconds_and_its_zone(wall: float, millis: str) -> None:
    assert entry_time(wall) == f"1970-01-01T00:00:{millis}+00:00"
    assert len(entry_time(None)) == len(now_text()) == len(entry_time(wall))


# -- without its thread ----------------------------------------------------------------------------


@pytest.fixture
def held(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Mock, Mock]:
    """A journal whose thread never begins, the thread, and what is to run at the end."""
    thread, at_end = Mock(), Mock()
    monkeypatch.setattr("tui.session.journal.threading.Thread", thread)
    monkeypatch.setattr("tui.session.journal.atexit.register", at_end)
    return Journal(tmp_path), thread, at_end


def test_entry_waits_for_the_disk_and_is_known_by_what_was_sent(
    held: tuple[Any, Mock, Mock],
) -> None:
    journal, thread, at_end = held
    saved = replace(entry(1), eeprom="write")
    journal.add(saved)
    journal.add(replace(saved, answer="refused"), sent=False)
    journal.add(replace(entry(2), kind="reset"))
    journal.add(replace(entry(3), kind="fault"))
    assert [each.kind for each in journal._waiting] == ["write", "write", "reset", "fault"]
    assert [each.eeprom for each in journal.recent] == ["write", ""], "what was not sent wears none"
    assert journal.sent == (saved, replace(entry(2), kind="reset"))
    assert thread.mock_calls == [
        call(target=journal._work, name="journal", daemon=True), call().start(),
    ]  # fmt: skip
    assert at_end.call_count == 1
    ((ending,),) = [each.args for each in at_end.call_args_list]
    journal.flush = Mock()
    ending()
    journal.flush.assert_called_once_with()


def test_entry_after_the_end_of_a_journal_opens_it_again(held: tuple[Any, Mock, Mock]) -> None:
    journal = held[0]
    journal._closed, journal._changed = True, MagicMock()
    journal.add(entry(1))
    assert not journal._closed
    journal._changed.notify_all.assert_called_once_with()


def test_oldest_entries_are_dropped_and_counted(
    held: tuple[Any, Mock, Mock], monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = held[0]
    monkeypatch.setattr(module, "JOURNAL_BACKLOG", 2)
    for number in range(2):
        journal.add(entry(number))
    assert journal.lost == 0
    for number in range(2, 5):
        journal.add(entry(number))
    assert (list(journal._waiting), journal.lost) == ([entry(3), entry(4)], 3)


def test_thread_that_cannot_begin_is_tried_again(held: tuple[Any, Mock, Mock]) -> None:
    journal, thread, _ = held
    thread.return_value.start.side_effect = RuntimeError("no thread")
    for number in range(2):
        journal.add(entry(number))
    assert (journal._why, journal._failures, journal._thread) == ("no thread", 2, None)
    thread.return_value.start.side_effect = None
    journal.add(entry(2))
    journal.add(entry(3))
    assert (journal._thread, thread.call_count) == (thread.return_value, 3)
