"""Commands that move motors: run, reference, reset, stop and status, as separate processes.

The simulator is in the process of the test, which can check the motor directly.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from tests.programs import (
    DRIVEPANEL,
    PATIENCE,
    Served,
    drivepanel,
    end_keepers,
    served,
    simulated,
    wait_until,
)
from tui.bus.api import ModbusLine
from tui.bus.errors import LineLost
from tui.cli.main import main
from tui.drive.profile import library
from tui.simulator import DriveSpec, Simulation
from tui.simulator.troubles import FaultRates

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
ALTIVARS = ["atv21", "atv31", "atv312", "atv71"]
"""Families that take a reference in Hz."""


@contextmanager
def bench(*specs: DriveSpec) -> Iterator[tuple[Simulation, str]]:
    """Simulated drives and the LINE to them (default: an Altivar 71 at address 1)."""
    with Simulation(list(specs) or [DriveSpec("atv71", 1)]) as simulation:
        yield simulation, f"serial:{simulation.serve_pty()},19200,8N1"


@contextmanager
def running(line: str, *extra: str) -> Iterator[Served]:
    """`run` at work, begun once the motor was said to run."""
    command = (*DRIVEPANEL, "run", line, "--reference", "20Hz", "--arm", *extra)
    with served(command, ready="running forward") as program:
        yield program


def turns(simulation: Simulation, device: int = 1) -> bool:
    return abs(simulation.drive(device).motor.frequency) > 3


def stands(simulation: Simulation, device: int = 1) -> bool:
    return simulation.drive(device).motor.frequency == 0


def besides(output: str) -> str:
    """Standard error without the warning about the communication timeout."""
    reported = ("communication timeout", "To keep polling it: drivepanel hold")
    return "".join(line for line in output.splitlines(True) if not any(t in line for t in reported))


# run: its ends


@pytest.mark.parametrize("ending", SIGNALS)
def test_signal_stops_the_motor_on_its_ramp(ending: signal.Signals) -> None:
    with bench() as (simulation, line), running(line) as program:
        wait_until(lambda: turns(simulation), "the motor turns")
        program.process.send_signal(ending)
        output, error = program.process.communicate(timeout=PATIENCE)
        assert (program.process.returncode, besides(error)) == (0, "")
        assert f"ended by {ending.name}" in output
        assert output.rstrip().endswith("Device 1: stopped.")
        assert stands(simulation)
        assert simulation.drive(1).fault is None


def test_second_ctrl_c_does_not_leave_the_motor_running() -> None:
    with (
        bench(DriveSpec("atv71", 1, sets={"DEC": 50})) as (simulation, line),
        running(line) as program,
    ):
        wait_until(lambda: turns(simulation), "the motor turns")
        for _ in range(3):
            program.process.send_signal(signal.SIGINT)
            time.sleep(0.1)
        assert program.process.poll() is None, "the ramp takes longer"
        output, error = program.process.communicate(timeout=PATIENCE)
        assert (program.process.returncode, besides(error)) == (0, "")
        assert "Device 1: stopped." in output
        assert stands(simulation)


def test_ctrl_c_before_the_motor_runs_leaves_none_running() -> None:
    with bench() as (simulation, line):
        command = (*DRIVEPANEL, "run", line, "--reference", "20Hz", "--arm")
        with served(command, ready="Reference 20") as program:
            status, output = program.end(signal.SIGINT)
            assert (status, besides(output)) == (0, "")
        wait_until(lambda: stands(simulation), "the motor stands")
        assert simulation.drive(1).fault is None


def test_closed_output_stops_the_motor() -> None:
    with bench() as (simulation, line), running(line) as program:
        wait_until(lambda: turns(simulation), "the motor turns")
        assert program.process.stdout is not None
        program.process.stdout.close()
        assert program.process.wait(timeout=PATIENCE) == 0
        assert stands(simulation)
        program.process.stdout = None


def test_unread_output_does_not_delay_a_stop() -> None:
    """A terminal paused by Ctrl-S accepts no output; here a pipe that is full from the start."""
    reading, writing = os.pipe()
    with bench() as (simulation, line):
        os.set_blocking(writing, False)
        while select.select([], [writing], [], 0)[1]:
            os.write(writing, b"x" * 4096)
        os.set_blocking(writing, True)
        command = (*DRIVEPANEL, "run", line, "--reference", "20Hz", "--arm")
        process = subprocess.Popen(command, stdout=writing, stderr=subprocess.DEVNULL)
        try:
            wait_until(lambda: turns(simulation), "the motor turns")
            process.send_signal(signal.SIGTERM)
            assert process.wait(timeout=PATIENCE) == 0
            assert stands(simulation)
        finally:
            process.kill()
            process.wait(timeout=PATIENCE)
            os.close(reading)
            os.close(writing)


@pytest.mark.parametrize("family", ALTIVARS)
def test_run_for_a_time_stops_at_its_end(family: str) -> None:
    with bench(DriveSpec(family, 1)) as (simulation, line):
        run = ("run", line, "-p", family, "--reference", "20Hz", "--arm", "--for", "2")
        done = drivepanel(*run)
        assert (done.returncode, besides(done.stderr)) == (0, "")
        assert "running forward  Output frequency" in done.stdout
        assert "stopping (after 2 s)" in done.stdout
        assert done.stdout.rstrip().endswith("Device 1: stopped.")
        assert stands(simulation)
        assert simulation.drive(1).fault is None


def test_run_reverse_prints_json() -> None:
    with bench() as (simulation, line):
        run = ("run", line, "--reference", "20Hz", "--reverse", "--arm", "--for", "3", "--json")
        done = drivepanel(*run)
        assert (done.returncode, besides(done.stderr)) == (0, "")
        reported: list[dict[str, Any]] = [json.loads(text) for text in done.stdout.splitlines()]
        events = [row["event"] for row in reported]
        assert events[:2] == ["reference", "order"]
        assert events[-2:] == ["stopping", "stopped"]
        last = [row for row in reported if row["event"] == "state"][-1]
        assert (last["state"], last["direction"]) == ("running", "reverse")
        assert last["values"]["output_frequency"]["value"] < -3
        assert last["values"]["frequency_reference"]["unit"] == "Hz"
        assert stands(simulation)


def test_run_keeps_the_drive_alive() -> None:
    """A timeout of 0.5 s passes several times between two lines of output."""
    with bench(DriveSpec("atv71", 1, sets={"TTO": 5})) as (simulation, line):
        command = [*DRIVEPANEL, "run", line, "--reference", "20Hz", "--arm"]
        with served(command, ready="running forward") as program:
            end = time.monotonic() + 3.0
            while time.monotonic() < end:
                assert simulation.drive(1).fault is None
                time.sleep(0.05)
            assert program.process.poll() is None


def test_leave_running_leaves_the_motor_running_and_names_the_timeout() -> None:
    with bench(DriveSpec("atv71", 1, sets={"SLL": 0})) as (simulation, line):
        run = ("run", line, "--reference", "20Hz", "--arm", "--for", "2", "--leave-running")
        done = drivepanel(*run)
        assert (done.returncode, besides(done.stderr)) == (0, "")
        assert "without communication it goes on: its reaction is Ignored" in done.stdout
        assert "stopp" not in done.stdout
        assert turns(simulation)
        done = drivepanel("stop", line)
        assert done.returncode == 0, done.stderr
        assert done.stdout.endswith("Device 1, Altivar 71: stopped.\n")
        assert stands(simulation)


# run: errors


def test_trip_ends_the_run_and_is_reported() -> None:
    with bench() as (simulation, line), running(line) as program:
        wait_until(lambda: turns(simulation), "the motor turns")
        simulation.drive(1).provoke("OCF")
        _, error = program.process.communicate(timeout=PATIENCE)
        assert program.process.returncode == 4
        assert "Device 1 tripped: OCF" in error
        assert stands(simulation)


def test_motor_stopped_by_another_source_ends_the_run() -> None:
    with bench() as (simulation, line), running(line) as program:
        wait_until(lambda: turns(simulation), "the motor turns")
        simulation.drive(1).power_cycle()
        _, error = program.process.communicate(timeout=PATIENCE)
        assert program.process.returncode == 6
        assert "Device 1 no longer runs" in error
        assert "It was stopped by another program or master on the line" in error
        assert "CMD 16#000F is now 16#0000" in error
        assert stands(simulation)


@pytest.mark.parametrize("order", [[], ["--quick"], ["--freewheel"]])
def test_stop_by_another_program_ends_the_run_and_is_reported(order: list[str]) -> None:
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        host, port = simulation.serve_tcp()
        line = f"tcp:{host}:{port}"
        with running(line) as program:
            wait_until(lambda: turns(simulation), "the motor turns")
            assert drivepanel("stop", line, *order).returncode == 0
            output, error = program.process.communicate(timeout=PATIENCE)
            assert program.process.returncode == 6, error
            assert "It was stopped by drivepanel stop, stop" in error
            assert "It was stopped by drivepanel stop, stop" in output
            assert stands(simulation)


def test_run_discards_pending_commands_of_other_programs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counts = []

    async def first(line: ModbusLine, device: int, *_: object) -> None:
        counts.append(line.facts.stops.stamp(device))
        raise LineLost("Enough is known.")

    monkeypatch.setattr("tui.session.command.first_stop.stop_first", first)
    done = CliRunner().invoke(main, ["stop", "sim:atv71", "-p", "atv71"])
    assert done.exit_code == 3
    assert "NOT STOPPED: Enough is known. Stop it at the machine." in done.stderr
    assert counts == [1]


def silence(simulation: Simulation) -> None:
    simulation.faults.rates = FaultRates(lost=1.0)


def speech(simulation: Simulation) -> None:
    simulation.faults.rates = FaultRates()


LOSSES = {"unplugged": (Simulation.unplug, Simulation.replug), "silent": (silence, speech)}


@pytest.mark.parametrize("loss", LOSSES)
def test_motor_is_stopped_when_a_lost_line_returns(loss: str, tmp_path: Path) -> None:
    lose, give_back = LOSSES[loss]
    spec = DriveSpec("atv71", 1, sets={"SLL": 0})
    with Simulation([spec]) as simulation:
        link = simulation.serve_pty(str(tmp_path / "line"))
        with running(f"serial:{link},19200,8N1") as program:
            wait_until(lambda: turns(simulation), "the motor turns")
            lose(simulation)
            assert program.process.stderr is not None
            output = [program.process.stderr.readline() for _ in range(2)]
            assert "without communication it goes on: its reaction is Ignored" in output[1]
            program.process.send_signal(signal.SIGINT)
            assert "NOT STOPPED yet" in program.process.stderr.readline()
            assert program.process.poll() is None
            # a stop reaches a drive whose replies are lost; a disconnected one runs on
            assert turns(simulation) or loss == "silent"
            give_back(simulation)
            out, _ = program.process.communicate(timeout=PATIENCE)
            assert program.process.returncode == 0
            assert out.rstrip().endswith(("Device 1: stopped.", "Device 1 is at standstill."))
            assert stands(simulation)


# Refusals

NOT_ARMED = [("run",), ("reference", "30Hz"), ("reset",)]


@pytest.mark.parametrize("command", NOT_ARMED, ids=lambda command: command[0])
def test_unarmed_commands_exit_with_5(command: tuple[str, ...]) -> None:
    done = drivepanel(command[0], "sim:atv71", *command[1:])
    assert (done.returncode, done.stdout) == (5, "")
    assert "Not armed" in done.stderr
    assert "--arm lets this one command write" in done.stderr


@pytest.mark.parametrize("command", [*NOT_ARMED, ("stop",)], ids=lambda command: command[0])
def test_read_only_line_is_not_written_exits_with_5(command: tuple[str, ...]) -> None:
    arm = () if command == ("stop",) else ("--arm",)
    done = drivepanel(command[0], "sim:atv71", *command[1:], *arm, "--read-only")
    assert done.returncode == 5
    assert "read-only" in done.stderr


REFUSED = {
    "interlock": (5, "atv31", {"LAC": 1}, ("run",), r"below L3"),
    "channel": (5, "atv71", {"CD1": 0, "CHCF": 2}, ("run",), "not commanded by Modbus"),
    "limit": (2, "atv71", {"HSP": 500}, ("reference", "90Hz"), "above HSP"),
    "run at a limit": (2, "atv71", {"HSP": 500}, ("run", "--reference", "90Hz"), "above HSP"),
    "no fault": (5, "atv71", {}, ("reset",), "No fault to reset"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusal_by_commander_exits_with_2_for_a_value_else_with_5(case: str) -> None:
    status, family, sets, command, text = REFUSED[case]
    with bench(DriveSpec(family, 1, sets=sets)) as (simulation, line):
        done = drivepanel(command[0], line, *command[1:], "-p", family, "--arm")
        assert done.returncode == status, done.stderr
        assert text in done.stderr
        assert "topp" not in done.stdout
        assert stands(simulation)


COMMANDS = [("run", "--arm"), ("reference", "30Hz", "--arm"), ("reset", "--arm"), ("stop",)]


@pytest.mark.parametrize("command", [*COMMANDS, ("status",)], ids=lambda command: command[0])
def test_unanswered_command_exits_with_3(command: tuple[str, ...]) -> None:
    done = drivepanel(command[0], "sim:atv71@2", *command[1:], "-p", "atv71", "-d", "9")
    assert done.returncode == 3, done.stderr
    assert "evice 9" in done.stderr


def test_refused_reference_exits_with_4() -> None:
    with bench() as (simulation, line):
        simulation.drive(1).registers.protect([simulation.drive(1).profile["LFR"]])
        done = drivepanel("reference", line, "30Hz", "--arm")
        assert done.returncode == 4, done.stdout + done.stderr
        assert "xception" in done.stderr


def test_refused_run_command_exits_with_4_at_standstill() -> None:
    with bench() as (simulation, line):
        simulation.drive(1).registers.protect([simulation.drive(1).profile["CMD"]])
        done = drivepanel("run", line, "--reference", "30Hz", "--arm")
        assert done.returncode == 4, done.stdout + done.stderr
        assert "xception" in done.stderr
        assert "NOT STOPPED" not in done.stderr
        assert "is at standstill" in done.stdout
        assert stands(simulation)


# reference and reset


def test_reference_is_written_and_starts_nothing() -> None:
    with bench() as (simulation, line):
        done = drivepanel("reference", line, "30Hz", "--arm")
        assert (done.returncode, besides(done.stderr)) == (0, "")
        assert done.stdout == "Reference 30.0 Hz (LFR)\n"
        assert simulation.drive(1).raw("LFR") == 300
        assert stands(simulation)


def test_reset_clears_a_fault_without_a_cause() -> None:
    with bench(DriveSpec("atv71", 1, run_hz=20.0)) as (simulation, line):
        drive = simulation.drive(1)
        drive.provoke("OCF")
        wait_until(lambda: drive.fault is not None and drive.motor.rotor == 0, "it tripped")
        drive.clear_cause()
        done = drivepanel("reset", line, "--arm")
        assert (done.returncode, besides(done.stderr)) == (0, "")
        assert "\nFault reset. State: " in done.stdout
        assert drive.fault is None


def test_fault_with_lasting_cause_exits_with_4() -> None:
    with bench() as (simulation, line):
        drive = simulation.drive(1)
        drive.provoke("OCF", persists=True)
        wait_until(lambda: drive.fault is not None, "it tripped")
        done = drivepanel("reset", line, "--arm")
        assert done.returncode == 4, done.stdout
        assert "its cause is not gone" in done.stderr
        assert drive.fault is not None


# stop


@pytest.mark.parametrize("way", [(), ("--quick",), ("--freewheel",)])
def test_stop_needs_no_arming(way: tuple[str, ...]) -> None:
    with bench(DriveSpec("atv71", 1, run_hz=30.0)) as (simulation, line):
        wait_until(lambda: turns(simulation), "the motor turns")
        done = drivepanel("stop", line, *way)
        assert (done.returncode, besides(done.stderr)) == (0, "")
        sent, stopped = done.stdout.splitlines()
        coasts = "--freewheel" in way
        result = "without current, and may still coast" if coasts else "stopped"
        assert stopped == f"Device 1, Altivar 71: {result}."
        assert sent.startswith("Device 1: sent first 16#000")
        assert sent.endswith("it says it is ATV71HU15M3.")
        assert stands(simulation)


def test_stop_of_an_enabled_motor_at_0_hz_exits_with_4() -> None:
    """Run at the terminals with reference 0: the next turn of the potentiometer turns it."""
    with bench(DriveSpec("atv71", 1, sets={"FR1": 1})) as (simulation, line):
        simulation.drive(1).run(0.0)
        done = drivepanel("stop", line)
        assert done.returncode == 4
        assert "stopped" not in done.stdout
        assert "Device 1, Altivar 71: NOT STOPPED" in done.stderr
        assert "0 Hz and still enabled" in done.stderr
        assert "Stop it at the machine" in done.stderr


def test_stop_all_stops_every_drive() -> None:
    specs = [DriveSpec(text, n, run_hz=20.0) for n, text in enumerate(("atv71", "atv21"), start=1)]
    with bench(*specs) as (simulation, line):
        wait_until(lambda: all(turns(simulation, n) for n in (1, 2)), "the motors turn")
        done = drivepanel("stop", line, "--all", "--addresses", "1-3")
        assert done.returncode == 3, done.stderr
        assert "Device 1, Altivar 71: stopped." in done.stdout
        assert "Device 2, Altivar 21: stopped." in done.stdout
        assert "NOT STOPPED: no answer at 3." in done.stderr
        assert all(stands(simulation, n) for n in (1, 2))


def test_stop_all_names_drives_not_stopped_and_stops_the_others() -> None:
    # a drive that refuses identification may be any family
    specs = [
        DriveSpec("atv21", 1, identity={1: "UNHEARD OF"}),
        DriveSpec("atv71", 2, run_hz=20.0),
    ]
    with bench(*specs) as (simulation, line):
        wait_until(lambda: turns(simulation, 2), "the motor turns")
        done = drivepanel("stop", line, "--all", "--addresses", "1,2")
        assert done.returncode == 4, done.stdout + done.stderr
        assert "Device 1: NOT STOPPED" in done.stderr
        assert "name its profile" in done.stderr
        assert "Device 2, Altivar 71: stopped." in done.stdout
        assert stands(simulation, 2)


@pytest.mark.parametrize("which", [("--all", "--addresses", "1,2"), ()])
def test_unidentified_drive_is_stopped_by_its_recorded_family(
    which: tuple[str, ...],
) -> None:
    with bench(DriveSpec("proxidrive", 1, sets={"6.43": 1})) as (simulation, line):
        until = ("--for", "2", "--leave-running")
        started = drivepanel("run", line, "-p", "proxidrive", "--arm", *until)
        assert turns(simulation), started.stderr
        done = drivepanel("stop", line, *which)
        assert "Device 1, Proxidrive: stopped." in done.stdout
        assert stands(simulation)


def test_answering_drives_are_stopped_before_silent_addresses_time_out() -> None:
    with bench(DriveSpec("atv71", 10, run_hz=20.0)) as (simulation, line):
        wait_until(lambda: turns(simulation, 10), "the motor turns")
        command = [*DRIVEPANEL, "stop", line, "--all"]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as program:
            assert program.stdout is not None
            assert "Device 10, Altivar 71: stopped." in program.stdout.readline()
            # the nine silent addresses are still probed with a longer wait
            assert program.poll() is None
            assert stands(simulation, 10)
            program.kill()


def test_stop_all_without_answer_exits_with_3() -> None:
    done = drivepanel("stop", "sim:atv71@2", "--all", "--addresses", "5,6")
    assert done.returncode == 3
    assert "no answer at 5, 6." in done.stderr


def test_stop_mode_missing_in_a_family_is_replaced() -> None:
    done = drivepanel("stop", "sim:powerdrive", "-p", "powerdrive", "--quick")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "stopped (it has no quick stop: ramp stop)." in done.stdout


def test_silent_addresses_of_a_scan_are_not_failures() -> None:
    with bench(DriveSpec("atv71", 2, run_hz=20.0)) as (simulation, line):
        done = drivepanel("stop", line, "--all")
        assert done.returncode == 0, done.stderr
        assert "No answer at 1,3-10." in done.stderr
        assert "NOT STOPPED" not in done.stderr
        assert stands(simulation, 2)


def test_started_motor_that_no_scan_finds_exits_with_3() -> None:
    """Its start is on record; it lies past the addresses that are searched by themselves."""
    with bench(DriveSpec("atv71", 31)) as (simulation, line):
        left = ("--for", "1", "--leave-running")
        run = drivepanel("run", line, "-d", "31", "--reference", "20Hz", "--arm", *left)
        assert run.returncode == 0, run.stderr
        end_keepers()  # which would stop it, as it was armed there
        silence(simulation)
        done = drivepanel("stop", line, "--all")
        assert done.returncode == 3, done.stdout + done.stderr
        assert "NOT STOPPED: no answer at 31." in done.stderr
        speech(simulation)
        done = drivepanel("stop", line, "--all")
        assert done.returncode == 0, done.stderr
        assert "Device 31, Altivar 71: stopped." in done.stdout


# stop, and the identification of the drive


def test_stop_is_not_refused_for_a_wrong_profile() -> None:
    """The stop of an Altivar 312 would run this motor, which is in the I/O profile."""
    with bench(DriveSpec("atv71", 1, sets={"CHCF": 3, "TCC": 0})) as (simulation, line):
        started = drivepanel(
            "run", line, "--reference", "20Hz", "--arm", "--for", "1", "--leave-running"
        )
        assert turns(simulation), started.stderr
        done = drivepanel("stop", line, "-p", "atv312")
        assert done.returncode == 0, done.stdout + done.stderr
        assert "profile Altivar 312 does not fit it. It is stopped as Altivar 71." in done.stderr
        sent, stopped = done.stdout.splitlines()
        assert sent.startswith("Device 1: sent first 16#0000 to CMD, the stop of Altivar")
        assert sent.endswith("it says it is ATV71HU15M3.")
        assert stopped == "Device 1, Altivar 71: stopped."
        assert stands(simulation)


def test_stop_all_uses_each_identification_not_the_named_profile() -> None:
    with bench(DriveSpec("atv71", 1, run_hz=20.0)) as (simulation, line):
        done = drivepanel("stop", line, "--all", "--addresses", "1", "-p", "powerdrive")
        assert done.returncode == 0, done.stderr
        assert "the profile Powerdrive does not fit it. It is stopped as Altivar 71." in done.stderr
        assert stands(simulation)


def test_unknown_drive_is_stopped_by_the_word_it_accepts() -> None:
    spec = DriveSpec("atv21", 1, identity={1: "UNHEARD OF"}, run_hz=20.0)
    with bench(spec) as (simulation, line):
        wait_until(lambda: turns(simulation), "the motor turns")
        done = drivepanel("stop", line)
        assert done.returncode == 4, done.stdout + done.stderr
        assert "it says it is UNHEARD OF" in done.stdout
        assert ": stopped" not in done.stdout
        assert "it is not known if the motor stopped" in done.stderr
        assert "Read as Altivar 21, it is at standstill" in done.stderr
        assert stands(simulation)


@pytest.mark.parametrize("own", [False, True], ids=["packaged", "own profile"])
def test_stop_with_named_profile_uses_no_other(own: bool) -> None:
    """No other profile has a say, though the drive has another's status word."""
    name = "varmeca"
    if own:
        folder = library.user_folder()
        folder.mkdir(parents=True)
        text = (library.packaged_folder() / "varmeca.toml").read_text("utf-8")
        name = "fan"
        (folder / "fan.toml").write_text(text.replace('id = "varmeca"', 'id = "fan"', 1), "utf-8")
    spec = DriveSpec("atv21", 1, identity={1: "UNHEARD OF"}, run_hz=20.0)
    with bench(spec) as (simulation, line):
        wait_until(lambda: turns(simulation), "the motor turns")
        done = drivepanel("stop", line, "-p", name)
        assert done.returncode == 4, done.stdout + done.stderr
        assert ": stopped" not in done.stdout
        assert "NOT STOPPED" in done.stderr
        assert "Altivar 21" not in done.stdout + done.stderr


def test_stop_of_a_silent_drive_exits_with_3() -> None:
    with bench(DriveSpec("atv312", 1, run_hz=20.0)) as (simulation, line):
        silence(simulation)
        for named in ([], ["-p", "atv312"]):
            done = drivepanel("stop", line, *named)
            assert done.returncode == 3, done.stdout
            assert "NOT STOPPED: Device 1 did not answer" in done.stderr
            assert ("16#0000 to CMD" in done.stdout) is bool(named)


@pytest.mark.parametrize("way", [("--all", "--addresses", "1"), ("-d", "1", "-d", "2")])
def test_stop_of_several_sends_a_silent_drive_its_profile_word(
    way: tuple[str, ...],
) -> None:
    """Replies of the drive are lost, but not requests."""
    with bench(DriveSpec("atv312", 1, run_hz=20.0)) as (simulation, line):
        wait_until(lambda: turns(simulation), "the motor turns")
        silence(simulation)
        done = drivepanel("stop", line, *way)
        assert done.returncode == 3, done.stdout
        assert "sent first" not in done.stdout
        assert turns(simulation)
        done = drivepanel("stop", line, *way, "-p", "atv312")
        assert done.returncode == 3, done.stdout
        assert "Device 1: sent first 16#0000 to CMD" in done.stdout
        assert "NOT STOPPED: no answer at 1" in done.stderr
        assert ": stopped" not in done.stdout
        wait_until(lambda: stands(simulation), "it was stopped blind")


def test_stop_of_a_guessed_family_reports_not_stopped() -> None:
    spec = DriveSpec("powerdrive", 1, run_hz=20.0, sets={"6.43": 1, "6.42": 3})
    for way in ((), ("--all", "--addresses", "1")):
        with bench(spec) as (simulation, line):
            wait_until(lambda: turns(simulation), "the motor turns")
            done = drivepanel("stop", line, *way)
            assert done.returncode == 4, done.stdout + done.stderr
            assert ": stopped" not in done.stdout
            assert "NOT STOPPED: it is not known if the motor stopped" in done.stderr
            assert stands(simulation)


@pytest.mark.parametrize(
    "extra", [("--quick", "--freewheel"), ("--addresses", "1"), ("--all", "--addresses", "x")]
)
def test_stop_usage_exits_with_2(extra: tuple[str, ...]) -> None:
    assert drivepanel("stop", "sim:atv71", *extra).returncode == 2


# status


def test_status_of_a_running_drive_is_shown() -> None:
    with bench(DriveSpec("atv71", 1, run_hz=30.0)) as (simulation, line):
        wait_until(lambda: simulation.drive(1).motor.frequency > 29, "the motor turns")
        done = drivepanel("status", line, "--json")
        assert (done.returncode, besides(done.stderr)) == (0, "")
        reported = json.loads(done.stdout)
        assert (reported["state"]["kind"], reported["direction"]) == ("running", "forward")
        assert reported["fault"] is None
        assert reported["values"]["output_frequency"]["value"] == pytest.approx(30, abs=1.5)
        assert reported["watch"]["timeout_s"] == 10
        assert "coasts" in reported["watch"]["does"]


def test_status_shows_a_fault_and_why_commands_have_no_effect() -> None:
    with bench(DriveSpec("atv71", 1, sets={"CD1": 0, "CHCF": 2})) as (simulation, line):
        simulation.drive(1).provoke("OCF")
        wait_until(lambda: simulation.drive(1).fault is not None, "it tripped")
        reported = json.loads(drivepanel("status", line, "--json").stdout)
        assert reported["fault"]["code"] == "OCF"
        assert reported["commandable"] is False
        assert "not commanded by Modbus" in reported["why_not"]
        text = drivepanel("status", line).stdout
        assert "OCF" in text
        assert "not commanded by Modbus" in text


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "powerdrive", "proxidrive"])
def test_status_of_every_family_is_shown(family: str) -> None:
    """The two Leroy-Somer families report neither a direction nor a source of the reference."""
    done = drivepanel("status", f"sim:{family}", "-p", family)
    assert (done.returncode, besides(done.stderr)) == (0, "")
    titles = [line[:17].strip() for line in done.stdout.splitlines()]
    unreported = () if family.startswith("atv") else ("Direction", "Reference from")
    expected = [
        "Device", "State", "Direction", "Fault", "Alarms", "Commanded by", "Reference from",
        "Commands", "Comm. timeout",
    ]  # fmt: skip
    expected = [title for title in expected if title not in unreported]
    assert titles[: len(expected)] == expected


def test_simulated_line_uses_the_settings_of_its_first_drive(tmp_path: Path) -> None:
    """Simulated lines need no baud and no format."""
    link = tmp_path / "line"
    with simulated("powerdrive@1", "--pty", str(link)) as there:
        assert f"serial:{link},19200,8N2." in there.ready
        done = drivepanel("read", f"serial:{link}", "5.01", "-p", "powerdrive")
    assert done.returncode == 0, done.stderr
