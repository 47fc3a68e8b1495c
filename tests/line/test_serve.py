"""`drivepanel serve` and other programs: third-party clients, runs, stops, ends."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.request import urlopen

import pytest
from modbus_tk import defines, modbus_tcp
from modbus_tk.modbus import ModbusError
from pymodbus.client import ModbusTcpClient

from tests.programs import DRIVEPANEL, PATIENCE, Served, port_of, served, wait_until
from tui.session.connect.named_lines import settings_file
from tui.simulator import DriveSpec, Simulation

from .conftest import HERE, Peer
from .test_commands import bench, stands, turns
from .test_shared_programs import records, runs_a_motor

STATUS, FREQUENCY, COMMAND, REFERENCE, ACCELERATION = 3201, 3202, 8501, 8502, 9001


@dataclass(frozen=True, slots=True)
class Gateway:
    """`serve` at work on simulated drives of this process."""

    simulation: Simulation
    line: str
    program: Served

    @property
    def port(self) -> int:
        return port_of(self.program.ready)

    def client(self) -> ModbusTcpClient:
        client = ModbusTcpClient("127.0.0.1", port=self.port, timeout=PATIENCE, retries=0)
        assert client.connect()  # type: ignore[no-untyped-call]
        return client


def serving(*arguments: str) -> list[str]:
    return [*DRIVEPANEL, "serve", *arguments]


@contextmanager
def gateway(*options: str, specs: tuple[DriveSpec, ...] = ()) -> Iterator[Gateway]:
    """`serve` on an Altivar 71 at address 1, and Modbus TCP at a free port."""
    with bench(*specs) as (simulation, line):
        command = serving(line, "--tcp", "127.0.0.1:0", *options)
        with served(command, ready="Ready:") as program:
            yield Gateway(simulation, line, program)


@pytest.fixture
def programs() -> Iterator[ExitStack]:
    """Programs that end with the test."""
    with ExitStack() as stack:
        yield stack


def second_run(programs: ExitStack, made: Gateway) -> Served:
    """`run` at work on the line that `serve` owns."""
    runner = programs.enter_context(served(runs_a_motor(made.line), ready="running forward"))
    wait_until(lambda: turns(made.simulation), "the motor turns")
    return runner


# Clients of other makers, while a program commands


def test_pymodbus_and_modbus_tk_read_while_a_program_commands(programs: ExitStack) -> None:
    with gateway("--fresh", "1") as made:
        second_run(programs, made)
        with made.client() as client:
            read = client.read_holding_registers(STATUS, count=2, device_id=1)
            assert not read.isError()
            assert read.registers[1] > 0
            nobody = client.read_holding_registers(STATUS, count=1, device_id=9)
            assert nobody.exception_code == 11
            refused = client.write_register(ACCELERATION, 57, device_id=1)
            assert refused.exception_code == 1
        master = modbus_tcp.TcpMaster("127.0.0.1", made.port, timeout_in_sec=PATIENCE)
        words = master.execute(1, defines.READ_HOLDING_REGISTERS, STATUS, 2)
        assert words[1] > 0
        with pytest.raises(ModbusError) as error:
            master.execute(1, defines.WRITE_SINGLE_REGISTER, COMMAND, output_value=15)
        assert error.value.get_exception_code() == 1
        master.close()
        assert turns(made.simulation)
        assert made.simulation.drive(1).raw("ACC") == 30


def test_mbpoll_reads_and_stops_while_a_program_commands(programs: ExitStack, peer: Peer) -> None:
    mbpoll = peer("mbpoll", "mbpoll")
    with gateway() as made:
        runner = second_run(programs, made)

        def poll(address: int, *values: str) -> subprocess.CompletedProcess[str]:
            options = ["-m", "tcp", "-p", str(made.port), "-a", "1", "-0", "-1", "-t", "4"]
            options += ["-o", "10"]  # its own second is too short on a busy computer
            return subprocess.run(
                [mbpoll, *options, "-r", str(address), "127.0.0.1", *values],
                capture_output=True,
                text=True,
                timeout=PATIENCE,
                check=False,
            )

        found = re.search(r"\[3202\]:\s+(\d+)", poll(FREQUENCY).stdout)
        assert found is not None
        assert int(found[1]) > 0
        assert poll(COMMAND, "15").returncode != 0
        assert turns(made.simulation)
        assert poll(COMMAND, "7").returncode == 0
        wait_until(lambda: stands(made.simulation), "the motor stops")
        output, _ = runner.process.communicate(timeout=PATIENCE)
        assert runner.process.returncode == 6
        assert "was stopped by Modbus TCP client 127.0.0.1:" in output
        assert made.simulation.drive(1).fault is None


def test_modbus_serial_writes_what_is_allowed(node: str) -> None:
    with gateway("--allow-writes", "ACC") as made:
        done = subprocess.run(
            [node, str(HERE / "serial_client.js"), str(made.port), "1", str(ACCELERATION), "64"],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)[0] == 64
        assert made.simulation.drive(1).raw("ACC") == 64


def test_run_word_is_exception_6_while_a_program_commands(programs: ExitStack) -> None:
    with gateway("--allow-commands", "--allow-writes", "all") as made:
        runner = second_run(programs, made)
        with made.client() as client:
            before = made.simulation.drive(1).raw("LFR")
            for address, word in ((COMMAND, 0x080F), (REFERENCE, 50), (ACCELERATION, 57)):
                assert client.write_register(address, word, device_id=1).exception_code == 6
            assert made.simulation.drive(1).raw("LFR") == before
            assert made.simulation.drive(1).raw("ACC") == 30
        assert runner.process.poll() is None
        assert turns(made.simulation)


def test_unit_ids_map_to_two_lines(programs: ExitStack) -> None:
    with bench(DriveSpec("atv71", 1)) as (_, text), bench(DriveSpec("atv31", 1)) as (_, other):
        command = serving(text, other, "--tcp", ":0", "--map", "1=1", "--map", "101-110=2@1")
        made = programs.enter_context(served(command, ready="Ready:"))
        with ModbusTcpClient("127.0.0.1", port=port_of(made.ready), timeout=PATIENCE) as client:
            names = [
                client.read_device_information(device_id=unit).information[1] for unit in (1, 101)
            ]
            assert names[0].startswith(b"ATV71")
            assert names[1].startswith(b"ATV31")
            missing = client.read_holding_registers(STATUS, count=1, device_id=2)
            assert missing.exception_code == 10


def test_named_line_sets_the_profile_of_an_unidentified_drive(programs: ExitStack) -> None:
    """A Leroy-Somer drive is not commanded unless it is known which it is."""
    drives = DriveSpec("powerdrive", 3)
    with bench(drives) as (simulation, line):
        settings_file().parent.mkdir(parents=True, exist_ok=True)
        named = f'[lines.pump]\nline = "{line}"\ndevice = 3\nprofile = "powerdrive"\n'
        settings_file().write_text(named, "utf-8")
        command = serving("pump", "--tcp", ":0", "--metrics", ":0", "--every", "0.2")
        program = programs.enter_context(served(command, ready="Ready:"))
        made = Gateway(simulation, line, program)
        with made.client() as client:
            assert not client.write_register(641, 0, device_id=3).isError()
        url = re.search(r"http://\S+/metrics", program.ready)
        assert url is not None

        def read() -> bool:
            with urlopen(url[0], timeout=PATIENCE) as answer:
                return b'device="3",profile="powerdrive"' in answer.read()

        wait_until(read, "the drive of the name is read")


def test_serve_warns_if_other_computers_can_connect() -> None:
    with bench() as (_, line):
        command = serving(line, "--tcp", "0.0.0.0:0", "--allow-commands")
        with served(command, ready="reads and commands") as program:
            status, output = program.end()
        assert status == 0
        assert "Modbus TCP has no password: anyone who can reach 0.0.0.0:" in output


# Its end, and the end of others


def test_sigterm_exits_with_0_and_notifies_systemd(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(PATIENCE)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "30000000")
        with gateway() as made, made.client():
            heard = {systemd.recv(500).split(b"\n")[0] for _ in range(2)}
            assert heard == {b"READY=1", b"WATCHDOG=1"}
            status, output = made.program.end()
            assert (status, output) == (0, "")
            assert systemd.recv(500).startswith(b"STOPPING=1")


def test_ctrl_c_exits_with_130() -> None:
    with bench() as (_, line), served(serving(line), ready="Ready:") as program:
        assert program.end(signal.SIGINT)[0] == 130


def test_attached_programs_continue_if_serve_is_killed(programs: ExitStack) -> None:
    with gateway() as made:
        recorder = programs.enter_context(served(records(made.line), ready="{"))
        made.program.process.kill()
        made.program.process.wait(PATIENCE)
        assert recorder.process.stdout is not None
        for _ in range(20):
            line = recorder.process.stdout.readline()
        assert json.loads(line)["values"]["RFR"]["quality"] == "good"
        with served(serving(made.line), ready="Ready:") as again:
            _, output = again.end()
        assert "Shared with watch" in output


def test_serve_becomes_the_owner_when_the_previous_one_exits(programs: ExitStack) -> None:
    with bench() as (simulation, line):
        recorder = programs.enter_context(served(records(line), ready="{"))
        command = serving(line, "--tcp", "127.0.0.1:0")
        made = Gateway(simulation, line, programs.enter_context(served(command, ready="Ready:")))
        with made.client() as client:
            assert not client.read_holding_registers(STATUS, count=2, device_id=1).isError()
            recorder.process.kill()
            recorder.process.wait(PATIENCE)

            def answers() -> bool:
                read = client.read_holding_registers(STATUS, count=2, device_id=1)
                return not read.isError()

            wait_until(answers, "the gateway answers again")
        status, output = made.program.end()
        assert status == 0
        assert "Shared with watch" in output


def started_by_a_client(made: Gateway) -> None:
    """A controller starts the motor: its connection closes, the motor runs on."""
    with made.client() as client:
        for address, word in ((REFERENCE, 300), (COMMAND, 6), (COMMAND, 7), (COMMAND, 15)):
            assert not client.write_register(address, word, device_id=1).isError()
    wait_until(lambda: turns(made.simulation), "the motor turns")


ENABLED = DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": 600})


ENDS = {
    signal.SIGTERM: 0, signal.SIGQUIT: 131, signal.SIGUSR1: 138, signal.SIGALRM: 142,
    signal.SIGSEGV: 0,
}  # fmt: skip
"""Signals that end it, the last one as SIGTERM does, and its exit status."""


@pytest.mark.parametrize("number", ENDS)
def test_serve_stops_the_motor_of_a_client_at_its_exit(number: signal.Signals) -> None:
    with gateway("--allow-commands", specs=(ENABLED,)) as made:
        started_by_a_client(made)
        status, output = made.program.end(number)
        assert status == ENDS[number]
        assert "Stopped: 1: stopped" in output
        assert stands(made.simulation)
        assert made.simulation.drive(1).fault is None


def test_motor_of_a_client_is_stopped_if_serve_is_killed(programs: ExitStack) -> None:
    with gateway("--allow-commands", specs=(ENABLED,)) as made:
        programs.enter_context(served(records(made.line), ready="{"))
        started_by_a_client(made)
        made.program.process.kill()
        wait_until(lambda: stands(made.simulation), "the motor stops")
        assert made.simulation.drive(1).fault is None


def test_serve_stops_a_motor_left_by_another_program(programs: ExitStack) -> None:
    with gateway() as made:
        runner = second_run(programs, made)
        runner.process.kill()
        wait_until(lambda: stands(made.simulation), "the motor stops")
        assert made.simulation.drive(1).fault is None
        _, output = made.program.end()
        assert "has exited: its motor is stopped" in output
