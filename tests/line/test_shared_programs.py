"""Programs that share a line, as separate processes: killed, frozen, disconnected."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from tests.programs import (
    DRIVEPANEL,
    PATIENCE,
    Served,
    drivepanel,
    end_keepers,
    is_running,
    served,
    wait_until,
)
from tui.bus.program import Program
from tui.bus.share.messages import VERSION, Hello, packed
from tui.bus.share.place import short_path
from tui.simulator import DriveSpec, Simulation

from .terminal import Terminal
from .test_commands import bench, stands, turns
from .test_ways_to_end import Running
from .test_ways_to_end import running as panel_running

Start = Callable[[list[str]], Terminal]


@pytest.fixture
def programs() -> Iterator[ExitStack]:
    """Programs that end with the test."""
    with ExitStack() as stack:
        yield stack


def runs_a_motor(line: str, *extra: str, device: int = 1) -> list[str]:
    reference = ("--reference", "20Hz", "--arm", "-p", "atv71", "-d", str(device))
    return [*DRIVEPANEL, "run", line, *reference, *extra]


def records(line: str, device: int = 1) -> list[str]:
    more = ("-p", "atv71", "-d", str(device), "--every", "0.2", "--json")
    return [*DRIVEPANEL, "watch", line, "RFR", *more]


def left_over() -> list[str]:
    """Sockets and notes of stops in the state folder once its keepers have ended."""
    end_keepers()
    state = Path(os.environ["DRIVEPANEL_STATE"])
    return [path.name for path in state.rglob("*.s*") if path.suffix in (".sock", ".stop")]


def stopped_by_commands(simulation: Simulation, device: int = 1) -> bool:
    """True if the motor is at standstill without a trip: it was stopped by a command."""
    return stands(simulation, device) and simulation.drive(device).fault is None


@contextmanager
def motor_run(
    programs: ExitStack, first: str, *extra: str, time_out: int = 100
) -> Iterator[tuple[Simulation, str, Served, Served]]:
    """`run` and a recorder on one line, whichever is the `first` and owns it.

    `time_out` is that of the drive, in 0.1 s.
    """
    with bench(DriveSpec("atv71", 1, sets={"TTO": time_out})) as (simulation, line):
        recorder = None
        if first == "watch":
            recorder = programs.enter_context(served(records(line), ready="{"))
        runner = programs.enter_context(served(runs_a_motor(line, *extra), ready="running forward"))
        if recorder is None:
            recorder = programs.enter_context(served(records(line), ready="{"))
        wait_until(lambda: turns(simulation), "the motor turns")
        yield simulation, line, runner, recorder


@pytest.mark.usefixtures("holder")
@pytest.mark.parametrize("first", ["watch", "run"])
def test_motor_of_a_killed_program_is_stopped_by_the_remaining_one(
    programs: ExitStack, first: str
) -> None:
    """A recorder keeps polling the drive: its own timeout would never stop the motor."""
    with motor_run(programs, first) as (simulation, _, runner, recorder):
        runner.process.kill()
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
        starts = Path(os.environ["DRIVEPANEL_STATE"], "starts")
        wait_until(lambda: not list(starts.iterdir()), "the record of the start goes")
        _, output = recorder.end()
        assert "has exited: its motor is stopped" in output
        assert left_over() == []


@pytest.mark.usefixtures("holder")
@pytest.mark.parametrize("first", ["watch", "run"])
def test_motor_left_running_on_purpose_keeps_running(programs: ExitStack, first: str) -> None:
    with motor_run(programs, first, "--leave-running") as (simulation, _, runner, recorder):
        runner.process.kill()
        time.sleep(3)
        assert turns(simulation)
        assert recorder.process.poll() is None


NAMED = pytest.mark.parametrize(
    "named", [("-d", "1", "-p", "atv71"), ("-d", "1"), ("--all", "--addresses", "1")]
)


@NAMED
def test_stop_of_the_motor_of_a_frozen_program_lasts(
    programs: ExitStack, named: tuple[str, ...]
) -> None:
    with motor_run(programs, "run") as (simulation, line, runner, _):
        runner.process.send_signal(signal.SIGSTOP)
        done = drivepanel("stop", line, *named)
        assert done.returncode == 0, done.stderr
        assert stopped_by_commands(simulation)
        before = simulation.drive(1).raw("CMD")
        resumes_stopped(simulation, runner)
        assert simulation.drive(1).raw("CMD") == before


def resumes_stopped(simulation: Simulation, runner: Served) -> None:
    """A frozen `run` resumes, learns that its motor was stopped, and sends only stops."""
    runner.process.send_signal(signal.SIGCONT)
    output, _ = runner.process.communicate(timeout=PATIENCE)
    # it learns of the stop when it resumes, or their number if it was disconnected
    by = ("drivepanel stop, stop", "a stop while this program was suspended")
    assert any(f"was stopped by {text}" in output for text in by)
    assert runner.process.returncode == 6
    assert stopped_by_commands(simulation)


@pytest.mark.parametrize("count", [2**32 - 1, 2**63 - 1, 2**64 - 1])
def test_stop_after_a_malformed_greeting_stops_the_motor(programs: ExitStack, count: int) -> None:
    with motor_run(programs, "run") as (simulation, line, runner, recorder):
        (path,) = Path(os.environ["DRIVEPANEL_STATE"]).rglob("*.sock")
        stops = {1: {"stranger": count, "": count}}
        hello = packed(Hello(VERSION, Program("stranger", "stranger", 1), line, stops))
        with socket.socket(socket.AF_UNIX) as connection, short_path(path) as address:
            connection.connect(address)
            connection.sendall(hello)
            connection.recv(4096)
        done = drivepanel("stop", line, "-d", "1", "-p", "atv71")
        assert done.returncode == 0, done.stderr
        assert stopped_by_commands(simulation)
        assert "was stopped by drivepanel stop, stop" in runner.process.communicate(timeout=60)[0]
        assert recorder.process.poll() is None


def test_recorder_does_not_keep_the_motor_of_a_frozen_program_alive_forever(
    programs: ExitStack, holder: str
) -> None:
    """Its socket stays open, its process lives: only its silence shows it."""
    with motor_run(programs, "watch", time_out=50) as (simulation, _, runner, recorder):
        runner.process.send_signal(signal.SIGSTOP)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops on its ramp")
        before = simulation.drive(1).raw("CMD")
        runner.process.send_signal(signal.SIGCONT)
        output, _ = runner.process.communicate(timeout=PATIENCE)
        assert runner.process.returncode == 6
        by = {"keeper": "keeper", "inside": "watch"}[holder]
        assert f"It was stopped by a stop while this program was suspended, {by} (pid" in output
        assert simulation.drive(1).raw("CMD") == before
        assert recorder.process.stdout is not None
        for _ in range(3):
            assert '"RFR"' in recorder.process.stdout.readline()
        _, reported = recorder.end()
        gone = f"run (pid {runner.process.pid}) is no longer on the line"
        assert f"{gone}: its motor is stopped." in reported
        assert left_over() == []


def test_motor_of_a_frozen_program_is_taken_over_by_a_key(
    programs: ExitStack, terminal_with: Start
) -> None:
    with motor_run(programs, "watch", time_out=300) as (simulation, line, runner, _):
        panel = terminal_with([sys.executable, "-m", "tui", line, "-d", "1"])
        panel.wait_for("FORWARD")
        runner.process.send_signal(signal.SIGSTOP)
        panel.wait_for("T takes it over")
        panel.press("a")
        wait_until(lambda: "ARMED" in panel.text().replace("NOT ARMED", ""), "it is armed")
        panel.press("T")
        wait_until(lambda: "aken over" in panel.text(), "it is taken over")
        before = simulation.drive(1).raw("CMD")
        # it resumes with a drive of another commander, and its motor runs on
        runner.process.send_signal(signal.SIGCONT)
        panel.wait_for("The line is shared with run")
        time.sleep(3)
        assert simulation.drive(1).raw("CMD") == before
        assert turns(simulation)
        panel.press("Space")
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")


@contextmanager
def one_connection(target: tuple[str, int], others: str) -> Iterator[str]:
    """A gateway that serves one connection at a time; `others` wait, or are disconnected."""
    free = threading.Semaphore()

    def carry(source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(4096):
                sink.sendall(data)
        for item in (source, sink):
            with suppress(OSError):
                item.shutdown(socket.SHUT_RDWR)

    def serve(client: socket.socket) -> None:
        if free.acquire(blocking=others == "wait"):
            with client, socket.create_connection(target) as server:
                threading.Thread(target=carry, args=(server, client), daemon=True).start()
                carry(client, server)
            free.release()
        client.close()

    def accept() -> None:
        with suppress(OSError):
            while True:
                client, _ = listener.accept()
                threading.Thread(target=serve, args=(client,), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=accept, daemon=True).start()
        yield f"tcp:127.0.0.1:{listener.getsockname()[1]},timeout=1"
        listener.shutdown(socket.SHUT_RDWR)


@pytest.mark.usefixtures("held_inside")
@NAMED
@pytest.mark.parametrize("number", [signal.SIGCONT, signal.SIGKILL])
def test_stop_delayed_by_a_frozen_owner_is_reported_and_carried_out(
    programs: ExitStack, named: tuple[str, ...], number: signal.Signals
) -> None:
    with motor_run(programs, "run") as (simulation, line, runner, recorder):
        pid = runner.process.pid
        runner.process.send_signal(signal.SIGSTOP)
        done = drivepanel("stop", line, *named)
        assert done.returncode == 3, done.stderr
        assert "NOT STOPPED" in done.stderr
        what = (
            f"run (pid {pid}) owns the line and does not answer. End that program (kill -9 {pid})"
        )
        assert what in done.stderr
        if number is signal.SIGCONT:
            resumes_stopped(simulation, runner)
        else:
            runner.process.kill()
            wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
            wait_until(lambda: on_record() == [], "the recorder has looked after it")
        recorder.end()
        assert left_over() == []


@pytest.mark.usefixtures("held_inside")
def test_motor_of_a_frozen_owner_is_not_kept_alive(programs: ExitStack) -> None:
    """The drive's own timeout stops it, as on an unshared line."""
    with motor_run(programs, "run", time_out=20) as (simulation, _, runner, recorder):
        runner.process.send_signal(signal.SIGSTOP)
        wait_until(lambda: simulation.drive(1).fault is not None, "the drive's own timeout")
        wait_until(lambda: stands(simulation), "the motor stops")
        runner.process.send_signal(signal.SIGCONT)
        runner.process.communicate(timeout=PATIENCE)
        assert runner.process.returncode == 4
        recorder.end()
        assert left_over() == []


@pytest.mark.usefixtures("holder")
def test_stop_beside_run_ends_it_and_names_the_program(programs: ExitStack) -> None:
    with motor_run(programs, "run") as (simulation, line, runner, recorder):
        assert drivepanel("stop", line, "-d", "1", "-p", "atv71").returncode == 0
        assert stopped_by_commands(simulation)
        output, _ = runner.process.communicate(timeout=PATIENCE)
        assert runner.process.returncode == 6
        assert "was stopped by drivepanel stop, stop" in output
        # the owner exited, the recorder continues
        assert recorder.process.stdout is not None
        for _ in range(3):
            assert '"RFR"' in recorder.process.stdout.readline()
        status, output = recorder.end()
        assert status == 128 + signal.SIGTERM
        # it may say, too, what the drive does now that the recorder asks it no more
        assert output.startswith(f"drivepanel: Shared with run (pid {runner.process.pid}).\n")
        assert left_over() == []


def test_drive_commanded_by_run_refuses_other_commands(
    programs: ExitStack,
) -> None:
    with motor_run(programs, "run") as (simulation, line, runner, _):
        requested = ("run", line, "--reference", "5Hz", "--arm", "-p", "atv71", "-d", "1")
        done = drivepanel(*requested)
        assert done.returncode == 5
        assert f"Drive 1 is commanded by run (pid {runner.process.pid})" in done.stderr
        assert turns(simulation)
        assert drivepanel("read", line, "RFR", "-d", "1", "-p", "atv71").returncode == 0


# A panel and a recorder


@contextmanager
def panel_run(
    programs: ExitStack, terminal_with: Start, *options: str
) -> Iterator[tuple[Running, Served]]:
    """A panel whose motor turns, and a recorder attached to it."""
    with panel_running(terminal_with, *options) as made:
        recorder = programs.enter_context(served(records(made.line), ready="{"))
        yield made, recorder


def on_record() -> list[bool]:
    """For each recorded start, True if its motor is to be left running."""
    found = []
    for path in Path(os.environ["DRIVEPANEL_STATE"], "starts").glob("*.json"):
        with suppress(FileNotFoundError):  # taken away since it was listed
            found.append(json.loads(path.read_text())["left_running"])
    return found


@pytest.mark.usefixtures("holder")
@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGKILL])
def test_hangup_choice_applies_to_every_loss_of_the_panel(
    programs: ExitStack, terminal_with: Start, number: signal.Signals
) -> None:
    """The recorder takes the line over, keeps the drive alive, and leaves the motor running."""
    with panel_run(programs, terminal_with, "--on-hangup", "leave-running") as (made, recorder):
        assert on_record() == [True]
        os.kill(made.pid, number)
        made.ended()
        assert recorder.process.stdout is not None
        before = made.simulation.drive(1).raw("CMD")
        for _ in range(20):  # 4 s of the recorder's
            assert '"RFR"' in recorder.process.stdout.readline()
        assert made.speed > 2
        assert made.simulation.drive(1).raw("CMD") == before
        assert on_record() == [True]
        status, output = recorder.end()
        assert status == 128 + signal.SIGTERM
        assert "its motor is stopped" not in output
        assert left_over() == []


@pytest.mark.usefixtures("holder")
def test_motor_of_a_killed_panel_is_stopped_by_default(
    programs: ExitStack, terminal_with: Start
) -> None:
    with panel_run(programs, terminal_with) as (made, recorder):
        assert on_record() == [False]
        os.kill(made.pid, signal.SIGKILL)
        made.stopped()
        assert made.simulation.drive(1).fault is None
        wait_until(lambda: on_record() == [], "the record of the start goes")
        _, output = recorder.end()
        assert "has exited: its motor is stopped" in output
        assert left_over() == []


# Two panels


def test_stop_in_one_panel_stops_the_motor_of_the_other(
    terminal_with: Start, second_terminal: Start
) -> None:
    with panel_running(terminal_with) as made:
        other = second_terminal([sys.executable, "-m", "tui", made.line, "-d", "1"])
        other.wait_for("FORWARD")
        made.terminal.wait_for("FORWARD")
        other.press("F12")
        made.stopped()
        made.terminal.wait_for("STANDBY", "Stop from panel")
        other.wait_for("STANDBY")
        assert is_running(made.pid)


@pytest.mark.usefixtures("holder")
def test_stop_of_all_drives_reaches_the_drive_of_another_panel(
    terminal_with: Start, second_terminal: Start
) -> None:
    with panel_running(terminal_with) as made:
        other = second_terminal([sys.executable, "-m", "tui", made.line, "-d", "2"])
        other.wait_for("No drive answered")
        other.press("F9")
        made.stopped()
        made.terminal.wait_for("STANDBY", "The motor is stopped")
        other.wait_for("Drive 1: The motor is stopped")


@pytest.mark.usefixtures("holder")
@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGKILL])
def test_exiting_panel_stops_its_motor_and_the_other_panel_continues(
    terminal_with: Start, second_terminal: Start, number: signal.Signals
) -> None:
    with panel_running(terminal_with) as made:
        # the drive's own watch would act after 300 s: the other panel waits for a key 10 s
        other = second_terminal([sys.executable, "-m", "tui", made.line, "-d", "1"])
        other.wait_for("FORWARD")
        os.kill(made.pid, number)
        made.ended()
        made.stopped()
        other.wait_for("STANDBY")
        assert made.simulation.drive(1).fault is None
        made.simulation.drive(1).run(30.0)
        other.wait_for("FORWARD")


@pytest.mark.usefixtures("holder")
@pytest.mark.parametrize("first", ["alone", "watch"])
def test_late_command_is_refused_after_a_stop(programs: ExitStack, first: str) -> None:
    """On a machine that swaps a stop typed last may be through before the run is on the line."""
    with bench() as (simulation, line):
        if first == "watch":
            programs.enter_context(served(records(line), ready="{"))
        slow = subprocess.Popen(
            runs_a_motor(line), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        programs.callback(slow.kill)
        slow.send_signal(signal.SIGSTOP)
        done = drivepanel("stop", line, "-p", "atv71")
        assert done.returncode == 0, done.stderr
        before = simulation.drive(1).raw("CMD")
        slow.send_signal(signal.SIGCONT)
        _, output = slow.communicate(timeout=PATIENCE)
        assert slow.returncode == 5
        assert "Device 1: it was stopped after this command was typed" in output
        assert simulation.drive(1).raw("CMD") == before
        # the next one is typed after the stop
        assert drivepanel("reference", line, "20", "-p", "atv71", "--arm").returncode == 0
