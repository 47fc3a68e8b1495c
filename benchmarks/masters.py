"""Masters that read the monitoring set of a simulated drive: the panel, parts of it, others.

Each contestant runs in its own process and reports the ends of its cycles.
"""

from __future__ import annotations

import asyncio
import json
import os
import pty
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from serial import PARITY_NONE

from benchmarks.wire import ROOT, Record, WireLine, Worker
from tui.drive.profile.library import load
from tui.session.monitor.monitor import SHORTEST_PERIOD
from tui.session.monitor.rates import monitoring_codes

DEVICE = 1
PATIENCE = 20.0
LAST_REPLY = 0.1
"""Seconds for the reply that is on its way when a process is ended."""
PANEL_SECONDS = 2.0
"""Least time for which the panel is measured; it reads its slow values every tenth cycle."""
SETTLED = 0.5
"""Seconds after the panel's first cycle that are not counted."""
MBPOLL_PERIOD_MS = 11
"""The shortest that mbpoll takes is over 10."""

CYCLE_END = struct.Struct("d")
"""Times at which cycles of the panel ended, as its process reports."""
OURS = "Line + Reader"
PANEL = "whole panel"
ONE_BY_ONE = "pymodbus, a value each, silence"

Spans = list[tuple[int, int]]
"""Reads: address and count of words of each."""


# Their processes


def contest() -> None:
    """Take jobs from the input until it ends."""
    for line in sys.stdin:
        job = json.loads(line)
        run = {"reader": _reader, "pymodbus": _pymodbus, "minimalmodbus": _minimalmodbus}
        print(json.dumps(run[job["who"]](job)), flush=True)


def _reader(job: dict[str, Any]) -> dict[str, object]:
    from tui.bus.line import Line
    from tui.bus.link import parse_link
    from tui.session.drive import DriveSession
    from tui.session.read.reader import Reader

    profile = load(job["family"])
    line = Line(parse_link(job["text"]))
    line.open(wait=5.0)
    reader = Reader(DriveSession(line, DEVICE, profile))
    codes = monitoring_codes(profile)
    ends: list[float] = []
    done = threading.Event()

    async def work() -> None:
        try:
            await _repeat(lambda: reader.read(codes), job["seconds"], ends)
        finally:
            done.set()

    line.spawn(work, "benchmark")
    done.wait(PATIENCE)
    line.close()
    return {"ends": ends}


async def _repeat(cycle: Callable[[], Any], seconds: float, ends: list[float]) -> None:
    stop = time.monotonic() + seconds
    while time.monotonic() < stop or len(ends) < 3:
        await cycle()
        ends.append(time.monotonic())


def _pymodbus(job: dict[str, Any]) -> dict[str, object]:
    ends: list[float] = []
    asyncio.run(_pymodbus_cycles(job, ends))
    return {"ends": ends}


async def _pymodbus_cycles(job: dict[str, Any], ends: list[float]) -> None:
    from pymodbus.client import AsyncModbusSerialClient

    client = AsyncModbusSerialClient(job["path"], baudrate=job["baud"], parity=PARITY_NONE)
    await client.connect()

    async def cycle() -> None:
        for address, count in job["spans"]:
            if job["silence"]:
                await asyncio.sleep(job["silence"])
            await client.read_holding_registers(address, count=count, device_id=DEVICE)

    await _repeat(cycle, job["seconds"], ends)
    client.close()


def _minimalmodbus(job: dict[str, Any]) -> dict[str, object]:
    minimalmodbus: Any = import_module("minimalmodbus")  # it has no type hints
    instrument = minimalmodbus.Instrument(job["path"], DEVICE)
    port = instrument.serial
    port.baudrate, port.parity, port.timeout = job["baud"], PARITY_NONE, 1.0
    ends: list[float] = []

    async def cycle() -> None:
        for address, count in job["spans"]:
            instrument.read_registers(address, count)

    asyncio.run(_repeat(cycle, job["seconds"], ends))
    port.close()
    return {"ends": ends}


def panel() -> None:
    """The whole panel, watching one drive as fast as it can; cycle ends go to a pipe."""
    from tui.app import DrivePanelApp
    from tui.session.console import DriveConsole

    text, pipe = sys.argv[1], int(sys.argv[2])

    class Watched(DrivePanelApp):
        def show_monitor(self, console: DriveConsole) -> None:
            console.monitor.listen(lambda _: _tell(pipe))
            super().show_monitor(console)

    app = Watched(start=text, device=DEVICE)
    app.period = SHORTEST_PERIOD
    app.run()


def _tell(pipe: int) -> None:
    os.write(pipe, CYCLE_END.pack(time.monotonic()))


# Running them


@dataclass(frozen=True, slots=True)
class Cell:
    """One family at one baud, with the requests to its drive."""

    wire: WireLine
    family: str
    seconds: float
    blocks: Spans
    values: Spans
    design: float
    """Time of the best plan with two silences an exchange beside the turnaround, in s."""

    @property
    def limit(self) -> float:
        """Least time of the best plan, in s."""
        return self.least(self.blocks)

    def job(self, **more: object) -> dict[str, object]:
        """Inputs of a worker."""
        timing = self.wire.timing
        return {
            "text": self.wire.text,
            "path": self.wire.path,
            "baud": timing.baud,
            "family": self.family,
            "seconds": self.seconds,
            **more,
        }

    def least(self, spans: Spans) -> float:
        """Least time of these reads one after the other, in s."""
        return sum(self.wire.times.read(DEVICE, count) for _, count in spans)


Run = Callable[[Cell], Record]


@dataclass(frozen=True, slots=True)
class Contestant:
    """Someone who asks the drive."""

    name: str
    run: Run
    whole: bool = True
    """True if a cycle reads the whole monitoring set."""
    once: bool = False
    """True if it runs in the first round only, because its start is slow."""


def by_worker(worker: Worker, who: str, spans: str = "blocks", silence: bool = False) -> Run:
    """A contestant that is one of our workers."""

    def run(cell: Cell) -> Record:
        quiet = cell.wire.times.silence if silence else 0.0
        reads = cell.values if spans == "values" else cell.blocks
        cell.wire.take()
        reported = worker.ask(**cell.job(who=who, spans=reads, silence=quiet))
        return Record(cell.wire.times, cell.wire.take(), reported["ends"])

    return run


def mbpoll(cell: Cell) -> Record:
    """One process of mbpoll that polls the longest block; each exchange is a cycle."""
    address, count = max(cell.blocks, key=lambda span: span[1])
    timing = cell.wire.timing
    options = f"-m rtu -a {DEVICE} -0 -r {address} -c {count} -t 4:hex -l {MBPOLL_PERIOD_MS}"
    options += f" -b {timing.baud} -P none {cell.wire.path}"
    cell.wire.take()
    process = subprocess.Popen(["mbpoll", *options.split()], stdout=subprocess.DEVNULL)
    time.sleep(cell.seconds + 0.1)
    process.terminate()
    process.wait()
    time.sleep(LAST_REPLY)
    exchanges = cell.wire.take()
    return Record(cell.wire.times, exchanges, [e.ended for e in exchanges if e.size])


def whole_panel(cell: Cell) -> Record:
    """The app in a pseudo-terminal of 80 x 24, once its Monitor screen shows values."""
    reading, writing = os.pipe()
    # its keeper may still write there for a moment
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as state:
        process = _start_panel(cell.wire.text, writing, state)
        try:
            if not os.read(reading, CYCLE_END.size):
                raise RuntimeError("the panel ended before its first cycle")
            time.sleep(SETTLED)
            cell.wire.take()
            time.sleep(max(PANEL_SECONDS, cell.seconds))
            stop = time.monotonic()
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(10)
        time.sleep(LAST_REPLY)
    with os.fdopen(reading, "rb") as pipe:
        ends = [end for (end,) in CYCLE_END.iter_unpack(pipe.read())]
    exchanges = [exchange for exchange in cell.wire.take() if exchange.began < stop]
    return Record(cell.wire.times, exchanges, ends)


def _start_panel(text: str, writing: int, state: str) -> subprocess.Popen[bytes]:
    """The panel on a new pseudo-terminal that is read all the time; takes the pipe's end."""
    master, slave = pty.openpty()
    termios.tcsetwinsize(slave, (24, 80))
    environment = os.environ | {
        "TERM": "xterm-256color",
        "TEXTUAL_ANIMATIONS": "none",
        "PYTHONPATH": str(ROOT),
        "DRIVEPANEL_STATE": state,
    }
    code = "from benchmarks.masters import panel; panel()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, text, str(writing)],
        cwd=ROOT,
        env=environment,
        stdin=slave,
        stdout=slave,
        stderr=slave,
        pass_fds=[writing],
        start_new_session=True,
    )
    os.close(slave)
    os.close(writing)
    threading.Thread(target=_drain, args=(master,), daemon=True).start()
    return process


def _drain(terminal: int) -> None:
    """Read what a program writes to its terminal, until it ends."""
    try:
        while os.read(terminal, 65536):
            pass
    except OSError:
        os.close(terminal)


def contestants_of(worker: Worker) -> tuple[list[Contestant], dict[str, str]]:
    """All who are there, and why others are not."""
    found = [
        Contestant(PANEL, whole_panel, whole=False, once=True),
        Contestant(OURS, by_worker(worker, "reader")),
        Contestant("pymodbus, a value each", by_worker(worker, "pymodbus", "values")),
        Contestant(ONE_BY_ONE, by_worker(worker, "pymodbus", "values", silence=True)),
        Contestant("pymodbus, blocks", by_worker(worker, "pymodbus")),
        Contestant("pymodbus, blocks, silence", by_worker(worker, "pymodbus", silence=True)),
    ]
    missing = {}
    if find_spec("minimalmodbus"):
        each = by_worker(worker, "minimalmodbus", "values")
        found.append(Contestant("minimalmodbus, a value each", each))
        found.append(Contestant("minimalmodbus, blocks", by_worker(worker, "minimalmodbus")))
    else:
        missing["minimalmodbus"] = "the Python package is not installed"
    if shutil.which("mbpoll"):
        found.append(Contestant("mbpoll, one block", mbpoll, whole=False))
    else:
        missing["mbpoll"] = "the program is not installed"
    return found, missing


def worker() -> Worker:
    """The process of all contestants that are our own code."""
    return Worker("from benchmarks.masters import contest; contest()")
