"""The process that holds a line for the programs on it: how it begins, serves, dies and ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.limits import LINGERS
from tests.programs import (
    DRIVEPANEL,
    PATIENCE,
    Served,
    drivepanel,
    end_keepers,
    is_running,
    keepers,
    served,
    wait_until,
)
from tui.bus.share.keeping import can_start
from tui.drive.profile import library
from tui.session.connect.open_line import open_line
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.snapshot import Snapshot
from tui.simulator import DriveSpec, Simulation

from .terminal import Terminal
from .test_commands import bench, stands, turns
from .test_shared_programs import left_over, motor_run, on_record, runs_a_motor, stopped_by_commands

NOTHING = "/dev/null"


@pytest.fixture
def programs() -> Iterator[ExitStack]:
    """Programs that end with the test."""
    with ExitStack() as stack:
        yield stack


def keeper() -> int:
    """The one keeper of this test's lines."""
    (pid,) = keepers()
    return pid


def read(line: str) -> subprocess.CompletedProcess[str]:
    return drivepanel("read", line, "ETA", "-d", "1", "-p", "atv71")


def holders(path: str) -> list[int]:
    """Processes that have a port open, this one aside."""
    found = []
    for item in Path("/proc").glob("[0-9]*/fd/*"):
        try:
            pid = int(item.parts[2])
            if pid != os.getpid() and os.readlink(item) == os.path.realpath(path):
                found.append(pid)
        except OSError:
            continue
    return found


def times_of_good_values(recorder: Served, seconds: float) -> list[float]:
    """When a recorder printed good values, on the monotonic clock."""
    assert recorder.process.stdout is not None
    end, found = time.monotonic() + seconds, []
    while time.monotonic() < end:
        printed = json.loads(recorder.process.stdout.readline())
        if '"good"' in json.dumps(printed):
            found.append(time.monotonic())
    return found


def test_keeper_inherits_nothing_and_outlives_its_command() -> None:
    with bench() as (_, line):
        # the command substitution of a shell waits for every process with its output open
        assert read(line).returncode == 0
        pid = keeper()
        process = Path("/proc", str(pid))
        assert [os.readlink(process / "fd" / str(number)) for number in range(3)] == [NOTHING] * 3
        assert os.readlink(process / "cwd") == "/"
        assert os.getsid(pid) == pid
        assert b"-P\0-m\0tui.keeper\0" in (process / "cmdline").read_bytes()


def test_port_is_free_after_the_last_program_has_exited() -> None:
    with bench() as (_, line):
        port = line.removeprefix("serial:").partition(",")[0]
        assert read(line).returncode == 0
        pid = keeper()
        assert holders(port) == []
        # the process waits for the next program, which needs not start another
        assert read(line).returncode == 0
        assert keeper() == pid
        wait_until(lambda: not is_running(pid), "it ends", LINGERS + 20.0)
        assert left_over() == []


def test_another_program_opens_the_port_between_two_commands() -> None:
    with bench() as (_, line):
        assert read(line).returncode == 0
        alone = subprocess.run(
            [*DRIVEPANEL, "read", line, "ETA", "-d", "1", "-p", "atv71"],
            env={**os.environ, "DRIVEPANEL_STATE": os.environ["DRIVEPANEL_STATE"] + "2"},
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert alone.returncode == 0, alone.stderr


def test_other_line_settings_need_no_wait() -> None:
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        path = simulation.serve_pty()
        assert read(f"serial:{path},9600,8N1").returncode == 3
        before = keeper()
        assert read(f"serial:{path},19200,8N1").returncode == 0
        assert keeper() != before


def test_missing_port_is_reported_immediately() -> None:
    done = read("serial:/dev/ttyNONE0")
    assert done.returncode == 3
    assert "/dev/ttyNONE0 does not exist." in done.stderr
    assert "was not connected within" not in done.stderr


def test_port_in_use_is_reported_with_its_holder() -> None:
    with bench() as (_, line):
        path = line.removeprefix("serial:").partition(",")[0]
        with served([*DRIVEPANEL, "watch", line, "ETA", "-d", "1", "-p", "atv71"], ready="ETA"):
            other = subprocess.run(
                [*DRIVEPANEL, "read", f"serial:{path}", "ETA", "-d", "1", "-p", "atv71"],
                env={**os.environ, "DRIVEPANEL_STATE": os.environ["DRIVEPANEL_STATE"] + "2"},
                capture_output=True,
                text=True,
                timeout=PATIENCE,
                check=False,
            )
        assert other.returncode == 3
        assert "in use by drivepanel, the keeper of the line (pid" in other.stderr


def test_idle_keeper_exits_for_a_monitor() -> None:
    with bench() as (_, line):
        assert read(line).returncode == 0
        pid = keeper()
        done = drivepanel("listen", line, "--for", "1")
        assert "keeper" not in done.stderr, done.stderr
        wait_until(lambda: not is_running(pid), "it has ended")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_motor_runs_on_if_the_keeper_exits_but_not_its_program(
    programs: ExitStack, number: signal.Signals
) -> None:
    with motor_run(programs, "run") as (simulation, line, runner, recorder):
        before = keeper()
        os.kill(before, number)
        wait_until(lambda: keepers() not in ([], [before]), "another one is started")
        times_of_good_values(recorder, 3.0)
        assert turns(simulation)
        assert simulation.drive(1).fault is None
        assert runner.process.poll() is None
        # and any program can stop it
        assert drivepanel("stop", line, "-d", "1", "-p", "atv71").returncode == 0
        assert stopped_by_commands(simulation)
        assert runner.process.wait(PATIENCE) == 6


def test_motor_stops_if_its_program_dies_with_the_keeper(programs: ExitStack) -> None:
    with motor_run(programs, "watch") as (simulation, _, runner, recorder):
        os.kill(keeper(), signal.SIGSTOP)
        runner.process.kill()
        os.kill(keeper(), signal.SIGKILL)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
        wait_until(lambda: on_record() == [], "the record of the start goes")
        _, output = recorder.end()
        assert "has exited: its motor is stopped" in output


@pytest.mark.parametrize("others_live", [True, False])
def test_stop_to_a_frozen_keeper_is_sent_by_the_next(
    programs: ExitStack, others_live: bool
) -> None:
    with motor_run(programs, "watch") as (simulation, line, runner, recorder):
        frozen = keeper()
        os.kill(frozen, signal.SIGSTOP)
        if not others_live:
            runner.process.send_signal(signal.SIGSTOP)
            recorder.process.send_signal(signal.SIGSTOP)
        done = drivepanel("stop", line, "-d", "1", "-p", "atv71")
        assert done.returncode == 0, done.stderr
        assert stopped_by_commands(simulation)
        assert not is_running(frozen)


def test_programs_hold_the_line_after_three_keeper_deaths(programs: ExitStack) -> None:
    with motor_run(programs, "watch") as (simulation, _, _, recorder):
        for _ in range(3):
            wait_until(lambda: len(keepers()) == 1, "a keeper is there")
            times_of_good_values(recorder, 1.0)
            os.kill(keeper(), signal.SIGKILL)
        times_of_good_values(recorder, 4.0)
        assert keepers() == []
        assert turns(simulation)


def test_program_without_a_keeper_reports_it(
    terminal_with: Callable[[list[str]], Terminal],
) -> None:
    with bench() as (_, line):
        # where the lock of the line would lie
        state = Path(os.environ["DRIVEPANEL_STATE"])
        state.mkdir(exist_ok=True)
        (state / "lines").write_text("no folder")
        done = read(line)
        assert done.returncode == 0
        assert "holds the line itself, as its keeper has no folder" in done.stderr
        panel = terminal_with([*DRIVEPANEL, line])
        panel.wait_for("NO KEEPER")
        assert keepers() == []


def test_program_that_died_before_the_keeper_is_still_reported(
    programs: ExitStack, terminal_with: Callable[[list[str]], Terminal]
) -> None:
    """A person at the other panel has time to take the motor over; then the keeper dies, too."""
    with motor_run(programs, "run", time_out=50) as (simulation, line, runner, _):
        panel = terminal_with([*DRIVEPANEL, line, "-d", "1"])
        panel.wait_for("FORWARD")
        runner.process.kill()
        panel.wait_for("The motor is stopped in")
        os.kill(keeper(), signal.SIGKILL)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")


def test_motor_is_stopped_when_its_lost_line_returns(tmp_path: Path) -> None:
    with Simulation([DriveSpec("atv71", 1, sets={"SLL": 0})]) as simulation:
        line = f"serial:{simulation.serve_pty(str(tmp_path / 'line'))},19200,8N1"
        with served(runs_a_motor(line), ready="running forward") as runner:
            simulation.unplug()
            runner.process.kill()
            time.sleep(2.0)
            assert turns(simulation)
            simulation.replug()
            wait_until(lambda: stands(simulation), "the motor stops")


def test_programs_hold_the_line_if_no_keeper_can_listen(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "file"))
    (tmp_path / "file").touch()
    (tmp_path / "state").mkdir(exist_ok=True)
    (tmp_path / "state" / "run").touch()
    with bench() as (_, line):
        done = read(line)
        assert done.returncode == 0, done.stderr
        wait_until(lambda: keepers() == [], "no keeper stays")


def test_keeper_resolves_paths_relative_to_the_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DRIVEPANEL_STATE", "own state")
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        simulation.serve_pty(str(tmp_path / "line"))
        with served(runs_a_motor("serial:./line,19200,8N1"), ready="running forward") as runner:
            wait_until(lambda: turns(simulation), "the motor turns")
            runner.process.kill()
            wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
    end_keepers()


@pytest.mark.usefixtures("with_keepers")
def test_port_is_free_once_a_line_is_closed() -> None:
    with bench() as (_, line):
        for _ in range(5):
            opened = open_line(line, wait=PATIENCE, program="panel")
            assert holders(line.removeprefix("serial:").partition(",")[0]) == [keeper()]
            opened.close()
            assert holders(line.removeprefix("serial:").partition(",")[0]) == []
            other = open_line(line.replace("19200", "9600"), wait=PATIENCE, program="panel")
            assert "9600" not in other.line.state.reason, "it is open as it was meant"
            other.close()


SCRIPT = """
import sys
from tui.session.api import open_drives

with open_drives(sys.argv[1]) as line:
    print(line.drive(profile="atv71").read("ETA")["ETA"].raw, flush=True)
    sys.stdin.read()
"""


def test_line_of_a_script_is_held_by_a_keeper(programs: ExitStack) -> None:
    with bench() as (_, line):
        script = [sys.executable, "-c", SCRIPT, line]
        started = served(script, ready="\n", stdin=subprocess.PIPE)
        script_process = programs.enter_context(started).process
        assert holders(line.removeprefix("serial:").partition(",")[0]) == [keeper()]
        # it is frozen, and no program waits for it
        script_process.send_signal(signal.SIGSTOP)
        done = read(line)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("executable", ["/usr/bin/qgis", "", None])
def test_embedded_python_starts_no_keeper(
    monkeypatch: pytest.MonkeyPatch, executable: str | None
) -> None:
    assert can_start()
    monkeypatch.setattr(sys, "executable", executable)
    assert not can_start()


def test_next_program_gets_the_trend_of_a_killed_one() -> None:
    with bench() as (_, line):
        command = [*DRIVEPANEL, "watch", line, "-d", "1", "-p", "atv71", "--every", "0.2", "--json"]
        with served(command) as recorder:
            begun = times_of_good_values(recorder, 6.0)[0]
            recorder.process.kill()
        opened = open_line(line, wait=PATIENCE, program="panel")
        try:
            monitor = Monitor(DriveSession(opened.line, 1, library.load("atv71")))
            monitor.start()
            wait_until(lambda: bool(monitor.trend), "a cycle")
            wait_until(lambda: monitor.trend[0].time < begun + 1.0, "the trend from before")
            # but for the last points before it was killed
            assert len([point for point in monitor.trend if point.time < begun + 4.0]) >= 10
        finally:
            opened.close()


@pytest.mark.usefixtures("with_keepers")
def test_next_keeper_polls_for_programs_of_a_killed_keeper() -> None:
    with bench() as (_, line):
        opened = open_line(line, wait=PATIENCE, program="panel")
        try:
            monitor = Monitor(DriveSession(opened.line, 1, library.load("atv71")))
            times: list[float] = []

            def note(snapshot: Snapshot) -> None:
                if monitor.steady.received is not None and not snapshot.error:
                    times.append(snapshot.readings["ETA"].time)

            monitor.listen(note)
            monitor.start(period=0.1)
            wait_until(lambda: len(times) > 3, "cycles that the keeper has read")
            first = keeper()
            os.kill(first, signal.SIGKILL)
            wait_until(lambda: not is_running(first), "it has ended")
            ended = time.monotonic()
            wait_until(lambda: times[-1] > ended, "a cycle of the next keeper")
            assert keeper() != first
        finally:
            opened.close()


DIES = """
import os, signal, sys, time
from tui.drive.profile import library
from tui.session.connect.open_line import open_line
from tui.session.drive import DriveSession

opened = open_line(sys.argv[1], wait=20, program="run")
drive = DriveSession(opened.line, 1, library.load("atv71"))
drive.arming.arm()
time.sleep(0.5)
if sys.argv[2] == "stop":
    opened.line.facts.give_stop([1], "the stop key")
    time.sleep(0.5)
os.kill(os.getpid(), signal.SIGKILL)
"""
"""A program that ends when it has given a stop, and has sent no word of it; or before."""


@pytest.mark.parametrize("gives", ["stop", "nothing"])
def test_stop_is_carried_out_if_its_program_exits_before_the_write(gives: str) -> None:
    with Simulation([DriveSpec("atv71", 1, run_hz=30.0, sets={"SLL": 0})]) as simulation:
        line = f"serial:{simulation.serve_pty()},19200,8N1"
        subprocess.run([sys.executable, "-c", DIES, line, gives], check=False, timeout=PATIENCE)
        if gives == "stop":
            wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
            entries = json.loads(drivepanel("journal", "--json").stdout)
            assert "CMD" in [entry["code"] for entry in entries["entries"]]
        else:
            time.sleep(3.0)
            assert turns(simulation), "nobody has stopped it"
