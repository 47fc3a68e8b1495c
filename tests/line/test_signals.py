"""Signals of every kind to programs that have a motor or a line: stop first, never suspend."""

from __future__ import annotations

import ctypes
import os
import re
import signal
import subprocess
import sys
import termios
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tests.programs import (
    DRIVEPANEL,
    PATIENCE,
    drivepanel,
    is_running,
    keepers,
    port_of,
    served,
    simulated,
    wait_until,
)
from tui.safety import LINGERS
from tui.session.signals import OF_ERRORS, SUSPENDING, UNTOUCHED, ending_signals, signal_name
from tui.simulator import DriveSpec, Simulation

from .pty_panel import PtyPanel, panel_on_a_pty, start_panel

FROM_OUTSIDE = [int(getattr(signal, name)) for name in OF_ERRORS]
"""Signals of errors, sent by another program."""
REAL_TIME = range(signal.SIGRTMIN + 2, signal.SIGRTMAX)
"""Signals that differ from their neighbors in nothing."""
ENDING = sorted({*ending_signals(), *FROM_OUTSIDE} - {signal.SIGXFSZ, *REAL_TIME})
AT_ONCE = 4
"""Programs that run side by side."""
FULL_SCREEN, USUAL_SCREEN = b"\x1b[?1049h", b"\x1b[?1049l"
IGNORED = "is ignored: while suspended"
A_FEW = (signal.SIGINT, signal.SIGQUIT, signal.SIGUSR1, signal.SIGSEGV, signal.SIGRTMIN + 1)
"""A signal of each kind: by keys, by a program, of an error, in real time."""


def is_suspended(pid: int) -> bool:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "T"


def looked_at(pid: int, terminal: int) -> PtyPanel:
    """A program on a pseudo-terminal, with nothing kept of its line."""
    nothing: Any = None
    return PtyPanel(pid, terminal, nothing, nothing)


def ended(panel: PtyPanel) -> None:
    """Wait until the program has ended; take what it prints until then."""
    wait_until(lambda: (panel.look(), not is_running(panel.pid))[1], "the program ended")


def test_every_signal_of_the_system_has_one_treatment() -> None:
    groups = [(*UNTOUCHED,), (*SUSPENDING,), (*OF_ERRORS,)]
    named = [int(getattr(signal, name)) for group in groups for name in group if name != "SIGINFO"]
    every = sorted([*named, *ending_signals()])
    assert every == sorted(map(int, signal.valid_signals()))
    assert len({signal_name(number) for number in every}) == len(every)


def other_takers(pid: int, number: int) -> list[int]:
    """Threads of a program, besides the main one, to which the system may give a signal."""
    found = []
    for thread in map(int, os.listdir(f"/proc/{pid}/task")):
        with suppress(OSError):  # it has just ended
            status = Path(f"/proc/{pid}/task/{thread}/status").read_text()
            blocked = int(re.findall(r"SigBlk:\s*(\w+)", status)[0], 16)
            if thread != pid and not blocked >> (number - 1) & 1:
                found.append(thread)
    return found


def test_simulation_ends_by_a_signal_that_another_thread_took() -> None:
    with simulated("atv71@1", "--tcp", "127.0.0.1:0") as simulation:
        pid = simulation.process.pid
        thread, *_ = other_takers(pid, signal.SIGINT)
        assert ctypes.CDLL(None).tgkill(pid, thread, signal.SIGINT) == 0
        assert simulation.process.wait(PATIENCE / 4) == 0


def test_no_other_thread_of_a_keeper_takes_a_signal() -> None:
    """It did not end for one that its line's thread took, and would have held the line."""
    with simulated("atv71@1", "--tcp", "127.0.0.1:0") as simulation:
        line = f"tcp:127.0.0.1:{port_of(simulation.ready)}"
        assert drivepanel("read", line, "RFR", "-d", "1", "-p", "atv71").returncode == 0
        (keeper,) = keepers()
        assert other_takers(keeper, signal.SIGTERM) == []
        os.kill(keeper, signal.SIGTERM)
        wait_until(lambda: not is_running(keeper), "the keeper ended", LINGERS / 2)


def run_and_signal(*numbers: int, ignored: bool = False) -> tuple[int, float, bool, str]:
    """Give signals to `run`: its status, the motor's frequency then, if it tripped, and why."""
    with Simulation([DriveSpec("atv71", 1, sets={"TTO": 300})]) as simulation:
        host, port = simulation.serve_tcp()
        line = f"tcp:{host}:{port}"
        command = [*DRIVEPANEL, "run", line, "-d", "1", "--reference", "10Hz", "--arm"]
        if ignored:
            command = ["sh", "-c", 'trap "" HUP; exec "$@"', "sh", *command]
        drive = simulation.drive(1)
        with served(command, ready="Run forward") as program:
            wait_until(lambda: drive.motor.frequency > 2, "the motor runs")
            for number in numbers:
                program.process.send_signal(number)
            printed, _ = program.process.communicate(timeout=PATIENCE)
            why = re.findall(r"stopping \(ended by (\S+)\)", printed)
            status, tripped = program.process.returncode, drive.fault is not None
            return status, drive.motor.frequency, tripped, " ".join(why)


def stopped_by(number: int) -> tuple[int, float, bool, str]:
    """The same for a stopped motor, and its source."""
    return 0, 0.0, False, signal_name(signal.SIGTERM if number in FROM_OUTSIDE else number)


def test_run_stops_its_motor_on_every_terminating_signal() -> None:
    with ThreadPoolExecutor(AT_ONCE) as pool:
        ends = dict(zip(ENDING, pool.map(run_and_signal, ENDING), strict=True))
    assert ends == {number: stopped_by(number) for number in ENDING}


def test_run_stops_its_motor_once_when_many_signals_arrive() -> None:
    status, hertz, tripped, why = run_and_signal(*ENDING, *ENDING)
    assert (status, hertz, tripped, len(why.split())) == (0, 0.0, False, 1)


def test_run_ignores_a_hangup_ignored_at_its_start() -> None:
    """As by nohup."""
    end = run_and_signal(signal.SIGHUP, signal.SIGUSR2, ignored=True)
    assert end == stopped_by(signal.SIGUSR2)


@pytest.mark.parametrize("number", A_FEW, ids=signal_name)
def test_panel_stops_its_motor_before_it_ends(number: int) -> None:
    with panel_on_a_pty() as panel:
        panel.run()
        before = len(panel.log.writes)
        os.kill(panel.pid, number)
        os.kill(panel.pid, signal.SIGUSR2)
        ended(panel)
        assert panel.stops(before) > 0
        assert panel.simulation.drive(1).motor.frequency == 0
        assert termios.tcgetattr(panel.terminal)[3] & termios.ICANON


def test_panel_cannot_be_suspended_and_says_so() -> None:
    with panel_on_a_pty() as panel:
        panel.run()
        for key, name in (("\x1a", "Ctrl+Z"), ("\x1c", "Ctrl+\\"), ("\x03", "Ctrl+C")):
            panel.type(key)
            panel.shows(f"{name} does not end the panel. Press q to quit.")
        for name in SUSPENDING:
            os.kill(panel.pid, getattr(signal, name))
            panel.shows(f"{'Ctrl-Z' if name == 'SIGTSTP' else name} {IGNORED}", "Press q to quit")
            assert not is_suspended(panel.pid)
        before = len(panel.log.writes)
        panel.type(" ")
        panel.stopped(before)


def test_resumed_panel_reads_its_keys_once() -> None:
    """Textual opened the terminal a second time, with a second thread for the keys."""
    with panel_on_a_pty() as panel:
        tasks = Path(f"/proc/{panel.pid}/task")
        before = len(list(tasks.iterdir()))
        os.kill(panel.pid, signal.SIGSTOP)
        wait_until(lambda: is_suspended(panel.pid), "suspended")
        mode = termios.tcgetattr(panel.terminal)
        mode[3] |= termios.ICANON | termios.ECHO  # as set by a shell that takes the terminal
        termios.tcsetattr(panel.terminal, termios.TCSANOW, mode)
        panel.cells.clear()
        os.kill(panel.pid, signal.SIGCONT)
        panel.shows("STANDBY")
        assert not termios.tcgetattr(panel.terminal)[3] & termios.ICANON
        assert len(list(tasks.iterdir())) <= before
        panel.arm()


@pytest.mark.parametrize("drawn", [True, False])
def test_signal_ends_an_opening_panel_and_restores_the_terminal(drawn: bool) -> None:
    pid, terminal = start_panel(["sim:atv71", "-d", "1"])
    panel = looked_at(pid, terminal)
    try:
        if drawn:
            wait_until(lambda: panel.look() and FULL_SCREEN in panel.sent, "the panel draws")
        else:
            wait_until(lambda: catches(pid, signal.SIGUSR1), "the panel takes signals")
        os.kill(pid, signal.SIGUSR1)
        ended(panel)
        assert termios.tcgetattr(terminal)[3] & termios.ICANON
        assert panel.sent.count(FULL_SCREEN) == panel.sent.count(USUAL_SCREEN)
    finally:
        assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 128 + signal.SIGUSR1
        os.close(terminal)


def catches(pid: int, number: int) -> bool:
    found = re.search(r"SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
    return found is not None and bool(int(found[1], 16) >> (number - 1) & 1)


OWNERS = {
    "watch": (("sim:atv71@2", "-d", "2", "ETA", "--every", "0.2"), "ETA", 128),
    "watch of two lines": (("sim:atv71@2", "sim:atv31@1", "ETA", "--every", "0.2"), "ETA", 128),
    "hold": (("sim:atv71@2", "-d", "2"), "kept alive", 128),
    "serve": (("sim:atv71@2", "--tcp", "127.0.0.1:0"), "Ready", 128),
    "listen": (("sim:atv71@2",), "Listening", 128),
    "simulate": (("atv71@2", "--tcp", "127.0.0.1:0"), "Ready", -signal.SIGUSR1),
}
"""Commands that own a line for long: words, the first words they print, and the number added to the
signal that ends them.
"""


@pytest.mark.parametrize("name", OWNERS)
def test_command_that_owns_a_line_cannot_be_suspended(name: str) -> None:
    words, ready, plus = OWNERS[name]
    command = [*DRIVEPANEL, name.split()[0], *words]
    with served(command, ready=ready) as program:
        output: list[str] = []
        assert program.process.stderr is not None
        reading = threading.Thread(target=lambda: output.extend(program.process.stderr or ()))
        reading.start()
        for text in SUSPENDING:
            program.process.send_signal(getattr(signal, text))
        wait_until(lambda: sum(IGNORED in line for line in output) == 3, f"it says so: {output}")
        assert not is_suspended(program.process.pid)
        program.process.send_signal(signal.SIGUSR1)
        assert program.process.wait(PATIENCE) == plus + signal.SIGUSR1
        reading.join()


def test_terminal_keys_stop_and_never_suspend_a_run() -> None:
    with Simulation([DriveSpec("atv71", 1, sets={"TTO": 300})]) as simulation:
        host, port = simulation.serve_tcp()
        words = ["run", f"tcp:{host}:{port}", "-d", "1", "--reference", "10Hz", "--arm"]
        pid, terminal = start_panel(words)
        panel = looked_at(pid, terminal)
        drive = simulation.drive(1)
        try:
            wait_until(lambda: panel.look() and drive.motor.frequency > 2, "the motor runs")
            panel.type("\x1a")
            wait_until(lambda: panel.look() and b"Ctrl-Z is ignored" in panel.sent, "it says so")
            assert not is_suspended(pid)
            assert drive.motor.frequency > 2
            panel.type("\x1c")
            ended(panel)
            assert drive.motor.frequency == 0
        finally:
            assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
            os.close(terminal)


REAL_ERROR = """
import ctypes
from tui.session.signals import handled
from tui.cli.shared.signals import never_suspended
with never_suspended(), handled(lambda *_: print("handled")):
    ctypes.string_at(0)
"""


def test_segmentation_fault_ends_the_process_immediately() -> None:
    """A handler would return to the instruction that failed, again and again."""
    done = subprocess.run(
        [sys.executable, "-c", REAL_ERROR], capture_output=True, timeout=PATIENCE, check=False
    )
    assert (done.returncode, done.stdout) == (-signal.SIGSEGV, b"")
