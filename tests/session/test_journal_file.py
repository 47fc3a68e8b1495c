"""The journal's file: shared with other programs, cut off by crashes, on disks that are full."""

from __future__ import annotations

import errno
import json
import os
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Timer

import pytest

from tests.programs import PATIENCE, wait_until
from tui.drive.profile import library
from tui.session import journal_file, paths
from tui.session.journal import Entry, Journal
from tui.session.journal_file import JOURNAL_NAME, JournalFile
from tui.session.journal_reading import DamagedLine, read_journal

from .test_journal import entry

posix = pytest.mark.skipif(os.name != "posix", reason="modes, pipes and limits of POSIX")

SEVERAL = """
import sys
from pathlib import Path
from tests.session.test_journal import entry
from tui.session import journal_file
from tui.session.journal import Journal
journal_file.LARGEST_FILE = 6000
journal = Journal(Path(sys.argv[1]))
print("ready", flush=True)
sys.stdin.readline()
first = int(sys.argv[2])
for number in range(first, first + 40):
    journal.add(entry(number))
assert journal.close(60), journal.trouble
"""

FULL = """
import resource, sys
from pathlib import Path
from tests.session.test_journal import entry
from tui.session.journal import Journal
journal = Journal(Path(sys.argv[1]))
journal.add(entry(1))
assert journal.flush(60)
before = journal.path.read_bytes()
soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 20, hard))
journal.add(entry(2))
assert not journal.flush(60)
print(journal.trouble)
assert journal.path.read_bytes() == before, journal.path.read_bytes()
resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
assert journal.close(60)
"""

LEFT = """
import sys, time
from pathlib import Path
from tests.session.test_journal import entry
from tui.session.journal import Journal
from tui.session.journal_file import JournalFile
honest = JournalFile.append
def slow(self, text):
    time.sleep(0.2)
    honest(self, text)
JournalFile.append = slow
journal = Journal(Path(sys.argv[1]))
journal.add(entry(1))
journal.add(entry(2))
"""


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[Journal]:
    made = Journal(tmp_path / "state")
    yield made
    made.close(PATIENCE)


def program(text: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    # without compiled modules: half a one would be left for others where there is no room
    command = [sys.executable, "-B", "-c", text, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)


def reported(journal: Journal) -> list[Entry | DamagedLine]:
    return list(read_journal(journal.files))


def numbers(journal: Journal) -> list[int]:
    return [entry.new_raw for entry in reported(journal) if isinstance(entry, Entry)]


@pytest.mark.parametrize("half", [b'{"time": "2026-01-01T00:00:00.000+00:00", "li', b"\0" * 700])
def test_partial_line_is_kept_and_marked(journal: Journal, half: bytes) -> None:
    journal.path.parent.mkdir()
    whole = json.dumps({"kind": "whatever"}).encode() + b"\n"
    journal.path.write_bytes(whole + half)
    journal.add(entry(1))
    journal.add(entry(2))
    assert journal.flush(PATIENCE)
    data = journal.path.read_bytes()
    assert data.startswith(whole + half + b"\n")
    mark, first, second = data[len(whole + half) + 1 :].splitlines()
    assert json.loads(mark)["kind"] == "mended"
    assert "cut off" in json.loads(mark)["why"]
    assert [json.loads(item)["new_raw"] for item in (first, second)] == [1, 2]
    damaged = [item for item in reported(journal) if isinstance(item, DamagedLine)]
    assert [line.number for line in damaged] == [1, 2]
    assert half.startswith(damaged[1].text.encode()[:10])


@pytest.mark.sweep
def test_several_programs_write_whole_lines_without_loss(tmp_path: Path) -> None:
    command = [sys.executable, "-c", SEVERAL, str(tmp_path / "state")]
    programs = [
        subprocess.Popen(
            [*command, str(first)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for first in range(0, 400, 100)
    ]
    try:
        for program in programs:
            assert program.stdout is not None
            assert program.stdout.readline() == "ready\n"
        # all begin at a time
        output = [program.communicate("\n", timeout=PATIENCE)[1] for program in programs]
        assert [program.returncode for program in programs] == [0] * 4, output
    finally:
        for program in programs:
            program.kill()
            program.wait()
    journal = Journal(tmp_path / "state")
    assert len([file for file in journal.files if file.exists()]) > 3
    assert not [entry for entry in reported(journal) if isinstance(entry, DamagedLine)]
    wanted = [n for first in range(0, 400, 100) for n in range(first, first + 40)]
    assert sorted(numbers(journal)) == wanted


@posix
def test_files_are_rotated_by_one_program_at_a_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two that moved them at a time would move one over the other."""
    import fcntl

    monkeypatch.setattr(journal_file, "LARGEST_FILE", 10)
    monkeypatch.setattr(journal_file, "TURN_PATIENCE", 0.05)
    file = JournalFile(tmp_path)
    file.append('{"one": 1}')
    other = os.open(tmp_path, os.O_RDONLY)
    try:
        fcntl.flock(other, fcntl.LOCK_EX)
        file.append('{"two": 2}')  # never waits long
        assert file.path.read_text() == '{"one": 1}\n{"two": 2}\n'
    finally:
        os.close(other)
    file.append('{"three": 3}')
    assert file.path.read_text() == '{"three": 3}\n'
    assert file.all[-2].read_text() == '{"one": 1}\n{"two": 2}\n'


@posix
@pytest.mark.parametrize("kept_for", [0.0, 0.2, None])
def test_turn_of_another_program_is_awaited_for_half_a_second(
    tmp_path: Path, kept_for: float | None
) -> None:
    import fcntl

    other, own = (os.open(tmp_path, os.O_RDONLY) for _ in range(2))
    released: Timer | None = None
    try:
        fcntl.flock(other, fcntl.LOCK_EX)
        if kept_for is not None:
            released = Timer(kept_for, fcntl.flock, (other, fcntl.LOCK_UN))
            released.start()
        begun = time.monotonic()
        assert journal_file._locked(own) is (kept_for is not None)
        assert kept_for is not None or time.monotonic() - begun > 0.4
        if released is not None:
            with pytest.raises(BlockingIOError):
                fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    finally:
        if released is not None:
            released.join()
        os.close(other)
        os.close(own)


@posix
def test_file_system_without_locks_blocks_no_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", refuse)
    monkeypatch.setattr(journal_file, "LARGEST_FILE", 10)
    file = JournalFile(tmp_path)
    for number in (1, 2):
        file.append(f'{{"number": {number}}}')
    assert file.path.read_text() == '{"number": 2}\n', "it is rotated"


@posix
def test_partial_line_on_full_disk_is_removed(tmp_path: Path) -> None:
    done = program(FULL, tmp_path / "state")
    assert done.returncode == 0, done.stderr
    assert "File too large" in done.stdout
    assert JOURNAL_NAME in done.stdout
    journal = Journal(tmp_path / "state")
    assert numbers(journal) == [1, 2]
    assert len(reported(journal)) == 2


def test_last_entries_are_written_at_the_exit(tmp_path: Path) -> None:
    done = program(LEFT, tmp_path / "state")
    assert (done.returncode, done.stderr) == (0, "")
    assert numbers(Journal(tmp_path / "state")) == [1, 2]


@posix
def test_journal_is_private_to_its_owner(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        journal = Journal(tmp_path / "some" / "state")
        journal.add(entry(1))
        assert journal.flush(PATIENCE)
    finally:
        os.umask(before)
    assert stat.S_IMODE(journal.path.stat().st_mode) == 0o600
    for folder in (journal.path.parent, journal.path.parent.parent):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    # one that others could read before
    journal.path.chmod(0o644)
    tmp_path.joinpath("some").chmod(0o755)
    journal.add(entry(2))
    assert journal.close(PATIENCE)
    assert stat.S_IMODE(journal.path.stat().st_mode) == 0o600
    assert stat.S_IMODE(tmp_path.joinpath("some").stat().st_mode) == 0o755


def nowhere(*_: object, **__: object) -> Path:
    raise RuntimeError("could not determine the home directory")


@posix
def test_invalid_file_is_reported_and_does_not_block(tmp_path: Path) -> None:
    state = tmp_path / "state"
    state.mkdir()
    os.mkfifo(state / JOURNAL_NAME)
    reader = os.open(state / JOURNAL_NAME, os.O_RDONLY | os.O_NONBLOCK)
    try:
        journal = Journal(state)
        journal.add(entry(1))
        assert not journal.close(PATIENCE)
        assert "Not a regular file" in journal.trouble
    finally:
        os.close(reader)


def test_trouble_is_reported_immediately_and_once(tmp_path: Path) -> None:
    output: list[str] = []
    (tmp_path / "state").touch()
    journal = Journal(tmp_path / "state", on_trouble=output.append)
    journal.add(entry(1))
    wait_until(lambda: bool(output), "it is told", patience=15)
    journal.add(entry(2))
    assert not journal.close(PATIENCE)
    assert output == [
        f"The journal cannot be written: Not a directory: {tmp_path / 'state' / JOURNAL_NAME}."
    ]
    assert journal.unkept == 2


def test_unreportable_trouble_loses_no_entry(tmp_path: Path) -> None:
    def gone(text: str) -> None:
        raise OSError(text)

    (tmp_path / "state").touch()
    journal = Journal(tmp_path / "state", on_trouble=gone)
    journal.add(entry(1))
    assert not journal.flush(PATIENCE)
    (tmp_path / "state").unlink()
    assert journal.close(PATIENCE)
    assert numbers(journal) == [1]


@pytest.mark.parametrize("home", [lambda *_, **__: Path("~/.local/state"), nowhere])
def test_without_a_home_no_file_is_created(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, home: Callable[..., Path]
) -> None:
    """A user without an entry in the system's list: `~` stays, or platformdirs gives it up."""
    monkeypatch.delenv("DRIVEPANEL_STATE")
    monkeypatch.delenv("DRIVEPANEL_CONFIG")
    monkeypatch.setattr("platformdirs.user_state_path", home)
    monkeypatch.setattr("platformdirs.user_config_path", nowhere)
    assert library.listings()
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    journal = Journal()
    journal.add(entry(1))
    assert not journal.close(PATIENCE)
    assert "name a folder in DRIVEPANEL_STATE" in journal.trouble
    paths.remember_line("sim:atv71")
    assert paths.recent_lines() == []
    assert sorted(tmp_path.rglob("*")) == before


def test_unflushed_line_is_not_written_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = JournalFile(tmp_path / "state")
    file.append('{"one": 1}')
    honest = os.fsync
    monkeypatch.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError(5, "Input/output")))
    with pytest.raises(OSError, match="Input/output"):
        file.append('{"two": 2}')
    monkeypatch.setattr(os, "fsync", honest)
    file.append('{"two": 2}')
    assert file.path.read_text().splitlines() == ['{"one": 1}', '{"two": 2}']
