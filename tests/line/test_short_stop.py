"""The short way of `drivepanel stop` to the keeper of a line, as a person types it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path

import pytest

from tests.line_events import on_event
from tests.programs import DRIVEPANEL, PATIENCE, drivepanel, keepers, served, wait_until
from tui.bus.line_events import DevicesStopped
from tui.bus.program import Program
from tui.bus.shared_state import SharedState
from tui.drive.profile import library
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.drive import DriveSession
from tui.simulator import DriveSpec

from .test_commands import bench, turns
from .test_keeper import holders, times_of_good_values
from .test_shared_programs import motor_run, records, runs_a_motor, stopped_by_commands

WITHOUT_IMPORTS = """
import sys
sys.modules.update(dict.fromkeys(["click", "msgspec", "asyncio", "tui.cli.shared"]))
sys.argv = ["drivepanel", *sys.argv[1:]]
from tui.__main__ import main
main()
"""
"""The program with no working import."""
SLOW_TO_START = """
import sys, time
from tui.cli.short_stop import stop_at_once
stop_at_once(sys.argv[1:])
while not sys.stdin.readline():
    time.sleep(0.1)
from tui.cli.main import main
main()
"""
"""The program on a slow computer: its imports begin with a line on standard input."""


@pytest.fixture
def panel(with_keepers: None) -> Iterator[OpenLine]:
    """A program that is attached to the keeper of a line."""
    with bench() as (_, line), closing(open_line(line, wait=PATIENCE, program="panel")) as opened:
        assert len(keepers()) == 1
        yield opened


def stops_received(facts: SharedState) -> list[tuple[tuple[int, ...], Program, bool]]:
    """Later stops by others: their devices, their program, and True if it is attached."""
    heard: list[tuple[tuple[int, ...], Program, bool]] = []

    def hear(event: DevicesStopped) -> None:
        heard.append((event.devices, event.program, event.program in facts.programs))

    on_event(facts, DevicesStopped, hear)
    return heard


def test_stop_reaches_the_keeper_before_anything_is_imported(panel: OpenLine) -> None:
    heard = stops_received(panel.line.facts)
    command = [sys.executable, "-c", WITHOUT_IMPORTS, "stop", panel.text, "-d", "1", "-d", "3"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert "ModuleNotFoundError" in done.stderr
    wait_until(lambda: bool(heard), "the stop is heard")
    ((devices, program, attached),) = heard
    assert devices == (1, 3)
    assert program.name == "stop"
    assert not attached


def test_stop_is_carried_out_by_the_keeper() -> None:
    with ExitStack() as programs, motor_run(programs, "watch") as (simulation, line, runner, _):
        command = [sys.executable, "-c", WITHOUT_IMPORTS, "stop", line, "-d", "1"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
        assert "ModuleNotFoundError" in done.stderr
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
        assert runner.process.wait(PATIENCE) == 6


def test_stop_all_is_carried_out_by_the_keeper() -> None:
    with ExitStack() as programs, motor_run(programs, "watch") as (simulation, line, _, _):
        command = [sys.executable, "-c", WITHOUT_IMPORTS, "stop", line, "--all"]
        subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")


def test_stop_after_a_short_stop_is_carried_out_and_reported_normally(panel: OpenLine) -> None:
    heard = stops_received(panel.line.facts)
    done = drivepanel("stop", panel.text, "-d", "1", "-p", "atv71")
    assert done.returncode == 0, done.stderr
    assert "Altivar 71: stopped." in done.stdout
    assert [devices for devices, *_ in heard] == [(1,)] * len(heard)
    assert heard[0][1].pid == heard[-1][1].pid
    assert heard[0][1].id != heard[-1][1].id
    assert [attached for *_, attached in heard[:2]] == [False, True]


def test_slow_command_knows_the_family_of_a_motor_that_its_short_stop_has_stopped() -> None:
    """The keeper had removed the record of the start: the stopped motor was called NOT STOPPED."""
    with bench(DriveSpec("proxidrive", 1, sets={"6.43": 1})) as (simulation, line):
        until = ("--for", "2", "--leave-running")
        started = drivepanel("run", line, "-p", "proxidrive", "--arm", *until)
        assert turns(simulation), started.stderr
        starts = Path(os.environ["DRIVEPANEL_STATE"], "starts")
        assert list(starts.glob("*.json"))
        pipe = subprocess.PIPE
        with subprocess.Popen(
            [sys.executable, "-c", SLOW_TO_START, "stop", line],
            stdin=pipe, stdout=pipe, stderr=pipe, text=True,
        ) as command:  # fmt: skip
            wait_until(lambda: not list(starts.glob("*.json")), "the keeper has removed the record")
            output, error = command.communicate("begin\n", timeout=PATIENCE)
    assert "Device 1, Proxidrive: stopped." in output
    assert (command.returncode, "NOT STOPPED" in error) == (0, False)


def test_other_kinds_of_stop_are_not_short_stops(panel: OpenLine) -> None:
    heard = stops_received(panel.line.facts)
    for words in (["--quick"], ["--read-only"], ["--all", "--addresses", "1-2"]):
        command = [sys.executable, "-c", WITHOUT_IMPORTS, "stop", panel.text, *words]
        subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
    assert drivepanel("stop", panel.text, "-p", "atv71").returncode == 0
    assert {devices for devices, *_ in heard} == {(1,)}


def test_short_stop_on_an_unused_line_starts_no_keeper() -> None:
    with bench() as (_, line):
        done = drivepanel("stop", line, "-p", "atv71")
        assert done.returncode == 0, done.stderr
        assert keepers() == []


def test_program_started_during_a_stop_continues_with_a_keeper() -> None:
    slow = DriveSpec("atv71", 1, sets={"DEC": 1000}, run_hz=40)
    with bench(slow) as (simulation, line):
        command = [*DRIVEPANEL, "stop", line, "-p", "atv71"]
        with (
            served(command, ready="sent first") as stopping,
            served(records(line), ready="{") as recorder,
        ):
            assert stopping.process.poll() is None, "it follows the motor to standstill"
            assert keepers() == []
            simulation.drive(1).set("DEC", 1)
            assert stopping.process.wait(PATIENCE) == 0
            wait_until(lambda: len(keepers()) == 1, "a keeper holds the line")
            assert times_of_good_values(recorder, 3.0)


def test_stop_is_carried_out_by_a_keeper_whose_port_is_closed() -> None:
    """It waits for the next program, and the motor was left running on purpose."""
    with bench(DriveSpec("atv71", 1, sets={"SLL": 0})) as (simulation, line):
        with served(runs_a_motor(line, "--leave-running"), ready="running forward") as runner:
            wait_until(lambda: turns(simulation), "the motor turns")
            runner.process.kill()
        port = line.removeprefix("serial:").partition(",")[0]
        wait_until(lambda: holders(port) == [], "the port is closed")
        command = [sys.executable, "-c", WITHOUT_IMPORTS, "stop", line, "-d", "1"]
        subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")


@pytest.mark.usefixtures("with_keepers")
def test_next_keeper_stops_a_motor_whose_arming_has_ended() -> None:
    with (
        bench(DriveSpec("atv71", 1, sets={"TTO": 300})) as (simulation, line),
        closing(open_line(line, wait=PATIENCE, program="panel")) as opened,
    ):
        session = DriveSession(opened.line, 1, library.load("atv71"))
        session.arming.arm()
        session.arming.disarm()
        simulation.drive(1).run(20.0)
        wait_until(lambda: turns(simulation), "the motor turns")
        (before,) = keepers()
        os.kill(before, signal.SIGKILL)
        programs = partial(getattr, opened.line.facts, "programs")
        wait_until(lambda: programs()[0].pid in {*keepers()} - {before}, "the panel is attached")
        command = [sys.executable, "-c", WITHOUT_IMPORTS, "stop", line, "-d", "1"]
        subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops", 10.0)
