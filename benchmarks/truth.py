"""Wrong values delivered on a faulty line: only 0 is acceptable.

    python -m benchmarks.truth [--full] [--processes N]

Every register holds a value of its own, so a value that is another's is seen. By a seeded plan,
replies of the line are late, lost, duplicated, truncated, corrupt, preceded by noise, from another
drive, or of another function or length. Some requests are cancelled on their way. What is written
is read back. Contestants get the same plans; those whose waits are long do fewer exchanges.

To make hundreds of thousands of exchanges in minutes the line has no baud rate and the waits are
short (timeout 50 ms, replies up to 120 ms late); one row is measured with the panel's usual times
on a paced line of 19200 baud, where replies come up to 1.2 s late.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import cast

from rich.console import Console
from rich.table import Table

from benchmarks.faulty_line import (
    DEVICES,
    LATE,
    MIXED,
    ROOT,
    Faults,
    FaultyLine,
    Setting,
    answered_right,
    value_of,
)
from benchmarks.wire import share
from tui.bus.errors import LineError, NoAnswer
from tui.bus.limits import Limits
from tui.bus.line import Line, Reply, Timing
from tui.bus.link import SerialLink
from tui.bus.program import Program
from tui.bus.share.place import SharePlace

TIME_OUT = 0.05
FAST = Timing(
    first_timeout=TIME_OUT,
    min_timeout=0.02,
    late_reply=0.3,
    back_off_first=0.005,
    back_off_longest=0.02,
    frame_gap=0.006,
)
WORDS = 8
CANCELLED = 0.03
WRITTEN = 0.02
SCRATCH = 60000
"""From this register on nothing is read but what was written there."""
WIDE = Limits(frozenset({3, 6, 16}), 125, 123, 0, 0, answers_all=True)
ALIKE = (3202, 2)
"""Register and words of the reads that all look alike, apart from their register."""


@dataclass(slots=True)
class Tally:
    """Results of a contestant; times in s."""

    name: str
    exchanges: int = 0
    good: int = 0
    wrong: int = 0
    errors: int = 0
    cancelled: int = 0
    seconds: float = 0.0
    time_out: float = TIME_OUT
    recoveries: list[float] = field(default_factory=list)
    """From the end of a failed exchange to the end of the next good one on the line."""
    _failing_since: float | None = None

    def note(self, answer: Sequence[int] | None, right: Sequence[int]) -> None:
        """Count one exchange; a missing reply is a reported error."""
        self.exchanges += 1
        if answer is None:
            self.errors += 1
            if self._failing_since is None:
                self._failing_since = time.monotonic()
            return
        if list(answer) != list(right):
            self.wrong += 1
            return
        self.good += 1
        if self._failing_since is not None:
            self.recoveries.append(time.monotonic() - self._failing_since)
            self._failing_since = None


@dataclass(frozen=True, slots=True)
class Job:
    """One contestant on one line."""

    contestant: str
    count: int
    seed: int = 1
    faults: Faults = MIXED
    slow_once: float = 0.0
    behind_from: int | None = None
    real: bool = False

    def setting(self) -> Setting:
        """The line of this job."""
        if self.behind_from is not None:
            return Setting(self.seed, behind_from=self.behind_from)
        if not self.real:
            return Setting(self.seed, self.faults, slow_once=self.slow_once)
        late = Faults(**(asdict(self.faults) | {"late_from": 0.2, "late_to": 1.2}))
        return Setting(self.seed, late, turnaround=0.005, character=11 / 19200)


def plan(seed: int, count: int) -> list[tuple[int, int, int]]:
    """Device, register and number of words of every read."""
    chance = random.Random(seed)
    return [
        (chance.choice(DEVICES), chance.randrange(SCRATCH - 200), chance.randrange(1, WORDS + 1))
        for _ in range(count)
    ]


def right(device: int, address: int, words: int) -> list[int]:
    """Values of these registers."""
    return [value_of(device, at) for at in range(address, address + words)]


# Contestants


async def attached(path: str, job: Job) -> Tally:
    """Our line as a program meets it that attached to the owner, itself idle."""
    with tempfile.TemporaryDirectory() as folder:
        place = SharePlace(path, Path(folder) / "lines", (Path(folder) / "run",))
        owner = Line(SerialLink(path, 115200, "8N1"), timing=FAST, place=place)
        owner.open(wait=5.0)
        try:
            return await ours(path, job, place)
        finally:
            owner.close()


async def ours(path: str, job: Job, place: SharePlace | None = None) -> Tally:
    """Our line: retries for each drive, some requests given up on their way, some writes."""
    link = SerialLink(path, 19200 if job.real else 115200, "8N1")
    timing = Timing(wire_time=True) if job.real else FAST
    line = Line(link, timing=timing, place=place, program=Program("contestant", "contestant"))
    tally = Tally(job.contestant, time_out=line.timing.first_timeout)
    for device in DEVICES:
        line.describe(device, WIDE)
    line.open(wait=5.0)
    chance = random.Random(job.seed)

    async def exchange(device: int, address: int, words: int) -> None:
        answer = None
        if chance.random() < CANCELLED:
            with suppress(TimeoutError, LineError):
                async with asyncio.timeout(chance.uniform(0.0, 0.01)):
                    await line.read(device, address, words)
            tally.cancelled += 1
            return
        with suppress(LineError):
            answer = (await requested(line, device, address, words)).words
        tally.note(answer, right(device, address, words))

    async def write(device: int, at: int) -> None:
        values = [chance.randrange(65536) for _ in range(2)]
        answer = None
        with suppress(LineError):
            await line.write(device, SCRATCH + 2 * at, values)
            answer = (await line.read(device, SCRATCH + 2 * at, 2)).words
        tally.note(answer, values)

    async def retrying(reads: list[tuple[int, int, int]], number: int) -> None:
        for at, read in enumerate(reads):
            if chance.random() < WRITTEN:
                await write(read[0], (4 * at + number) % 2000)
            else:
                await exchange(*read)

    reads = plan(job.seed, job.count)
    begun = time.monotonic()
    # each drive has a monitor of its own
    share = ([read for read in reads if read[0] == device] for device in DEVICES)
    await asyncio.gather(*(retrying(each, number) for number, each in enumerate(share)))
    tally.seconds = time.monotonic() - begun
    line.close()
    return tally


async def requested(line: Line, device: int, address: int, words: int) -> Reply:
    """A read that waits while the line leaves the device alone, as monitoring does."""
    while True:
        try:
            return await line.read(device, address, words)
        except NoAnswer as silence:
            if silence.retry_in is None:
                raise
            await asyncio.sleep(silence.retry_in)


async def pymodbus(path: str, job: Job, retries: int) -> Tally:
    """The protocol library's own client; the first of its reads in every hundred is cancelled."""
    from pymodbus.client import AsyncModbusSerialClient
    from pymodbus.exceptions import ModbusException

    tally = Tally(job.contestant)
    client = AsyncModbusSerialClient(path, baudrate=115200, timeout=TIME_OUT, retries=retries)
    await client.connect()
    begun_all = time.monotonic()
    for at, (device, address, words) in enumerate(_reads(job)):
        call = client.read_holding_registers(address, count=words, device_id=device)
        if job.faults == MIXED and not job.slow_once and at % 100 == 99:
            with suppress(TimeoutError, ModbusException):
                await asyncio.wait_for(call, 0.0002)
            tally.cancelled += 1
            continue
        answer: list[int] | None = None
        try:
            reply = await call
            answer = None if reply.isError() else list(reply.registers)
        except ModbusException:
            if not client.connected:
                await client.connect()
        tally.note(answer, right(device, address, words))
    tally.seconds = time.monotonic() - begun_all
    client.close()
    return tally


def minimalmodbus(path: str, job: Job, *, cleared: bool) -> Tally:
    """minimalmodbus, one instrument a device on one port."""
    import minimalmodbus as library

    tally = Tally(job.contestant)
    instruments = {}
    for device in DEVICES:
        instrument = library.Instrument(path, device)
        instrument.serial.baudrate = 115200
        instrument.serial.timeout = TIME_OUT
        instrument.clear_buffers_before_each_transaction = cleared
        instruments[device] = instrument
    begun_all = time.monotonic()
    for device, address, words in _reads(job):
        answer: list[int] | None = None
        with suppress(OSError, ValueError):
            answer = list(instruments[device].read_registers(address, words))
        tally.note(answer, right(device, address, words))
    tally.seconds = time.monotonic() - begun_all
    return tally


def _reads(job: Job) -> list[tuple[int, int, int]]:
    """The mixed reads; or, for late replies alone, reads that look alike, as polls do."""
    if job.faults == MIXED and not job.slow_once and job.behind_from is None:
        return plan(job.seed, job.count)
    return [(1, ALIKE[0] + at % 100, ALIKE[1]) for at in range(job.count)]


CONTESTANTS: dict[str, Callable[[str, Job], Tally]] = {
    "our line": lambda path, job: asyncio.run(ours(path, job)),
    "our line, attached": lambda path, job: asyncio.run(attached(path, job)),
    "pymodbus, its own retries": lambda path, job: asyncio.run(pymodbus(path, job, 3)),
    "pymodbus, no retries": lambda path, job: asyncio.run(pymodbus(path, job, 0)),
    "minimalmodbus": lambda path, job: minimalmodbus(path, job, cleared=True),
    "minimalmodbus, nothing cleared": lambda path, job: minimalmodbus(path, job, cleared=False),
}


# Running them


def run_job() -> None:
    """The process of one contestant: a job comes as the argument, its tally goes out as JSON."""
    reported = json.loads(sys.argv[1])
    job = Job(**(reported | {"faults": Faults(**reported["faults"])}))
    line = FaultyLine(job.setting())
    tally = CONTESTANTS[job.contestant](line.path, job)
    faults = line.close()
    print(json.dumps(asdict(tally) | {"faults": faults}))


def run(jobs: Sequence[Job], processes: int) -> list[dict[str, object]]:
    """Run jobs, so many at a time; returns their tallies in order."""
    code = "from benchmarks.truth import run_job; run_job()"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    reported: list[dict[str, object]] = []
    for first in range(0, len(jobs), processes):
        started = [
            subprocess.Popen(
                [sys.executable, "-c", code, json.dumps(asdict(job))],
                cwd=ROOT,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            for job in jobs[first : first + processes]
        ]
        for process in started:
            out, err = process.communicate()
            if process.returncode:
                last = err.strip().splitlines()[-1] if err.strip() else "it ended by itself"
                reported.append({"missing": last})
            else:
                reported.append(json.loads(out.splitlines()[-1]))
    return reported


def joined(name: str, parts: Sequence[dict[str, object]]) -> dict[str, object]:
    """Several tallies of one contestant as one."""
    whole = [part for part in parts if "missing" not in part]
    if not whole:
        return {"name": name, "missing": parts[0]["missing"]}
    sums = ("exchanges", "good", "wrong", "errors", "cancelled")
    figures: dict[str, object] = {key: sum(int(str(p[key])) for p in whole) for key in sums}
    recoveries = [float(r) for p in whole for r in p["recoveries"]]  # type: ignore[attr-defined]
    seconds = max(float(str(part["seconds"])) for part in whole)
    good = int(str(figures["good"])) / len(whole)
    correct = sum(answered_right(cast("dict[str, int]", part["faults"])) for part in whole)
    return figures | {
        "name": name,
        "through": int(str(figures["good"])) / max(1, correct),
        "good_per_second_of_one_line": good / seconds,
        "time_out": whole[0]["time_out"],
        "recovery_median": median(recoveries) if recoveries else None,
        "recovery_99": share(recoveries, 0.99),
        "recovery_worst": max(recoveries, default=None),
    }


def table_of(rows: Sequence[dict[str, object]]) -> Table:
    """The figures as a table; recovery as a multiple of the timeout in force."""
    table = Table(title="Wrong values on a faulty line")
    for name in (
        "contestant",
        "exchanges",
        "wrong",
        "wrong/answered",
        "through",
        "errors",
        "good/s",
    ):
        table.add_column(name, justify="left" if name == "contestant" else "right")
    for name in ("recovery median", "99 %", "worst"):
        table.add_column(name, justify="right")
    for row in rows:
        if "missing" in row:
            table.add_row(str(row["name"]), f"not measured: {row['missing']}")
            continue
        wrong, good = int(str(row["wrong"])), int(str(row["good"]))
        out = float(str(row["time_out"]))
        times = (row[f"recovery_{part}"] for part in ("median", "99", "worst"))
        table.add_row(
            str(row["name"]),
            str(row["exchanges"]),
            str(wrong),
            f"{wrong / max(1, wrong + good):.2%}",
            f"{float(str(row['through'])):.1%}",
            str(row["errors"]),
            f"{float(str(row['good_per_second_of_one_line'])):.0f}",
            *("-" if t is None else f"{float(str(t)) / out:.2f}" for t in times),
        )
    return table


def main() -> None:
    """Measure every contestant, print the table and one line of JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--full", action="store_true", help="200,000 exchanges of ours")
    parser.add_argument("--processes", type=int, default=2, metavar="N", help="lines at once")
    options = parser.parse_args()
    count, parts = (25_000, 8) if options.full else (2_500, 4)
    few = 2_000 if options.full else 600
    others = [name for name in CONTESTANTS if not name.startswith("our line")]
    cases: list[tuple[str, list[Job]]] = [
        ("our line, mixed faults", [Job("our line", count, seed) for seed in range(parts)]),
        (
            "our line, attached",
            [Job("our line, attached", count, seed) for seed in range(parts)],
        ),
        ("our line, usual times at 19200", [Job("our line", few // 2, 99, real=True)]),
        *((f"{name}, mixed faults", [Job(name, few, 99)]) for name in others),
        ("our line, 15 % late", [Job("our line", few, 5, LATE)]),
        *((f"{name}, 15 % late", [Job(name, few, 5, LATE)]) for name in others),
        ("our line, one slow reply", [Job("our line", 60, 7, slow_once=0.12)]),
        *((f"{name}, one slow reply", [Job(name, 60, 7, slow_once=0.12)]) for name in others),
        ("our line, one behind", [Job("our line", 300, seed, behind_from=0) for seed in range(2)]),
        ("our line, one behind later", [Job("our line", 300, 7, behind_from=150)]),
        *((f"{name}, one behind", [Job(name, 60, 7, behind_from=0)]) for name in others),
    ]
    rows = [joined(name, run(jobs, options.processes)) for name, jobs in cases]
    Console(width=120).print(table_of(rows))
    print(json.dumps({"benchmark": "truth", "rows": rows}))


if __name__ == "__main__":
    main()
