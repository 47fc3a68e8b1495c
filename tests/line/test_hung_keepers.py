"""Keepers that hang: they end themselves, or are ended by a program on the line."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.limits import ALARM_AFTER, HEARD_WITHIN, STOP_HEARD_WITHIN
from tests.programs import DRIVEPANEL, PATIENCE, Served, is_running, keepers, served, wait_until
from tui.session.connect.open_line import open_line
from tui.simulator import DriveSpec, Simulation

from .pty_panel import STOP, panel_beside, panel_on_a_pty
from .test_commands import bench, turns
from .test_keeper import keeper, times_of_good_values
from .test_shared_programs import one_connection, records, runs_a_motor, stopped_by_commands


@pytest.fixture
def programs() -> Iterator[ExitStack]:
    """Programs that end with the test."""
    with ExitStack() as stack:
        yield stack


def test_resumed_frozen_keeper_exits() -> None:
    with bench() as (_, line):
        # also where the program that starts it ignores the alarm
        ignoring = ("sh", "-c", "trap '' ALRM; exec \"$@\"", "sh", *DRIVEPANEL)
        command = [*ignoring, "read", line, "ETA", "-d", "1", "-p", "atv71"]
        subprocess.run(command, timeout=PATIENCE, check=True)
        pid = keeper()
        os.kill(pid, signal.SIGSTOP)
        time.sleep(ALARM_AFTER + 0.5)
        assert is_running(pid), "a process that is stopped takes no alarm"
        os.kill(pid, signal.SIGCONT)
        wait_until(lambda: not is_running(pid), "it ends")
        # by the alarm: a resumed keeper would remove its socket at its end
        assert list(Path(os.environ["DRIVEPANEL_STATE"]).rglob("*.sock"))


@contextmanager
def frozen_keeper(programs: ExitStack, line: str) -> Iterator[tuple[int, Served, Served]]:
    """A keeper that is frozen while a motor runs; with `run`, and a recorder."""
    recorder = programs.enter_context(served(records(line), ready="{"))
    runner = programs.enter_context(served(runs_a_motor(line), ready="running forward"))
    pid = keeper()
    os.kill(pid, signal.SIGSTOP)
    yield pid, runner, recorder


def gateway(programs: ExitStack) -> tuple[Simulation, str]:
    """A drive behind a gateway with one connection: no stop can bypass its holder."""
    drive = DriveSpec("atv71", 1, sets={"TTO": 300})
    simulation = programs.enter_context(Simulation([drive]))
    return simulation, programs.enter_context(one_connection(simulation.serve_tcp(), "wait"))


def test_stop_replaces_a_frozen_keeper(programs: ExitStack) -> None:
    simulation, line = gateway(programs)
    with frozen_keeper(programs, line) as (frozen, runner, recorder):
        status, errors = runner.end(signal.SIGINT)
        assert status == 0, errors
        assert stopped_by_commands(simulation)
        assert not is_running(frozen)
        wait_until(lambda: keepers() not in ([], [frozen]), "another one is started")
        times_of_good_values(recorder, 1.0)


def test_frozen_keeper_is_replaced_without_a_stop(programs: ExitStack) -> None:
    simulation, line = gateway(programs)
    with frozen_keeper(programs, line) as (frozen, runner, recorder):
        wait_until(lambda: not is_running(frozen), "it is killed")
        assert len(times_of_good_values(recorder, 5.0)) > 1
        assert turns(simulation)
        assert simulation.drive(1).fault is None
        assert runner.process.poll() is None


def test_program_that_was_frozen_kills_no_keeper(programs: ExitStack) -> None:
    with bench() as (_, line):
        recorder = programs.enter_context(served(records(line), ready="{"))
        pid = keeper()
        for _ in range(3):
            recorder.process.send_signal(signal.SIGSTOP)
            time.sleep(HEARD_WITHIN + 1.0)
            recorder.process.send_signal(signal.SIGCONT)
            times_of_good_values(recorder, 1.5)
        assert keepers() == [pid]


@pytest.mark.usefixtures("with_keepers")
def test_healthy_keeper_is_kept_after_stops() -> None:
    with bench() as (_, line):
        opened = open_line(line, wait=PATIENCE, program="panel")
        try:
            pid = keeper()
            for _ in range(3):
                opened.line.facts.give_stop([1], "the stop key")
                time.sleep(STOP_HEARD_WITHIN)
            assert keepers() == [pid]
        finally:
            opened.close()


@pytest.mark.usefixtures("with_keepers")
@pytest.mark.parametrize("kills", [True, False])
def test_stop_of_all_stops_the_motor_of_an_absent_panel(*, kills: bool) -> None:
    with panel_on_a_pty(drives=2) as panel, panel_beside(panel, device=2) as other:
        panel.run(20)
        other.shows("2 MACHINE")
        before = len(panel.log.writes)
        if kills:
            os.kill(panel.pid, signal.SIGKILL)
            other.shows("Drive 1: The motor is stopped in")
        else:
            # the next keeper learns of the motor by the record of its start alone
            os.kill(panel.pid, signal.SIGSTOP)
            os.kill(keeper(), signal.SIGSTOP)
        began = time.monotonic()
        other.type("\x1b[20~")
        wait_until(lambda: other.look() and STOP in panel.log.writes[before:], "the stop")
        at = panel.log.times[panel.log.writes.index(STOP, before)]
        # long before a panel's time to take the motor over, or the drive's timeout, is over
        assert at - began < 6.0
        wait_until(lambda: not turns(panel.simulation), "the motor stops")
