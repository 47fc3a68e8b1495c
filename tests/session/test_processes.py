"""Detection of living programs: real ones, and those of a made-up /proc."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.programs import wait_until
from tui.session.starts.processes import Processes

BEHIND = " ".join(["0"] * 18)
"""The fields of a stat line between the state and the start."""


def made_up(proc: Path, boot: str = "boot-1", **stats: str) -> Processes:
    """A /proc with these programs: `p7="S 100"` is number 7, sleeping, started at 100."""
    (proc / "sys/kernel/random").mkdir(parents=True, exist_ok=True)
    (proc / "sys/kernel/random/boot_id").write_text(f"{boot}\n")
    (proc / "self").mkdir(exist_ok=True)
    for name, text in stats.items():
        state, started = text.split()
        (proc / name[1:]).mkdir(exist_ok=True)
        line = f"{name[1:]} (a) S 1 (b) {state} {BEHIND} {started} 0 0\n"
        (proc / name[1:] / "stat").write_text(line)
    return Processes(proc)


@contextmanager
def sleeper() -> Iterator[subprocess.Popen[bytes]]:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as program:
        try:
            yield program
        finally:
            program.kill()


def test_this_program_is_alive() -> None:
    here = Processes()
    started = here.started(os.getpid())
    assert started
    assert here.lives(here.boot_id(), os.getpid(), started)


@pytest.mark.parametrize("proc", [Path("/proc"), Path("/nowhere")], ids=["proc", "ps"])
def test_killed_program_counts_as_ended_before_it_is_reaped(proc: Path) -> None:
    here = Processes(proc)
    with sleeper() as program:
        started = here.started(program.pid)
        assert started
        assert here.lives(here.boot_id(), program.pid, started)
        program.kill()
        wait_until(lambda: not here.lives(here.boot_id(), program.pid, started), "its end")
        program.wait()
        assert here.started(program.pid) is None


def test_reused_pid_is_another_program(tmp_path: Path) -> None:
    here = made_up(tmp_path, p7="S 200")
    assert here.lives("boot-1", 7, "200")
    assert not here.lives("boot-1", 7, "100")


def test_program_of_an_earlier_boot_has_ended(tmp_path: Path) -> None:
    assert not made_up(tmp_path, boot="boot-2", p7="S 100").lives("boot-1", 7, "100")


@pytest.mark.parametrize(("state", "lives"), [("S", True), ("T", True), ("Z", False), ("X", False)])
def test_process_state_shows_if_it_is_alive(tmp_path: Path, state: str, lives: bool) -> None:
    assert made_up(tmp_path, p7=f"{state} 100").lives("boot-1", 7, "100") is lives


def test_process_with_unknown_state_counts_as_alive(tmp_path: Path) -> None:
    here = made_up(tmp_path, p7="S 100")
    assert here.lives("", 7, "")
    (tmp_path / "8").mkdir()
    (tmp_path / "8" / "stat").write_text("cut")
    assert here.lives("boot-1", 8, "100")
    (tmp_path / "9" / "stat").mkdir(parents=True)
    assert here.lives("boot-1", 9, "100")
