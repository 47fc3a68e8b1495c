"""Peers of the soak: a faulty simulated line, or a libmodbus server that answers late.

They run in separate processes, so that the memory of the soak is that of the panel's side.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.soak_drives import FAMILIES, Prepared, prepare
from benchmarks.wire import Worker
from tui.simulator import FaultRates, LineTiming

SOURCE = Path(__file__).with_name("late_server.c")
TIMING = LineTiming(19200, "8N1", real_time=True)
FAULTS = FaultRates(
    late=0.015,
    lost=0.01,
    duplicated=0.02,
    truncated=0.01,
    corrupted=0.01,
    noise=0.02,
    foreign=0.01,
    late_by=(0.1, 1.5),
)
"""Shares of replies that are hit; late ones come within what a line waits for.

A monitor's cycle needs each of its replies, so a larger share would leave few whole cycles.
"""
EVERY = 40
"""Of the libmodbus server: which answer is late."""
ALONE = 4
"""The device that the libmodbus server is on a serial line."""
LONGEST = 1.2
"""The longest lateness in s; longer than any timeout in force."""


class MissingPeer(Exception):
    """A peer cannot be had on this machine; says why."""


@dataclass(slots=True)
class Served:
    """A line that can be opened, and what it did wrong, once it has ended."""

    name: str
    text: str
    devices: tuple[int, ...]
    made: dict[str, int]
    """Count of each fault; filled at the end."""


# The simulated line


@contextmanager
def simulated(seed: int) -> Iterator[Served]:
    """The faulty line, in real time, in a process of its own."""
    worker = Worker("from benchmarks.soak_peers import simulate; simulate()")
    served = Served("simulated, 19200 baud", "", tuple(FAMILIES), {})
    try:
        path = worker.ask(seed=seed)["path"]
        served.text = f"serial:{path},{TIMING.baud},{TIMING.format}"
        yield served
        served.made |= worker.ask()
    finally:
        worker.close()


def simulate() -> None:
    """The process of the simulated line: first job its seed, second one its end."""
    seed = json.loads(sys.stdin.readline())["seed"]
    with prepare(seed, TIMING, FAULTS).simulation as simulation:
        print(json.dumps({"path": simulation.serve_pty()}), flush=True)
        sys.stdin.readline()
        print(json.dumps(simulation.faults.hits), flush=True)


# The libmodbus server


@contextmanager
def libmodbus_tcp(program: Path, prepared: Prepared) -> Iterator[Served]:
    """One server for all devices over Modbus TCP."""
    server = _Server([str(program), "tcp", *_lateness()], prepared)
    served = Served("libmodbus, TCP", server.where, tuple(FAMILIES), {})
    try:
        yield served
    finally:
        served.made |= server.end()


@contextmanager
def libmodbus_serial(program: Path, prepared: Prepared) -> Iterator[Served]:
    """One drive on a cable of pseudo-terminals.

    A libmodbus server takes what follows a request to another device for that one's reply, so
    that it loses requests where that one is late: several of them would not show our faults.
    """
    worker = Worker("from benchmarks.soak_peers import cable; cable()")
    served = Served("libmodbus, RTU", "", (ALONE,), {})
    try:
        near, far = worker.ask()["paths"]
        served.text = f"serial:{near},19200,8N1"
        server = _Server([str(program), "rtu", far, str(ALONE), *_lateness()], prepared)
        try:
            yield served
        finally:
            served.made |= server.end()
    finally:
        worker.close()


def build(folder: Path) -> Path:
    """The libmodbus server, compiled; raises MissingPeer."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise MissingPeer("no C compiler is here; it comes with the package gcc")
    try:
        flags = subprocess.run(
            ["pkg-config", "--cflags", "--libs", "libmodbus"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
    except (OSError, subprocess.CalledProcessError):
        raise MissingPeer(
            "libmodbus is not here; it comes with the packages libmodbus-dev and pkg-config"
        ) from None
    program = folder / "late_server"
    built = subprocess.run(
        [compiler, "-Wall", "-Wextra", "-O2", "-o", str(program), str(SOURCE), *flags],
        capture_output=True,
        text=True,
        check=False,
    )
    if built.returncode:
        raise MissingPeer(f"the server could not be compiled: {built.stderr.strip()}")
    return program


def _lateness() -> tuple[str, str]:
    return str(EVERY), f"{1000 * LONGEST:.0f}"


class _Server:
    """One process of the libmodbus server."""

    def __init__(self, command: Sequence[str], prepared: Prepared) -> None:
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        rows = (f"{device} {address} {word}\n" for device, address, word in prepared.words())
        self._process.stdin.write("".join(rows) + ".\n")
        self._process.stdin.flush()
        self.where = self._process.stdout.readline().strip()
        if not self.where:
            raise MissingPeer("the libmodbus server ended at once")

    def end(self) -> dict[str, int]:
        """End it; how many answers it gave, how many of them late and how many twice."""
        self._process.terminate()
        reported, _ = self._process.communicate(timeout=10)
        return dict(zip(("answers", "late", "twice"), map(int, reported.split()), strict=False))


def cable() -> None:
    """The process of a cable: what comes in at one of its ends goes out at the other."""
    sys.stdin.readline()
    pairs = [os.openpty() for _ in range(2)]
    for master, slave in pairs:
        tty.setraw(slave)
        os.set_blocking(master, False)
    print(json.dumps({"paths": [os.ttyname(slave) for _, slave in pairs]}), flush=True)
    near, far = (master for master, _ in pairs)
    while True:
        ready = select.select([sys.stdin, near, far], [], [])[0]
        if sys.stdin in ready:
            return
        for number, other in ((near, far), (far, near)):
            if number in ready:
                with suppress(BlockingIOError):  # a full terminal loses bytes, as a line does
                    os.write(other, os.read(number, 4096))


def fault_report() -> dict[str, object]:
    """Faults that the peers are set to produce."""
    return {"simulated": asdict(FAULTS), "libmodbus": {"every": EVERY, "longest_s": LONGEST}}
