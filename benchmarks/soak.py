"""The panel's side of a line over a long time: wrong values, recoveries, memory.

    python -m benchmarks.soak [--minutes N] [--peer] [--seed N]

Sessions monitor five drives as the panel does, with its line_watch, on a faulty line in real time,
and an operator reads now and then, sometimes giving up on it. Every register that can have one
holds a value of its own, so that each reading is checked. With `--peer` the drives are libmodbus
servers that answer late on purpose, every third time twice: over RTU on pseudo-terminals (which
have no baud) and, at the same time, over Modbus TCP.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from statistics import mean, median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks import soak_peers
from benchmarks.soak_drives import FAMILIES, Prepared, Values, prepare
from benchmarks.wire import share
from tui.bus.errors import LineError
from tui.bus.line import Line, Timing
from tui.bus.link import parse_link
from tui.drive.profile.library import load
from tui.session.drive import DriveSession
from tui.session.monitor.line_watch import LineWatch
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.snapshot import Snapshot
from tui.session.read.reader import Reader
from tui.session.shown import Shown

PERIOD = 0.5
"""Wished cycle of each monitor in s, the panel's usual one."""
EXTRAS = 8
"""Codes of each drive that are read beside its monitoring set, as seldom as slow values."""
OPERATOR = 1.0
"""Seconds from one operator's read to the next."""
CODES = 4
"""Codes of each of these."""
IMPATIENT = 0.25
"""Share of these that are given up after at most `GIVEN_UP` seconds."""
GIVEN_UP = 0.1
KEPT = 50
"""Wrong values that are printed in full."""
BEFORE, AFTER = 2.5, 0.05
"""Seconds before and after a wrong value for which frames are printed."""
SAMPLES = 9
"""Least number of looks at the memory; else one a minute."""


@dataclass(slots=True)
class Tally:
    """Result of one line; counts, and times in s."""

    good: int = 0
    wrong: int = 0
    refused: int = 0
    cycles: int = 0
    failed_cycles: int = 0
    operator_reads: int = 0
    operator_errors: int = 0
    given_up: int = 0
    recoveries: list[float] = field(default_factory=list)
    """From a failed cycle of a drive to its next good one."""
    errors: dict[str, int] = field(default_factory=dict)
    """Kinds of errors of an operator's reads."""
    wrong_ones: list[dict[str, object]] = field(default_factory=list)


class Watched:
    """One line with the sessions on it; its readings are checked as they come."""

    def __init__(self, served: soak_peers.Served, values: Values, seed: int) -> None:
        self.served = served
        self.tally = Tally()
        self.line = Line(parse_link(served.text), timing=Timing(wire_time=True))
        self._values = values
        self._owners = {raw: (d, code) for d, own in values.items() for code, raw in own.items()}
        self._began = time.monotonic()
        self._chance = random.Random(seed)
        self._times: dict[tuple[int, str], float] = {}
        self._failing: dict[int, float] = {}
        self._sessions = {
            device: DriveSession(self.line, device, load(FAMILIES[device]))
            for device in served.devices
        }
        self._monitors = {d: Monitor(session) for d, session in self._sessions.items()}
        self._keeper = LineWatch(self.line)

    def start(self) -> None:
        """Open the line and watch all drives."""
        self.line.open(wait=5.0)
        for device, session in self._sessions.items():
            monitor = self._monitors[device]
            self._keeper.keep(session, monitor)
            monitor.listen(partial(self._see, device))
            own = sorted(self._values[device])
            monitor.start(period=PERIOD, extra=self._chance.sample(own, EXTRAS))

    def close(self) -> None:
        """Let the drives go and close the line."""
        for monitor in self._monitors.values():
            monitor.stop()
        self._keeper.stop()
        self.line.close()

    def _see(self, device: int, snapshot: Snapshot) -> None:
        """A cycle has ended; runs in the line's thread."""
        self.tally.cycles += 1
        if snapshot.error:
            self.tally.failed_cycles += 1
            self._failing.setdefault(device, snapshot.time)
        elif device in self._failing:
            self.tally.recoveries.append(snapshot.time - self._failing.pop(device))
        for code, reading in snapshot.readings.items():
            if self._times.get((device, code)) != reading.time:
                self._times[device, code] = reading.time
                self._check(device, code, reading, snapshot.block)

    def _check(self, device: int, code: str, reading: Shown, way: str) -> None:
        want = self._values[device].get(code)
        if want is None:
            return
        if reading.raw is None:
            self.tally.refused += 1
        elif reading.raw == want:
            self.tally.good += 1
        else:
            self.tally.wrong += 1
            if len(self.tally.wrong_ones) < KEPT:
                self.tally.wrong_ones.append(
                    {
                        "second": round(time.monotonic() - self._began, 3),
                        "device": device,
                        "code": code,
                        "got": reading.raw,
                        "want": want,
                        "belongs_to": self._owners.get(reading.raw),
                        "way": way,
                        "frames": self._frames(reading.time),
                    }
                )

    def _frames(self, time: float) -> list[str]:
        """Frames on the line before a reply that ended at this time."""
        return [
            f"{frame.time - time:+.4f} {frame.direction} {frame.data.hex()} {frame.note}".strip()
            for frame in self.line.trace
            if time - BEFORE <= frame.time <= time + AFTER
        ]

    async def operate(self) -> None:
        """Read as an operator does, until it is cancelled."""
        while True:
            device = self._chance.choice(list(self._sessions))
            codes = self._chance.sample(sorted(self._values[device]), CODES)
            impatient = self._chance.random() < IMPATIENT
            limit = self._chance.uniform(0.0, GIVEN_UP) if impatient else None
            await self._operate_once(device, codes, limit)
            await asyncio.sleep(OPERATOR)

    async def _operate_once(self, device: int, codes: Sequence[str], limit: float | None) -> None:
        self.tally.operator_reads += 1
        try:
            async with asyncio.timeout(limit):
                found = await Reader(self._sessions[device]).read(codes)
        except TimeoutError:
            self.tally.given_up += 1
        except LineError as error:
            kind = type(error).__name__
            self.tally.operator_errors += 1
            self.tally.errors[kind] = self.tally.errors.get(kind, 0) + 1
        else:
            for code, reading in found.items():
                self._check(device, code, reading, "operator")

    def figures(self) -> dict[str, Any]:
        """All counts, with the line's own."""
        reported = asdict(self.tally)
        recoveries = reported.pop("recoveries")
        return reported | {
            "line": self.served.name,
            "recoveries": len(recoveries),
            "recovery_median_s": median(recoveries) if recoveries else None,
            "recovery_99_s": share(recoveries, 0.99),
            "recovery_worst_s": max(recoveries, default=None),
            "failing_at_the_end": sorted(self._failing),
            "counters": asdict(self.line.counters),
            "made": self.served.made,
        }


# Memory


@dataclass(frozen=True, slots=True)
class Sample:
    """Resources of this process at a time in s since the start; memory in bytes."""

    second: float
    memory: int | None
    threads: int
    handles: int | None


def sample(began: float) -> Sample:
    """Current resources of this process; None if the system does not report them."""
    memory = handles = None
    with suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        memory = pages * os.sysconf("SC_PAGE_SIZE")
        handles = len(os.listdir("/proc/self/fd"))
    return Sample(time.monotonic() - began, memory, threading.active_count(), handles)


def growth(samples: Sequence[Sample]) -> float | None:
    """Mean memory of the last third over that of the middle third."""
    memory = [sample.memory for sample in samples if sample.memory is not None]
    third = len(memory) // 3
    return mean(memory[-third:]) / mean(memory[third:-third]) if third else None


# Running it


@contextmanager
def peers(wanted: bool, seed: int, prepared: Prepared) -> Iterator[list[soak_peers.Served]]:
    """The lines to poll; raises MissingPeer."""
    with ExitStack() as stack:
        if not wanted:
            yield [stack.enter_context(soak_peers.simulated(seed))]
            return
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        program = soak_peers.build(Path(folder))
        serving = (soak_peers.libmodbus_serial, soak_peers.libmodbus_tcp)
        yield [stack.enter_context(serve(program, prepared)) for serve in serving]


async def soak(lines: Sequence[Watched], seconds: float) -> list[Sample]:
    """Run for this time and sample the memory."""
    operators = [asyncio.create_task(watched.operate()) for watched in lines]
    began = time.monotonic()
    samples = [sample(began)]
    pause = min(60.0, seconds / SAMPLES)
    while samples[-1].second < seconds - pause / 2:
        await asyncio.sleep(began + pause * len(samples) - time.monotonic())
        samples.append(sample(began))
    for operator in operators:
        operator.cancel()
    await asyncio.gather(*operators, return_exceptions=True)
    return samples


# What is printed

ROWS: Mapping[str, str] = {
    "wrong values": "wrong",
    "good values": "good",
    "values refused": "refused",
    "cycles": "cycles",
    "cycles that failed": "failed_cycles",
    "operator's reads": "operator_reads",
    "of these given up": "given_up",
    "of these with an error": "operator_errors",
    "recoveries of a drive": "recoveries",
}
TIMES: Mapping[str, str] = {
    "recovery, median, s": "recovery_median_s",
    "recovery, 99 %, s": "recovery_99_s",
    "recovery, worst, s": "recovery_worst_s",
}
COUNTERS: Mapping[str, str] = {
    "requests": "requests",
    "replies": "replies",
    "timeouts": "timeouts",
    "damaged": "checksum",
    "wrong replies told": "wrong",
    "replies found again": "resyncs",
    "replies thrown away": "stale",
}


def show(console: Console, found: Mapping[str, Any]) -> None:
    """Print the table."""
    table = Table(title=f"{found['minutes']:g} minutes, seed {found['seed']}")
    table.add_column("")
    for item in found["lines"]:
        table.add_column(item["line"], justify="right")
    for title, key in ROWS.items():
        table.add_row(title, *(str(item[key]) for item in found["lines"]))
    for title, key in TIMES.items():
        cells = ("-" if item[key] is None else f"{item[key]:.2f}" for item in found["lines"])
        table.add_row(title, *cells)
    for title, key in COUNTERS.items():
        table.add_row(title, *(str(item["counters"][key]) for item in found["lines"]))
    made = (", ".join(f"{k} {n}" for k, n in item["made"].items()) for item in found["lines"])
    table.add_row("made by the line", *made)
    console.print(table)
    for item in found["lines"]:
        for wrong in item["wrong_ones"]:
            reported = {key: value for key, value in wrong.items() if key != "frames"}
            console.print(f"wrong on {item['line']}: {reported}", *wrong["frames"], sep="\n    ")
    show_memory(console, found)


def show_memory(console: Console, found: Mapping[str, Any]) -> None:
    """Print what the process held over time."""
    samples = found["samples"]
    first, last = samples[0], samples[-1]
    if found["growth"] is not None:
        reported = " ".join(f"{sample['memory'] / 1e6:.1f}" for sample in samples)
        console.print(f"Memory, MB, every {samples[1]['second']:.0f} s: {reported}")
        console.print(f"Memory of the last third over the middle third: {found['growth']:.4f}.")
    console.print(
        f"Threads {first['threads']} to {last['threads']},"
        f" file descriptors {first['handles']} to {last['handles']}."
    )


def main() -> None:
    """Soak, print the table, and all figures as JSON in the last line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--peer", action="store_true", help="libmodbus servers that answer late")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    console = Console(width=120)
    prepared = prepare(given.seed)
    result: dict[str, Any] = {"benchmark": "soak", "minutes": given.minutes, "seed": given.seed}
    try:
        with peers(given.peer, given.seed, prepared) as served:
            lines = [Watched(item, prepared.values, given.seed) for item in served]
            try:
                for watched in lines:
                    watched.start()
                samples = asyncio.run(soak(lines, 60 * given.minutes))
            finally:
                for watched in lines:
                    watched.close()
    except soak_peers.MissingPeer as missing:
        console.print(f"The peer is missing: {missing}.")
        print(json.dumps({**result, "missing": str(missing)}))
        return
    result |= {
        "checked": {str(device): len(own) for device, own in prepared.values.items()},
        "faults": soak_peers.fault_report(),
        "lines": [watched.figures() for watched in lines],
        "samples": [asdict(sample) for sample in samples],
        "growth": growth(samples),
    }
    show(console, result)
    print(json.dumps(result))


if __name__ == "__main__":
    main()
