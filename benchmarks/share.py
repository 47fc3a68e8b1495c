"""Cost of sharing a line: a request, a stop and the load of programs attached to its owner.

    python -m benchmarks.share [--requests N] [--stops N] [--seconds S]

A simulated line of 19200 baud in a process of its own notes every exchange. One process owns it;
others attach over the local socket. Compared are, in one run:

- the same read by the owner and by an attached program, one after the other, nothing else going on
  (the difference, and its share of a cycle of the default monitoring set);
- a stop by an attached program while three others and the owner poll as fast as they can: from the
  call to the last byte of the stop frame, against the longest exchange of that load with its
  silence and the frame itself, which is the limit; the same stop by the owner;
- monitors of one period on 31 drives in one program, and in eight at once: requests on the wire.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import random
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.fleet import fleet
from benchmarks.wire import Exchange, Record, WireLine, Worker, share
from tui.bus.api import Priority
from tui.bus.errors import LineError
from tui.bus.line import Line
from tui.bus.link import parse_link
from tui.bus.program import Program
from tui.bus.share.place import SharePlace
from tui.drive.profile.library import load
from tui.session.connect.limits import limits_of
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import Monitor
from tui.simulator import LineTiming

STATUS = 3201
COMMAND = 8501
HALT = 0x0006
"""Moves nothing: the word that a stop of a drive at rest may be."""
CODE = "from benchmarks.share import program; program()"


# One program on the line


def program() -> None:
    """Open or attach to the line of the first job, then do one job after another."""
    first = json.loads(sys.stdin.readline())
    folder = Path(first["folder"])
    place = SharePlace(first["text"], folder / "lines", (folder / "run",))
    line = Line(
        parse_link(first["text"]), place=place, program=Program(first["name"], first["name"])
    )
    line.open(wait=10.0)
    drives = {int(address): family for address, family in first["drives"].items()}
    for address, family in drives.items():
        line.describe(address, limits_of(load(family)))
    attached = line.facts.voice is not None and bool(line.facts.others)
    print(json.dumps({"attached": attached}), flush=True)
    monitors: list[Monitor] = []
    for reported in sys.stdin:
        job = json.loads(reported)
        answer: dict[str, Any] = {}
        match job["do"]:
            case "reads":
                answer = {"seconds": asyncio.run(_reads(line, job["device"], job["count"]))}
            case "load":
                line.spawn(lambda: _load(line, list(drives)), "load")
            case "stops":
                answer = {"called": asyncio.run(_stops(line, job["device"], job["count"]))}
            case "watch":
                for address, family in drives.items():
                    monitor = Monitor(DriveSession(line, address, load(family)))
                    monitor.start(period=job["period"])
                    monitors.append(monitor)
            case "cycles":
                answer = {"cycles": [item.latest.cycle if item.latest else 0 for item in monitors]}
        print(json.dumps(answer), flush=True)
    line.close()


async def _reads(line: Line, device: int, count: int) -> list[float]:
    """Seconds of each of so many reads of one word."""
    taken = []
    for _ in range(count):
        begun = time.perf_counter()
        await line.read(device, STATUS, priority=Priority.OPERATOR_READ)
        taken.append(time.perf_counter() - begun)
    return taken


async def _load(line: Line, devices: list[int]) -> None:
    """Poll each drive again and again."""

    async def poll(device: int) -> None:
        while True:
            with suppress(LineError):
                await line.read(device, STATUS, 8)
            await asyncio.sleep(0)

    await asyncio.gather(*(poll(device) for device in devices))


async def _stops(line: Line, device: int, count: int) -> list[float]:
    """When each of so many stops was given, on the machine's monotonic clock."""
    called = []
    for _ in range(count):
        await asyncio.sleep(random.uniform(0.05, 0.2))
        called.append(time.monotonic())
        line.facts.give_stop([device], "a benchmark")
        await line.write(device, COMMAND, [HALT], priority=Priority.STOP)
    return called


# The measurements


class Programs:
    """Programs on one line, the first of them its owner."""

    def __init__(self, wire: WireLine, drives: dict[int, str], count: int) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self.all: list[Worker] = []
        for number in range(count):
            worker = Worker(CODE)
            reported = worker.ask(
                text=wire.text, folder=self._folder.name, name=f"p{number}", drives=drives
            )
            if reported["attached"] != bool(number):
                raise RuntimeError("the programs of the benchmark do not share their line")
            self.all.append(worker)

    def close(self) -> None:
        """End all, the owner last."""
        for worker in reversed(self.all):
            worker.close()
        self._folder.cleanup()


def one_request(wire: WireLine, count: int) -> dict[str, float]:
    """Medians of one read by the owner and by an attached program, in ms."""
    drives = {1: "atv71"}
    wire.set_up(drives, LineTiming(19200, "8E1", True))
    programs = Programs(wire, drives, 2)
    owner, client = programs.all
    try:
        owner.ask(do="reads", device=1, count=10)
        taken: dict[str, list[float]] = {"owner": [], "attached": []}
        for _ in range(10):  # in turns: what else the machine does hits both
            for name, worker in (("owner", owner), ("attached", client)):
                reported = worker.ask(do="reads", device=1, count=count // 10)
                taken[name] += reported["seconds"]
        wire.take()
    finally:
        programs.close()
    profile = load("atv71")
    monitoring = len(profile.data.monitoring.values)
    cycle = wire.times.read(1, monitoring)
    own, other = (median(taken[name]) for name in ("owner", "attached"))
    return {
        "owner_ms": 1e3 * own,
        "attached_ms": 1e3 * other,
        "more_ms": 1e3 * (other - own),
        "more_of_cycle": (other - own) / cycle,
        "attached_95_ms": 1e3 * (share(taken["attached"], 0.95) or 0.0),
        "owner_95_ms": 1e3 * (share(taken["owner"], 0.95) or 0.0),
    }


def stops_under_load(wire: WireLine, count: int, *, by_owner: bool) -> dict[str, float]:
    """From the call of a stop to the last byte of its frame, over the limit."""
    drives = {1: "atv71", 2: "atv71", 3: "atv312", 4: "atv31"}
    wire.set_up(drives, LineTiming(19200, "8E1", True))
    programs = Programs(wire, drives, 5)
    owner, giver, *others = programs.all
    try:
        for worker in (owner, *others):
            worker.ask(do="load")
        time.sleep(1.0)
        wire.take()
        stopper = owner if by_owner else giver
        called = stopper.ask(do="stops", device=1, count=count)["called"]
        exchanges = wire.take()
    finally:
        programs.close()
    frames = [e for e in exchanges if _is_stop(e)]
    record = Record(wire.times, exchanges)
    longest = max(wire.times.shortest(e) for e in exchanges if e.size and not _is_stop(e))
    frame = 8 * wire.times.character
    waits = []
    for at in called:
        after = next((e for e in frames if e.began >= at), None)
        if after is not None:
            waits.append(after.began + frame - at)
    return {
        "stops": len(called),
        "seen": len(waits),
        "limit_ms": 1e3 * (longest + frame),
        "median_of_limit": median(waits) / (longest + frame),
        "worst_of_limit": max(waits) / (longest + frame),
        "line_use": record.use(),
    }


def _is_stop(exchange: Exchange) -> bool:
    request = exchange.request
    return request[:2] == bytes([1, 6]) and int.from_bytes(request[2:4], "big") == COMMAND


def monitors(wire: WireLine, count: int, seconds: float, period: float) -> dict[str, float]:
    """Requests a second on the wire with so many programs that watch all of 31 drives."""
    drives = fleet(31)
    wire.set_up(drives, LineTiming(19200, "8E1", True))
    programs = Programs(wire, drives, count)
    try:
        for worker in programs.all:
            worker.ask(do="watch", period=period)
        time.sleep(3 * period)
        wire.take()
        before = [worker.ask(do="cycles")["cycles"] for worker in programs.all]
        begun = time.monotonic()
        time.sleep(seconds)
        exchanges = wire.take()
        after = [worker.ask(do="cycles")["cycles"] for worker in programs.all]
        span = time.monotonic() - begun
    finally:
        programs.close()
    cycles = [
        (b - a) / span
        for x, y in zip(before, after, strict=True)
        for a, b in zip(x, y, strict=True)
    ]
    return {
        "programs": count,
        "requests_a_second": len(exchanges) / span,
        "line_use": Record(wire.times, exchanges).use(),
        "cycles_a_second_median": median(cycles),
        "cycles_a_second_least": min(cycles),
    }


def main() -> None:
    """Measure, print tables, and all figures as JSON in the last line."""
    parser = argparse.ArgumentParser(description="A line that several programs share.")
    parser.add_argument("--requests", type=int, default=400)
    parser.add_argument("--stops", type=int, default=60)
    parser.add_argument("--seconds", type=float, default=20.0)
    given = parser.parse_args()
    wire = WireLine()
    try:
        request = one_request(wire, given.requests)
        stops = {
            name: stops_under_load(wire, given.stops, by_owner=by_owner)
            for name, by_owner in (("by the owner", True), ("by an attached program", False))
        }
        watched = [monitors(wire, count, given.seconds, 10.0) for count in (1, 8)]
    finally:
        wire.close()
    console = Console()
    table = Table(title="One read at 19200 baud, ms")
    for name in ("by", "median", "95 %"):
        table.add_column(name)
    table.add_row("the owner", f"{request['owner_ms']:.2f}", f"{request['owner_95_ms']:.2f}")
    table.add_row(
        "an attached program", f"{request['attached_ms']:.2f}", f"{request['attached_95_ms']:.2f}"
    )
    console.print(table)
    console.print(
        f"Attached: {request['more_ms']:+.2f} ms,"
        f" {100 * request['more_of_cycle']:+.1f} % of a cycle."
    )
    table = Table(title="A stop while four programs fill the line, of the limit")
    for name in ("stop", "seen", "limit, ms", "median", "worst", "line use"):
        table.add_column(name)
    for name, row in stops.items():
        table.add_row(
            name, f"{row['seen']:.0f} of {row['stops']:.0f}", f"{row['limit_ms']:.1f}",
            f"{row['median_of_limit']:.2f}", f"{row['worst_of_limit']:.2f}",
            f"{row['line_use']:.2f}",
        )  # fmt: skip
    console.print(table)
    table = Table(title="Monitors of 31 drives, a cycle each 10 s")
    for name in ("programs", "requests/s", "line use", "cycles/s median", "least"):
        table.add_column(name)
    for row in watched:
        table.add_row(
            f"{row['programs']:.0f}", f"{row['requests_a_second']:.1f}", f"{row['line_use']:.2f}",
            f"{row['cycles_a_second_median']:.3f}", f"{row['cycles_a_second_least']:.3f}",
        )  # fmt: skip
    console.print(table)
    print(
        json.dumps({"benchmark": "share", "request": request, "stops": stops, "watched": watched})
    )


if __name__ == "__main__":
    main()
