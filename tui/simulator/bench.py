"""Text lines that change simulated drives: inputs, supply, load, wire, faults, planted defects.

One parser reads them from standard input, from a socket, from a script and from the panel.
"""

from __future__ import annotations

import heapq
import itertools
import re
import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from .bench_commands import BenchState, Deed, bench_state, prepared
from .drive import SimulatedDrive
from .errors import SimulatorError
from .simulation import Simulation

BENCH_EXAMPLE = "2: LI1=1, AI1=5V"
ALL_DRIVES = "all"
LATEST = 86400.0
"""Greatest time of a line, in s."""
_TIMED = re.compile(r"\s*(at|in)\s+(\d{1,6}(?:\.\d{1,6})?)\s*s?\s*:(.*)", re.IGNORECASE | re.DOTALL)


class BenchResult(NamedTuple):
    """Result of one line for one drive."""

    device: int
    text: str
    time: float
    """Seconds since the bench was made."""
    state: BenchState
    inputs: bool
    """True if the line sets or shows inputs only."""


class _Line(NamedTuple):
    """A line whose parts are checked."""

    delay: float | None
    """Time in s until it is due; None: immediately."""
    drives: tuple[SimulatedDrive, ...]
    deeds: tuple[tuple[Deed, ...], ...]
    """Changes by drive."""
    inputs: bool
    later: str
    """The line without its time."""


class Bench:
    """Carries out text lines on the drives of a simulation, at once or at a time.

    Its methods may be called from any thread. `report` receives the results of lines that have
    waited for their time, in a thread of the bench.
    """

    def __init__(
        self, simulation: Simulation, report: Callable[[BenchResult], None] | None = None
    ) -> None:
        self._simulation = simulation
        self._report = report
        self._begun = time.monotonic()
        self._numbers = itertools.count()
        self._due: list[tuple[float, int, str]] = []
        self._changed = threading.Condition()
        self._closed = False
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Count the time of `at` from now."""
        self._begun = time.monotonic()

    def check(self, text: str) -> None:
        """Raise SimulatorError if a part of a line is invalid; changes nothing."""
        self._parse(text)

    def do(self, text: str) -> list[BenchResult]:
        """Carry out a line, and return its results; none yet if it waits for its time.

        Nothing is changed if a part of the line is invalid. Raises SimulatorError.
        """
        line = self._parse(text)
        if line.delay is not None:
            self._wait_for(line.delay, line.later)
            return []
        return self._carry_out(line)

    def close(self) -> None:
        """Discard the lines that wait for their time; may be called twice."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    @property
    def waiting(self) -> int:
        """Number of lines that wait for their time."""
        with self._changed:
            return len(self._due)

    def _carry_out(self, line: _Line) -> list[BenchResult]:
        found = []
        for drive, deeds in zip(line.drives, line.deeds, strict=True):
            text = ", ".join([deed() for deed in deeds]) or drive.terminals.reported()
            passed = time.monotonic() - self._begun
            state = bench_state(drive)
            found.append(BenchResult(drive.address, text, round(passed, 3), state, line.inputs))
        return found

    # Lines that wait for their time

    def _wait_for(self, delay: float, text: str) -> None:
        with self._changed:
            due = time.monotonic() + delay
            heapq.heappush(self._due, (due, next(self._numbers), text))
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="bench", daemon=True)
                self._thread.start()
            self._changed.notify()

    def _work(self) -> None:
        while (text := self._next()) is not None:
            for result in self._carry_out(self._parse(text)):
                if self._report is not None:
                    self._report(result)

    def _next(self) -> str | None:
        """Return the next line at its time; None once the bench is closed."""
        with self._changed:
            while not self._closed:
                wait = self._due[0][0] - time.monotonic() if self._due else None
                if wait is not None and wait <= 0:
                    return heapq.heappop(self._due)[2]
                self._changed.wait(wait)
            return None

    # Parsing

    def _parse(self, text: str) -> _Line:
        delay, plain = self._delayed(text)
        drives, rest = self._drives(plain)
        if delay is None:  # the time may follow the address, too
            delay, rest = self._delayed(rest)
            plain = f"{plain.partition(':')[0]}:{rest}" if delay is not None else plain
        parts = [part.strip() for part in rest.split(",") if part.strip()]
        deeds = tuple(tuple(prepared(drive, part) for part in parts) for drive in drives)
        return _Line(delay, drives, deeds, all("=" in part for part in parts), plain)

    def _delayed(self, text: str) -> tuple[float | None, str]:
        """Return the time in s until a line is due, and the rest of it; None if it names none."""
        if (timed := _TIMED.fullmatch(text)) is None:
            return None, text
        return self._delay(timed[1].casefold(), float(timed[2]), text), timed[3]

    def _delay(self, word: str, seconds: float, text: str) -> float:
        if seconds > LATEST:
            raise SimulatorError(f"{text.strip()!r}: the latest time is {LATEST:g} s.")
        if word == "in":
            return seconds
        passed = time.monotonic() - self._begun
        if seconds < passed - 1:
            raise SimulatorError(
                f"{text.strip()!r}: {passed:.1f} s have passed. Write 'in 2s: ...' for 2 s from"
                " now."
            )
        return max(0.0, seconds - passed)

    def _drives(self, text: str) -> tuple[tuple[SimulatedDrive, ...], str]:
        head, colon, rest = text.partition(":")
        address = head.strip()
        if not colon:
            return (self._simulation.only_drive,), text
        if address.casefold() == ALL_DRIVES:
            return self._simulation.drives, rest
        if address and not address.isdecimal():
            raise SimulatorError(f"{text.strip()!r}: write it like {BENCH_EXAMPLE!r}.")
        drive = self._simulation.drive(int(address)) if address else self._simulation.only_drive
        return (drive,), rest
