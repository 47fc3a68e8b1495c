"""An unwritable journal is reported immediately, and no command fails because of it.

Nor do a full disk under the log and under standard output, and streams that are closed.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.programs import DRIVEPANEL, PATIENCE
from tests.sweeps import kept
from tui.cli.shared.drive_commands import close_journal
from tui.session.journal import Journal

from .commands import invoked

resource = pytest.importorskip("resource")

WRITE = ("write", "sim:atv71@1", "ACC=4.0", "--arm")
STOP = ("stop", "sim:atv71@1")
STOP_ALL = ("stop", "--all", "sim:atv71@1")
REFERENCE = ("reference", "sim:atv71@1", "20", "--arm")
RUN = ("run", "sim:atv71@1", "--reference", "20", "--for", "0.5", "--arm")
READ = ("read", "sim:atv71@1", "ACC")
CLOSED = {"0": "<&-", "1": ">&-", "2": "2>&-", "all": "<&- >&- 2>&-"}


def state_folder() -> Path:
    return Path(os.environ["DRIVEPANEL_STATE"])


def no_room() -> None:
    """No file of the program takes more than a few bytes, as on a full disk; pipes do."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (16, 16))


def program(
    *arguments: str, out: int | None = subprocess.PIPE, limit: Callable[[], None] | None = None
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*DRIVEPANEL, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=out,
        stderr=subprocess.PIPE,
        text=True,
        timeout=PATIENCE,
        check=False,
        preexec_fn=limit,
        # half a compiled module would be left for the programs of other tests
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
    )


def test_write_without_a_journal_is_done_and_reported() -> None:
    state = state_folder()
    state.parent.mkdir(parents=True, exist_ok=True)
    state.write_text("a file where the folder should be")
    done = invoked(*WRITE)
    assert done.exit_code == 0, done.stderr
    assert done.stderr.splitlines() == [
        f"drivepanel: The journal cannot be written: Not a directory: {state / 'journal.jsonl'}."
        " The command goes on.",
        "drivepanel: 1 entry is not in the journal.",
    ]


@pytest.mark.parametrize("command", kept([WRITE, STOP, STOP_ALL, REFERENCE, RUN], WRITE, RUN))
@pytest.mark.sweep
def test_full_disk_is_reported_and_fails_nothing_else(
    command: tuple[str, ...],
) -> None:
    done = program(*command, limit=no_room)
    assert done.returncode == 0, done.stderr
    first, last = done.stderr.splitlines()
    assert first.startswith("drivepanel: The journal cannot be written: File too large: ")
    assert "not in the journal" in last
    if command in (STOP, STOP_ALL, RUN):
        assert "stopped" in done.stdout


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_read_only_folder_is_reported() -> None:
    state_folder().mkdir(mode=0o500)
    done = program(*STOP)
    assert done.returncode == 0
    assert "The journal cannot be written: Permission denied" in done.stderr


def test_hung_disk_is_reported_at_the_end(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    journal = Journal()
    monkeypatch.setattr(Journal, "close", lambda _: False)
    monkeypatch.setattr(Journal, "unkept", 3)
    close_journal(journal)
    output = capsys.readouterr().err
    assert output == (
        f"drivepanel: 3 entries are not in the journal: the disk does not answer: {journal.path}.\n"
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="without /dev/full")
@pytest.mark.parametrize("command", kept([WRITE, STOP, STOP_ALL, REFERENCE], STOP))
def test_lost_output_does_not_report_done_work_as_failed(
    command: tuple[str, ...],
) -> None:
    with Path("/dev/full").open("w") as full:
        done = program(*command, out=full.fileno())
    assert done.returncode == 0
    assert done.stderr == (
        "drivepanel: What was printed is lost: standard output cannot be written: No space left on"
        " device.\n"
    )
    assert (state_folder() / "journal.jsonl").read_text().count("\n") >= 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="without /dev/full")
@pytest.mark.parametrize("more", [(), ("--json",)])
@pytest.mark.sweep
def test_lost_requested_output_is_a_failure(more: tuple[str, ...]) -> None:
    with Path("/dev/full").open("w") as full:
        done = program(*READ, *more, out=full.fileno())
    assert done.returncode == 74
    assert done.stderr.splitlines() == [
        "drivepanel: What was printed is lost: standard output cannot be written: No space left on"
        " device."
    ]


@pytest.mark.parametrize("which", kept(CLOSED, "2", "all"))
@pytest.mark.sweep
def test_closed_streams_do_no_harm(which: str) -> None:
    command = f'exec "$@" {CLOSED[which]}'
    done = subprocess.run(
        ["/bin/sh", "-c", command, "sh", *DRIVEPANEL, *STOP],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0
    assert done.stderr == ""
    assert (state_folder() / "journal.jsonl").read_text().count("\n") >= 1
