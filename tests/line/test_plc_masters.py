"""PLC programs on simulated drives: LinuxCNC's vfs11_vfd, and a soft PLC on minimalmodbus."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import minimalmodbus
import pytest

from tests.conftest import need_peer
from tests.programs import PATIENCE, drivepanel, port_of, served, simulated, wait_until

from .test_simulate_inputs import typed

# vfs11_vfd drives the Toshiba VF-S11, of which the Altivar 21 is a sister.
RUNS, TRIPPED = 0x0400, 0x0002


@dataclass(frozen=True, slots=True)
class LinuxCnc:
    """vfs11_vfd with its pins in the shared memory of LinuxCNC."""

    program: list[str]
    halcmd: list[str]
    name: str

    def hal(self, *words: str) -> str:
        """Carry out a command of halcmd; return its output."""
        done = subprocess.run(
            [*self.halcmd, *words], capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        return done.stdout.strip() if done.returncode == 0 else ""

    def set_pins(self, **pins: object) -> None:
        """Set pins; a `_` stands for a `-`."""
        for name, value in pins.items():
            self.hal("setp", f"{self.name}.{name.replace('_', '-')}", str(value))

    def pin(self, name: str) -> float:
        """Return a pin; TRUE is 1. An unknown one is -1."""
        text = self.hal("getp", f"{self.name}.{name}")
        return float({"TRUE": "1", "FALSE": "0", "": "-1"}.get(text, text))


@pytest.fixture
def linuxcnc() -> LinuxCnc:
    """LinuxCNC as installed, or unpacked in the folder `DRIVEPANEL_LINUXCNC`; `none` skips."""
    folder = Path(os.environ.get("DRIVEPANEL_LINUXCNC", "/nowhere"))
    if str(folder) == "none":
        pytest.skip("this system has no package linuxcnc-uspace")
    found = shutil.which("vfs11_vfd", path=f"{folder / 'usr/bin'}:{os.environ['PATH']}")
    if found is None:
        need_peer(
            "vfs11_vfd is not here; it comes with the package linuxcnc-uspace. Unpack it, and name"
            " the folder in DRIVEPANEL_LINUXCNC."
        )
    run = ["env", f"LD_LIBRARY_PATH={folder / 'usr/lib'}"]
    halcmd = str(Path(str(found)).with_name("halcmd"))
    # a killed program keeps its name in the shared memory
    return LinuxCnc([*run, "stdbuf", "-oL", str(found)], [*run, halcmd], f"vfd{os.getpid()}")


def test_linuxcnc_runs_trips_resets_and_releases_the_drive(
    linuxcnc: LinuxCnc, tmp_path: Path
) -> None:
    settings = ("--set", "ACC=10", "--set", "dEC=10")
    with simulated("atv21@1", "--tcp", "127.0.0.1:0", *settings) as simulation:
        port = port_of(simulation.ready)
        ini = tmp_path / "vfd.ini"
        ini.write_text(f"[VFS11]\nTYPE=tcpclient\nTCPDEST=127.0.0.1\nPORT={port}\nTARGET=1\n")
        command = [*linuxcnc.program, "-r", "-n", linuxcnc.name, "-I", str(ini)]
        with served(command, ready="inverter model") as vfd:
            wait_until(lambda: linuxcnc.pin("modbus-ok") == 1, "LinuxCNC reaches the drive")
            assert linuxcnc.pin("frequency-limit") == 50
            linuxcnc.set_pins(enable=1, speed_command=705, spindle_on=1)
            wait_until(lambda: linuxcnc.pin("at-speed") == 1, "the spindle turns")
            assert linuxcnc.pin("frequency-out") == pytest.approx(25, abs=0.3)
            assert int(linuxcnc.pin("status")) & RUNS
            linuxcnc.set_pins(spindle_on=0)
            wait_until(lambda: linuxcnc.pin("is-stopped") == 1, "the spindle stands")
            linuxcnc.set_pins(spindle_on=1)
            wait_until(lambda: linuxcnc.pin("frequency-out") > 5, "the spindle turns again")
            linuxcnc.set_pins(estop=1)
            wait_until(lambda: linuxcnc.pin("trip-code") > 0, "the drive trips")
            assert int(linuxcnc.pin("status")) & TRIPPED
            linuxcnc.set_pins(err_reset=1)
            wait_until(lambda: linuxcnc.pin("trip-code") == 0, "the trip is reset")
            wait_until(lambda: linuxcnc.pin("is-stopped") == 1, "the spindle stands")
            assert linuxcnc.pin("error-count") == 0
            vfd.end()
        assert word_of(port, 0xFA00) == 0, "it gives the drive back to its keypad"


def word_of(port: int, address: int) -> int:
    """Read one word of the drive at 1 by a client of our own."""
    done = drivepanel("read", f"tcp:127.0.0.1:{port}", "-d", "1", hex(address), "--json")
    (value,) = json.loads(done.stdout)["values"].values()
    return int(value["raw"])


# A soft PLC: in each cycle it reads the status, and writes the command and the reference

STATUS, FREQUENCY, COMMAND, REFERENCE, FAULT = 3201, 3202, 8501, 8502, 7121
STATES = {0x40: 0x06, 0x50: 0x06, 0x21: 0x07, 0x23: 0x0F, 0x27: 0x0F}
"""Next command word of the Drivecom profile by the state."""
IN_FAULT, STATE = 0x08, 0x6F


@dataclass(slots=True)
class SoftPlc:
    """A program that keeps a motor at its reference, and counts trips."""

    drive: minimalmodbus.Instrument
    reset: bool = False
    trips: int = 0
    hertz: float = 0.0
    state: int = 0

    def cycle(self, hertz: float) -> float:
        """Carry out one cycle; return the output frequency in Hz."""
        status, frequency = self.drive.read_registers(STATUS, 2)
        before, self.state = self.state, status & STATE
        self.trips += self.state & IN_FAULT != 0 and before & IN_FAULT == 0
        word = STATES.get(self.state, 0x00)
        if self.state & IN_FAULT and self.reset:
            word = 0x80
        self.drive.write_registers(COMMAND, [word, round(hertz * 10)])
        self.hertz = frequency / 10
        return self.hertz


def test_soft_plc_rides_through_a_trip_of_the_bench(tmp_path: Path) -> None:
    link = str(tmp_path / "line")
    settings = ("--set", "2:FR1=164", "--set", "2:ACC=5", "--set", "2:dEC=5")
    with simulated("atv312@2", "--pty", link, *settings, stdin=subprocess.PIPE) as simulation:
        drive = minimalmodbus.Instrument(link, 2)
        drive.serial.timeout = 1.0
        plc = SoftPlc(drive)
        wait_until(lambda: plc.cycle(30) == 30, "the motor turns")
        typed(simulation, "2: trip OCF")
        wait_until(lambda: plc.cycle(30) == 0 and plc.state & IN_FAULT != 0, "the drive trips")
        assert (plc.trips, drive.read_register(FAULT)) == (1, 9)
        for _ in range(5):
            plc.cycle(30)
        assert plc.state & IN_FAULT, "without a reset it stays in fault"
        typed(simulation, "2: clear")
        plc.reset = True
        wait_until(lambda: plc.cycle(30) == 30, "the motor turns again")
        assert plc.trips == 1
