"""A simulated line in its own process that records every exchange, and figures from it.

As a program it serves one simulated line at a time, controlled by JSON lines on its input.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

from tui.simulator import DriveSpec, LineTiming, Simulation
from tui.simulator.server.conversation import RtuConversation
from tui.simulator.server.endpoints import PtyEndpoint

ROOT = Path(__file__).resolve().parents[1]


@dataclass(slots=True)
class Exchange:
    """One request at the line and its reply; times of the monotonic clock in s, sizes in bytes."""

    began: float
    """When its first bytes came in."""
    request: bytes
    ended: float = 0.0
    """When the last byte of the reply was out; 0 without a reply."""
    size: int = 0
    """Bytes of the reply."""


class Recording:
    """A conversation of the simulator, with a record of what went through it."""

    def __init__(self, conversation: RtuConversation) -> None:
        self._conversation = conversation
        self.exchanges: list[Exchange] = []
        self._answered = True

    def feed(self, data: bytes, now: float) -> None:
        """Take bytes that have just come in."""
        if self._answered or not self.exchanges or len(self.exchanges[-1].request) >= 8:
            self.exchanges.append(Exchange(now, data))
            self._answered = False
        else:
            self.exchanges[-1].request += data
        self._conversation.feed(data, now)

    def poll(self, now: float) -> bytes:
        """The bytes that are due to be written by now."""
        out = self._conversation.poll(now)
        if out and self.exchanges:
            self.exchanges[-1].ended = now
            self.exchanges[-1].size += len(out)
            self._answered = True
        return out

    @property
    def due(self) -> float | None:
        """When `poll` has to be called next."""
        return self._conversation.due


@dataclass(frozen=True, slots=True)
class WireTimes:
    """Delays of the line and its drives; all in s, turnarounds by address."""

    character: float
    silence: float
    turnarounds: Mapping[int, float]

    def reply_end(self, exchange: Exchange) -> float:
        """When the last byte of the reply is due."""
        wait = max(self.turnarounds.get(exchange.request[0], 0.0), self.silence)
        characters = len(exchange.request) + exchange.size
        return exchange.began + characters * self.character + wait

    def shortest(self, exchange: Exchange) -> float:
        """Least time from a request to the next: the gap before a reply is part of the drive's
        turnaround, the gap before the next request is not.
        """
        return self.reply_end(exchange) - exchange.began + self.silence

    def read(self, device: int, words: int) -> float:
        """The same for a read of so many words of a drive."""
        return self.shortest(Exchange(0.0, bytes([device]) + bytes(7), size=5 + 2 * words))


@dataclass(slots=True)
class Record:
    """Record of the line for one contestant, with the ends of its cycles if reported."""

    times: WireTimes
    exchanges: list[Exchange]
    ends: list[float] = field(default_factory=list)

    def steps(self) -> list[float]:
        """Time from each request to the next one inside a cycle, over the least possible."""
        return [
            (b.began - a.began) / self.times.shortest(a)
            for a, b in pairwise(self.exchanges)
            if a.size and self._cycle(a) == self._cycle(b)
        ]

    def cycles(self) -> list[list[Exchange]]:
        """The whole cycles, each with its exchanges; without the first one and the last one."""
        found: dict[int, list[Exchange]] = {}
        for exchange in self.exchanges:
            found.setdefault(self._cycle(exchange), []).append(exchange)
        return [found[number] for number in sorted(found)[1:-1]]

    def lengths(self) -> list[float]:
        """Time of each whole cycle, from its first request to that of the next one, in s."""
        starts: dict[int, float] = {}
        for exchange in self.exchanges:
            starts.setdefault(self._cycle(exchange), exchange.began)
        ordered = [starts[number] for number in sorted(starts)][1:]
        return [b - a for a, b in pairwise(ordered)]

    def gaps(self) -> list[float]:
        """Silence between the end of each reply and the next request, in s."""
        return [b.began - a.ended for a, b in pairwise(self.exchanges) if a.size]

    def lateness(self) -> list[float]:
        """Delay of each reply of the simulator beyond its due time, in s."""
        return [e.ended - self.times.reply_end(e) for e in self.exchanges if e.size]

    def least(self) -> float:
        """Least time of all exchanges that were answered, in s."""
        return sum(self.times.shortest(e) for e in self.exchanges if e.size)

    def use(self) -> float:
        """Share of the time from the first to the last request for which the line was needed."""
        before = sum(self.times.shortest(e) for e in self.exchanges[:-1] if e.size)
        return before / (self.exchanges[-1].began - self.exchanges[0].began)

    @property
    def unanswered(self) -> int:
        """Requests without a reply."""
        return sum(not e.size for e in self.exchanges)

    def _cycle(self, exchange: Exchange) -> int:
        return bisect_right(self.ends, exchange.began)


class Worker:
    """A process that takes jobs as lines of JSON and answers each with one line."""

    def __init__(self, code: str) -> None:
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        self._process = subprocess.Popen(
            [sys.executable, "-c", code],
            cwd=ROOT,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ask(self, **job: object) -> dict[str, Any]:
        """Do a job; raises RuntimeError where the process ended instead."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(job) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError("a process of the benchmark ended before its time")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(10)


class WireLine:
    """The simulated line as the benchmark uses it: set up, recorded, read out."""

    def __init__(self) -> None:
        self._worker = Worker("from benchmarks.wire import serve; serve()")
        self.path = ""
        self.timing = LineTiming()
        self.times = WireTimes(0.0, 0.0, {})

    def set_up(self, profiles: Mapping[int, str], timing: LineTiming) -> None:
        """Serve drives of these profiles, by address, instead of those served so far."""
        drives = list(profiles.items())
        reported = self._worker.ask(
            do="serve", drives=drives, baud=timing.baud, format=timing.format
        )
        turnarounds = {int(address): wait for address, wait in reported["turnarounds"].items()}
        self.path, self.timing = reported["path"], timing
        self.times = WireTimes(timing.character, timing.silence, turnarounds)

    @property
    def text(self) -> str:
        """The line as a LINE."""
        return f"serial:{self.path},{self.timing.baud},{self.timing.format}"

    def take(self) -> list[Exchange]:
        """The exchanges since the last time."""
        reported = self._worker.ask(do="take")["exchanges"]
        return [Exchange(began, bytes.fromhex(r), end, size) for began, r, end, size in reported]

    def kill(self, address: int) -> None:
        """Switch a drive off."""
        self._worker.ask(do="kill", address=address)

    def close(self) -> None:
        """End the simulator."""
        self._worker.close()


def serve() -> None:
    """Serve lines until the input ends."""
    simulation: Simulation | None = None
    recording: Recording | None = None
    endpoint: PtyEndpoint | None = None
    for line in sys.stdin:
        job = json.loads(line)
        answer: dict[str, object] = {}
        if job["do"] == "serve":
            if simulation is not None and endpoint is not None:
                endpoint.unplug()
                simulation.stop()
            drives = [DriveSpec(profile, address) for address, profile in job["drives"]]
            simulation = Simulation(drives, timing=LineTiming(job["baud"], job["format"], True))
            recording = Recording(RtuConversation(simulation.line, simulation.faults))
            simulation.start()
            endpoint = _plugged(recording, simulation.timing)
            waits = {drive.address: drive.station.turnaround for drive in simulation.drives}
            answer = {"path": endpoint.path, "turnarounds": waits}
        elif job["do"] == "take" and recording is not None:
            taken, recording.exchanges[:] = recording.exchanges[:], []
            rows = [(e.began, e.request.hex(), e.ended, e.size) for e in taken]
            answer = {"exchanges": rows}
        elif job["do"] == "kill" and simulation is not None:
            simulation.drive(job["address"]).power_off()
        print(json.dumps(answer), flush=True)


def _plugged(recording: Recording, timing: LineTiming) -> PtyEndpoint:
    endpoint = PtyEndpoint(lambda client: recording, None, timing, any_settings=True)
    endpoint.plug()
    return endpoint


def share(values: Sequence[float], part: float) -> float | None:
    """The value below which this part of the others lies; None without values."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))] if ordered else None
