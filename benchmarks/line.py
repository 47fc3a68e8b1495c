"""Cycle time of the monitoring set on a simulated line, beside other Modbus masters.

    python -m benchmarks.line [--families atv71,...] [--bauds 9600,19200] [--seconds S]

The simulator, in a process of its own, records each exchange; every time is taken there.
"""

from __future__ import annotations

import argparse
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
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from statistics import mean, median
from typing import Any

from rich.console import Console
from rich.table import Table
from serial import PARITY_NONE

from benchmarks.wire import ROOT, Record, WireLine, Worker, share
from tui.drive.library import load
from tui.drive.read_plan import WireTiming, plan_reads
from tui.drive.values import word_count
from tui.session.monitor import SHORTEST_PERIOD, monitoring_codes
from tui.simulator import LineTiming

FAMILIES = "atv21,atv31,atv312,atv71,powerdrive,proxidrive,varmeca"
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
"""When a cycle of the panel ended, as its process tells it."""
OURS = "Line + Reader"
PANEL = "whole panel"
ONE_BY_ONE = "pymodbus, a value each, silence"

Spans = list[tuple[int, int]]
"""Reads: address and count of words of each."""


# Contestants: each runs in a process of its own and tells when its cycles ended


def contest() -> None:
    """Take jobs from the input until it ends."""
    for line in sys.stdin:
        job = json.loads(line)
        run = {"reader": _reader, "pymodbus": _pymodbus, "minimalmodbus": _minimalmodbus}
        print(json.dumps(run[job["who"]](job)), flush=True)


def _reader(job: dict[str, Any]) -> dict[str, object]:
    from tui.bus.line import Line
    from tui.bus.link import parse_link
    from tui.session.reader import Reader

    profile = load(job["family"])
    line = Line(parse_link(job["text"]))
    line.open(wait=5.0)
    reader = Reader(line, DEVICE, profile)
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
    from tui.session.drive_session import DriveSession

    text, pipe = sys.argv[1], int(sys.argv[2])

    class Watched(DrivePanelApp):
        def show_monitor(self, session: DriveSession) -> None:
            session.monitor.listen(lambda _: _tell(pipe))
            super().show_monitor(session)

    app = Watched(start=text, device=DEVICE)
    app.period = SHORTEST_PERIOD
    app.run()


def _tell(pipe: int) -> None:
    os.write(pipe, CYCLE_END.pack(time.monotonic()))


# Running them


@dataclass(frozen=True, slots=True)
class Cell:
    """One family at one baud, with what its drive is asked."""

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
        """What a worker needs to know."""
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


def cell(wire: WireLine, family: str, timing: LineTiming, seconds: float) -> Cell:
    """Serve a drive of this family and plan its monitoring set."""
    wire.set_up({DEVICE: family}, timing)
    profile = load(family)
    codes = monitoring_codes(profile)
    turnaround = wire.times.turnarounds[DEVICE]
    plan = plan_reads(profile, codes, WireTiming(timing.character, timing.silence, turnaround))
    blocks = [(request.address, request.count) for request in plan.requests]
    values = [(profile[code].address, word_count(profile[code])) for code in codes]
    return Cell(wire, family, seconds, blocks, values, plan.seconds)


Run = Callable[[Cell], Record]


@dataclass(frozen=True, slots=True)
class Contestant:
    """Someone who asks the drive."""

    name: str
    run: Run
    whole: bool = True
    """Whether a cycle reads the whole monitoring set."""
    once: bool = False
    """Whether it runs in the first round only: its start takes long."""


def by_worker(worker: Worker, who: str, spans: str = "blocks", silence: bool = False) -> Run:
    """A contestant that is one of our workers."""

    def run(cell: Cell) -> Record:
        quiet = cell.wire.times.silence if silence else 0.0
        reads = cell.values if spans == "values" else cell.blocks
        cell.wire.take()
        told = worker.ask(**cell.job(who=who, spans=reads, silence=quiet))
        return Record(cell.wire.times, cell.wire.take(), told["ends"])

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
    with tempfile.TemporaryDirectory() as state:
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
    code = "from benchmarks.line import panel; panel()"
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


# Figures


@dataclass(slots=True)
class Row:
    """Figures of one contestant on one family and baud, over all its rounds."""

    cell: Cell
    contestant: Contestant
    records: list[Record]

    def figures(self) -> dict[str, Any]:
        """All figures; times in ms, silences in units of 3.5 characters, None where none is."""
        records, times = self.records, self.cell.wire.times
        steps = [step for record in records for step in record.steps()]
        lengths = [length for record in records for length in record.lengths()]
        gaps = [gap / times.silence for record in records for gap in record.gaps()]
        cycles = [cycle for record in records for cycle in record.cycles()]
        cycle = median(lengths) if lengths else None
        whole = cycle if self.contestant.whole else None
        own = [sum(map(times.shortest, cycle)) for cycle in cycles]
        return {
            "contestant": self.contestant.name,
            "requests": mean(map(len, cycles)) if cycles else None,
            "cycles": len(lengths),
            "cycle_ms": cycle and cycle * 1e3,
            "cycle_to_best_plan": whole and whole / self.cell.limit,
            "cycle_to_design": whole and whole / self.cell.design,
            "cycle_to_own_requests": sum(lengths) / sum(own) if own else None,
            "line_use": mean(record.use() for record in records),
            "request_median": median(steps) if steps else None,
            "request_mean": mean(steps) if steps else None,
            "request_99": share(steps, 0.99),
            "smallest_silence": min(gaps, default=None),
            "broken_silences": sum(gap < 1 for gap in gaps),
            "silences": len(gaps),
            "unanswered": sum(record.unanswered for record in records),
        }


def measured(cell: Cell, contestants: Sequence[Contestant], rounds: int) -> dict[str, Any]:
    """Figures of every contestant on one cell, in rounds of one run each."""
    rows = [Row(cell, contestant, []) for contestant in contestants]
    for number in range(rounds):
        for row in rows:
            if number == 0 or not row.contestant.once:
                row.records.append(row.contestant.run(cell))
    late = [late for row in rows for record in row.records for late in record.lateness()]
    least = sum(record.least() for row in rows for record in row.records)
    figures = [row.figures() for row in rows]
    singly = cell.least(cell.values)
    by_name = {row["contestant"]: row["cycle_ms"] for row in figures}
    one_by_one = by_name[ONE_BY_ONE]
    return {
        "family": cell.family,
        "baud": cell.wire.timing.baud,
        "values": len(cell.values),
        "requests": len(cell.blocks),
        "limit_ms": cell.limit * 1e3,
        "design_ms": cell.design * 1e3,
        "turnaround_ms": cell.wire.times.turnarounds[DEVICE] * 1e3,
        "limit_to_one_a_value": cell.limit / singly,
        "ours_to_one_a_value": _ratio(by_name[OURS], one_by_one),
        "panel_to_one_a_value": _ratio(by_name[PANEL], one_by_one),
        "simulator_late_ms": {"median": median(late) * 1e3, "99": (share(late, 0.99) or 0) * 1e3},
        "simulator_late_share": sum(late) / least,
        "contestants": figures,
    }


def _ratio(one: float | None, other: float | None) -> float | None:
    return one / other if one and other else None


# What is printed

COLUMNS = (
    ("requests", "requests", "{:.1f}"),
    ("cycle_ms", "cycle ms", "{:.1f}"),
    ("cycle_to_best_plan", "/ best", "{:.3f}"),
    ("cycle_to_design", "/ design", "{:.3f}"),
    ("cycle_to_own_requests", "/ own", "{:.3f}"),
    ("line_use", "use", "{:.2f}"),
    ("request_median", "request", "{:.3f}"),
    ("request_mean", "mean", "{:.3f}"),
    ("request_99", "99 %", "{:.3f}"),
    ("smallest_silence", "silence", "{:.2f}"),
)


def show(console: Console, one: dict[str, Any]) -> None:
    """Print the table of one family at one baud."""
    table = Table(
        title=f"{one['family']} at {one['baud']} baud: {one['values']} values in {one['requests']}"
        f" requests, limit {one['limit_ms']:.1f} ms",
        caption=f"The simulator itself ended replies {one['simulator_late_ms']['median']:.2f} ms"
        f" late (99 %: {one['simulator_late_ms']['99']:.2f} ms),"
        f" {100 * one['simulator_late_share']:.1f} % of the limit; nothing is subtracted.",
    )
    table.add_column("contestant", no_wrap=True)
    for _, title, _ in COLUMNS:
        table.add_column(title, justify="right")
    table.add_column("broken", justify="right")
    for row in one["contestants"]:
        cells = [form.format(row[key]) if row[key] else "-" for key, _, form in COLUMNS]
        broken = f"{row['broken_silences']} of {row['silences']}"
        table.add_row(row["contestant"], *cells, broken)
    console.print(table)


def show_blocks(console: Console, cells: Sequence[dict[str, Any]]) -> None:
    """Print what the best plan gains over one request a value."""
    table = Table(
        title="The whole monitoring set, as a share of the time of one request a value",
        caption=f"Peer: {ONE_BY_ONE}. The panel reads only its fast values in each cycle.",
    )
    for title in ("family", "baud", "by the limit", OURS, "panel's cycle"):
        table.add_column(title, justify="left" if title == "family" else "right")
    for one in cells:
        keys = ("limit_to_one_a_value", "ours_to_one_a_value", "panel_to_one_a_value")
        shares = (f"{one[key]:.2f}" if one[key] else "-" for key in keys)
        table.add_row(one["family"], str(one["baud"]), *shares)
    console.print(table)


def options() -> argparse.Namespace:
    """The options that were given."""
    parser = argparse.ArgumentParser(description="Cycle time of the monitoring set.")
    parser.add_argument("--families", default=FAMILIES)
    parser.add_argument("--bauds", default="9600,19200")
    parser.add_argument("--format", default="8E1", help="characters of the simulated line")
    parser.add_argument("--seconds", type=float, default=0.3, help="length of a run")
    parser.add_argument("--rounds", type=int, default=1, help="rounds of all contestants")
    return parser.parse_args()


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


def main() -> None:
    """Measure, print the tables, and all figures as JSON in the last line."""
    given = options()
    console = Console(width=150)
    wire, worker = WireLine(), Worker("from benchmarks.line import contest; contest()")
    contestants, missing = contestants_of(worker)
    cells = []
    try:
        for baud in map(int, given.bauds.split(",")):
            for family in given.families.split(","):
                timing = LineTiming(baud, given.format, True)
                one = cell(wire, family, timing, given.seconds)
                cells.append(measured(one, contestants, given.rounds))
                show(console, cells[-1])
    finally:
        worker.close()
        wire.close()
    show_blocks(console, cells)
    for name, reason in missing.items():
        console.print(f"{name} is missing: {reason}.")
    console.print(
        "Limit of an exchange: its characters, the drive's turnaround (which the simulator counts"
        " from the end of the request) and 3.5 silent characters before the next request."
        " '/ best': cycle to the limit of the best plan; '/ design': with one silence more an"
        " exchange, as the panel's planner counts; '/ own': to the limit of the requests that were"
        " sent. 'request': median from one request to the next inside a cycle, to the limit."
        " 'silence': the least that was kept, in units of 3.5 characters."
        " A silence that is broken costs nothing here; a real drive may miss the request."
        " The panel leaves a tenth of the line to its operator: its ratio to its own requests"
        " holds that pause, the ratios of its requests do not."
    )
    console.print(
        f"Characters of {given.format}. A pseudo-terminal has no parity: the peers open it"
        " without one, and the simulator keeps the time of the line."
    )
    print(json.dumps({"benchmark": "line", "cells": cells, "missing": missing}))


if __name__ == "__main__":
    main()
