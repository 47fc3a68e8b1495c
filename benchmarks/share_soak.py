"""Programs that share a line, stall and are killed: wrong values, repeated writes, leftovers.

    python -m benchmarks.share_soak [--minutes N] [--seed N] [--late SHARE] [--twice SHARE]

Some programs share the faulty line of `truth`: each reads registers that hold a value of their own,
writes words that no other program writes, reads them back, and occasionally stops a drive, which
cancels pending writes of the others. In turn, each is frozen for up to 4 s, terminated, or killed;
every third kill hits the owner of the line while it writes. Each one that ended is replaced. Wrong
are a value that is another's, a word read back that was not written, and a write that reached the
line twice.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.faulty_line import (
    DEVICES,
    ROOT,
    Faults,
    FaultyLine,
    Setting,
    answered_right,
    value_of,
)
from benchmarks.truth import FAST, SCRATCH, WIDE, requested, right
from tui.bus.api import Priority
from tui.bus.errors import LineError
from tui.bus.line import Line, Timing
from tui.bus.link import SerialLink
from tui.bus.program import Program
from tui.bus.share.place import SharePlace, owner_of

PROGRAMS = 4
WRITTEN, STOPPED = 0.15, 0.01
"""Shares of what a program does."""
AGES = (0.0, 0.0, 0.2)
"""Greatest ages in s that the reads accept."""
FAULTS = Faults(late=0.02, lost=0.01, duplicated=0.0, corrupted=0.02, noise=0.01)
"""No reply comes twice unless requested: RTU cannot show that the first copy on a line is one (see
`truth`). The next owner gets the earlier ones.
"""
TIMING = replace(FAST, late_reply=Timing().late_reply, frame_gap=Timing().frame_gap)
"""Quick, but for what comes late because the computer is busy with all these programs."""
FROZEN = (0.1, 4.0)
PAUSE = (0.5, 2.0)
"""Seconds from one blow to the next."""
HIT = {"replies late": "late", "replies twice": "duplicated"}
CODE = "from benchmarks.share_soak import program; program()"


# A program on the line


def place_in(folder: str, path: str) -> SharePlace:
    """Folder in which the programs meet."""
    return SharePlace(path, Path(folder) / "lines", (Path(folder) / "run",))


def program() -> None:
    """Do what the first input line says until the input ends; print a count each second."""
    reported = json.loads(sys.stdin.readline())
    asyncio.run(_Guest(reported["path"], reported["folder"], reported["number"]).run())


class _Guest:
    """One program: reads, writes and stops at random on every drive at once."""

    def __init__(self, path: str, folder: str, number: int) -> None:
        self.counts = Counter[str]()
        self._number = number
        self._chance = random.Random(number)
        self._written = 0
        self._me = me = Program(f"p{number}-{os.getpid()}", f"p{number}", os.getpid())
        link = SerialLink(path, 115200, "8N1")
        self._line = Line(link, timing=TIMING, place=place_in(folder, path), program=me)

    async def run(self) -> None:
        """Work until the input ends."""
        for device in DEVICES:
            self._line.describe(device, WIDE)
        await asyncio.to_thread(self._line.open, wait=30)
        works = [asyncio.create_task(self._work(device)) for device in DEVICES]
        works.append(asyncio.create_task(self._tell()))
        await asyncio.to_thread(sys.stdin.read)
        for work in works:
            work.cancel()
        self._line.close()
        print(json.dumps(self.counts), flush=True)

    async def _tell(self) -> None:
        while True:
            await asyncio.sleep(1.0)
            print(json.dumps(self.counts), flush=True)

    async def _work(self, device: int) -> None:
        while True:
            drawn = self._chance.random()
            if drawn < STOPPED:
                await self._stop(device)
            elif drawn < STOPPED + WRITTEN:
                await self._write(device)
            else:
                await self._read(device)

    async def _read(self, device: int) -> None:
        address, words = self._chance.randrange(SCRATCH - 200), self._chance.randrange(1, 9)
        age = self._chance.choice(AGES)
        try:
            reply = await self._line.read(device, address, words, max_age=age)
        except LineError as error:
            await self._fail(error)
        else:
            self._note("read", device, address, list(reply.words), right(device, address, words))

    async def _write(self, device: int) -> None:
        self._written += 1
        values = [self._number, self._written & 0xFFFF]
        address = SCRATCH + 2 * self._number
        try:
            await self._line.write(device, address, values)
        except LineError as error:
            self.counts["writes that failed"] += 1
            await self._fail(error)
            return
        self.counts["writes"] += 1
        with suppress(LineError):
            held = (await requested(self._line, device, address, 2)).words
            self._note("written", device, address, list(held), values)

    def _note(self, what: str, device: int, address: int, got: list[int], due: list[int]) -> None:
        self.counts["good" if got == due else "wrong"] += 1
        if got != due:
            whose = [(number, _address_of(number, got[0])) for number in DEVICES]
            reported = (
                f"{self._me.name} {what} {device}/{address}: {got}, not {due}; may be {whose}"
            )
            print(reported, file=sys.stderr, flush=True)

    async def _stop(self, device: int) -> None:
        self._line.facts.give_stop([device], "a soak")
        with suppress(LineError):
            await self._line.write(device, SCRATCH, [0], priority=Priority.STOP)
            self.counts["stops"] += 1

    async def _fail(self, error: LineError) -> None:
        self.counts["errors"] += 1
        await asyncio.sleep(getattr(error, "retry_in", None) or 0.01)


def _address_of(device: int, word: int) -> int:
    """The register of a drive that holds a word from the beginning."""
    return ((word - value_of(device, 0)) * pow(value_of(0, 1), -1, 1 << 16)) & 0xFFFF


# The source of the blows


@dataclass(slots=True)
class _Guests:
    """The running programs, and the reports of those that ended."""

    path: str
    folder: str
    there: list[subprocess.Popen[str]] = field(default_factory=list)
    reported: dict[int, dict[str, int]] = field(default_factory=dict)
    begun: int = 0

    def begin(self) -> None:
        """Let one more come."""
        self.begun += 1
        process = subprocess.Popen(
            [sys.executable, "-c", CODE],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdin is not None
        job = {"path": self.path, "folder": self.folder, "number": self.begun}
        process.stdin.write(json.dumps(job) + "\n")
        process.stdin.flush()
        self.there.append(process)
        threading.Thread(target=self._listen, args=(process,), daemon=True).start()

    def _listen(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            with suppress(ValueError):  # a line that a kill cut off
                self.reported[process.pid] = json.loads(line)

    def end(self, process: subprocess.Popen[str], blow: str) -> None:
        """Kill one, or let it end."""
        self.there.remove(process)
        if blow == "ended":
            assert process.stdin is not None
            process.stdin.close()
        else:
            process.kill()
        with suppress(subprocess.TimeoutExpired):
            process.wait(20)

    def owner(self) -> subprocess.Popen[str] | None:
        """The owner of the line."""
        found = owner_of(place_in(self.folder, self.path))
        return next(
            (process for process in self.there if found and process.pid == found.program.pid), None
        )


def strike(guests: _Guests, chance: random.Random, done: Counter[str]) -> None:
    """One blow, and a replacement for a program that it ended."""
    drawn = chance.random()
    if drawn < 0.55:
        frozen = chance.choice(guests.there)
        frozen.send_signal(signal.SIGSTOP)
        time.sleep(chance.uniform(*FROZEN))
        frozen.send_signal(signal.SIGCONT)
        done["frozen"] += 1
        return
    struck = guests.owner() if drawn < 0.85 else None
    blow = "killed" if drawn < 0.9 else "ended"
    done["owners killed" if struck else blow] += 1
    guests.end(struck or chance.choice(guests.there), blow)
    guests.begin()


def soak(minutes: float, seed: int, faults: Faults = FAULTS) -> dict[str, object]:
    """Run the soak and return its result."""
    chance, done = random.Random(seed), Counter[str]()
    faulty = FaultyLine(Setting(seed, faults, turnaround=0.002))
    with tempfile.TemporaryDirectory() as folder:
        guests = _Guests(faulty.path, folder)
        for _ in range(PROGRAMS):
            guests.begin()
        end = time.monotonic() + 60 * minutes
        while time.monotonic() < end:
            time.sleep(chance.uniform(*PAUSE))
            strike(guests, chance, done)
        for process in list(guests.there):
            guests.end(process, "ended")
        left = [path.name for path in Path(folder).rglob("*.s*")]
    on_line = faulty.close()
    correct = answered_right(on_line)
    sums = sum((Counter(reported) for reported in guests.reported.values()), Counter[str]())
    return {
        **{name: sums[name] for name in ("good", "wrong", "errors", "writes", "stops")},
        "good, % of correct replies": round(100 * sums["good"] / max(1, correct), 1),
        **{name: on_line[kind] for name, kind in HIT.items() if kind in on_line},
        "written twice": on_line.pop("written again", 0),
        "sockets left": len(left),
        "ms that a reply was behind its time": on_line.pop("ms behind time", 0),
        "programs": guests.begun,
        **done,
        "exchanges": sum(on_line.values()),
    }


def main() -> None:
    """Soak, print the table and one line of JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--late", type=float, default=FAULTS.late, help="share of late replies")
    parser.add_argument("--twice", type=float, default=0.0, help="share that comes once more")
    options = parser.parse_args()
    faults = replace(FAULTS, late=options.late, duplicated=options.twice)
    found = soak(options.minutes, options.seed, faults)
    table = Table(title=f"{options.minutes:g} minutes, {PROGRAMS} programs at a time")
    table.add_column("")
    table.add_column("count", justify="right")
    for name, count in found.items():
        table.add_row(name, str(count))
    Console(width=100).print(table)
    print(json.dumps({"benchmark": "share_soak", "minutes": options.minutes, **found}))


if __name__ == "__main__":
    main()
