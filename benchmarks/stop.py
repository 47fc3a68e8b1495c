"""From the press of the stop key to the last byte of the stop frame, on a line that is full.

    python -m benchmarks.stop [--presses N] [--drives N]

The panel runs in a pseudo-terminal of 80 x 24 with its Monitor screen open, polls all drives of a
real-time line of 19200 baud as fast as the line allows, and uploads the parameters of one of them
in the background. F12 is pressed at odd moments; the simulated line, a process of its own, notes
when the last byte of each stop frame has passed. The limit is the longest exchange of that load,
which may be in flight, with the silence behind it, and the stop frame itself.

Then again with a terminal that is not read, so that the screen is stuck; and, for comparison, with
the key handled by Textual, in the drawing loop.

Last, a stop of all drives of the same line: from the call to the last byte of the last frame of the
first wave, as a ratio to so many exchanges of a stop frame one behind the other.
"""

from __future__ import annotations

import argparse
import asyncio
import fcntl
import json
import os
import pty
import random
import select
import signal
import struct
import sys
import termios
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from benchmarks.fleet import fleet
from benchmarks.wire import ROOT, Exchange, WireLine, share
from tests.answering import read_answering
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.drive.profile.library import load
from tui.session.drive import DriveSession
from tui.session.fleet import Fleet
from tui.session.journal import Journal
from tui.simulator import LineTiming

KEY = b"\x1b[24~"
"""F12 as terminals send it."""
WATCHED = 1
READY = b"Command"
"""Text of Monitor once the first values of a drive are shown."""
PATIENCE = 60.0
SETTLING = 4.0
STUCK_AFTER = 3.0
"""Seconds of full redraws after which an unread terminal accepts no more output."""
WITHIN = 4.0
"""Seconds in which a stop frame counts for its key."""
ALL_PRESSES = 5
COMMANDS = {(1, 0xFA00)}
"""Device and register of the stop frames: the watched drive is an Altivar 21."""


# The process of the panel


def panel() -> None:
    """The panel on a full line: every drive watched, one of them uploaded in the background."""
    from textual.driver import Driver

    from tui.app import DrivePanelApp
    from tui.bus.api import Priority
    from tui.bus.errors import LineError
    from tui.drive.errors import DriveError
    from tui.session.console import DriveConsole
    from tui.session.monitor.monitor import Monitor
    from tui.session.read.reader import Reader

    text, drives, own_keys = sys.argv[1], json.loads(sys.argv[2]), sys.argv[3] == "own"

    class Loaded(DrivePanelApp):
        def get_driver_class(self) -> type[Driver]:
            found = super().get_driver_class()
            return found if own_keys else found.__base__  # type: ignore[return-value]

        def show_monitor(self, console: DriveConsole) -> None:
            super().show_monitor(console)
            session = console.session
            for device, family in drives.items():
                if int(device) != session.device:
                    other = DriveSession(session.line, int(device), load(family))
                    Monitor(other).start(period=0.1)
            reader = Reader(session)

            async def upload() -> None:
                codes = [p.code for p in session.profile.parameters if p.access != "w"]
                while True:
                    with suppress(LineError, DriveError):
                        await reader.read(codes, priority=Priority.BACKGROUND)
                    await asyncio.sleep(0.01)

            session.line.spawn(upload, "upload")

    app = Loaded(start=text, device=WATCHED)
    app.period = 0.1
    app.run()


# Pressing


@dataclass(frozen=True, slots=True)
class Case:
    """One way to run the panel."""

    name: str
    drained: bool
    own_keys: bool


CASES = (
    Case("terminal read", drained=True, own_keys=True),
    Case("terminal not read", drained=False, own_keys=True),
    Case("key in Textual's loop, terminal read", drained=True, own_keys=False),
    Case("key in Textual's loop, not read", drained=False, own_keys=False),
)


class Terminal:
    """The panel's terminal, read by a thread or not at all."""

    def __init__(self, process: int, fd: int) -> None:
        self.process, self.fd = process, fd
        self._reading = True
        self._seen = b""
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        while self._reading:
            if select.select([self.fd], [], [], 0.05)[0]:
                try:
                    self._seen = (self._seen + read_answering(self.fd))[-200_000:]
                except OSError:
                    return

    def await_text(self, wanted: bytes) -> None:
        """Wait until a text was written to the terminal."""
        end = time.monotonic() + PATIENCE
        while wanted not in self._seen:
            if time.monotonic() > end:
                raise TimeoutError(f"{wanted!r} did not come: {self._seen[-300:]!r}")
            time.sleep(0.05)

    def stop_reading(self) -> None:
        """Read nothing more, and have the screen drawn until it is stuck."""
        self._reading = False
        self._thread.join()
        end = time.monotonic() + STUCK_AFTER
        size = 0
        while time.monotonic() < end:
            size ^= 1
            fcntl.ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80 + size, 0, 0))
            os.kill(self.process, signal.SIGWINCH)
            time.sleep(0.05)

    def close(self) -> None:
        """End the panel, whatever state it is in."""
        os.kill(self.process, signal.SIGKILL)
        self._reading = False
        os.waitpid(self.process, 0)
        os.close(self.fd)


@contextmanager
def started(line: WireLine, drives: dict[int, str], case: Case) -> Iterator[Terminal]:
    """The panel on a terminal, watching its drive."""
    process, fd = pty.fork()
    if process == 0:
        environment = os.environ | {
            "TERM": "xterm-256color",
            "PYTHONPATH": str(ROOT),
            "TEXTUAL_ANIMATIONS": "none",
        }
        os.chdir(ROOT)
        code = "from benchmarks.stop import panel; panel()"
        keys = "own" if case.own_keys else "textual"
        arguments = [sys.executable, "-c", code, line.text, json.dumps(drives), keys]
        os.execve(sys.executable, arguments, environment)
    fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    terminal = Terminal(process, fd)
    try:
        terminal.await_text(READY)
        yield terminal
    finally:
        terminal.close()


@dataclass(frozen=True, slots=True)
class Result:
    """Latencies of one case in s, how many keys brought no frame, and the limit."""

    name: str
    latencies: list[float]
    unanswered: int
    limit: float
    busy: float


def measure(line: WireLine, drives: dict[int, str], case: Case, presses: int) -> Result:
    """Press the key so many times in one case."""
    line.set_up(drives, LineTiming(19200, "8E1", True))
    chance = random.Random(1)
    with started(line, drives, case) as terminal:
        time.sleep(SETTLING)
        if not case.drained:
            terminal.stop_reading()
        line.take()
        pressed = []
        for _ in range(presses):
            time.sleep(0.25 + chance.random() * 0.5)
            pressed.append(time.monotonic())
            os.write(terminal.fd, KEY)
        time.sleep(WITHIN)
        exchanges = line.take()
    return result_of(line, case, pressed, exchanges)


def result_of(
    line: WireLine, case: Case, pressed: Sequence[float], exchanges: Sequence[Exchange]
) -> Result:
    """Record of the line for the keys pressed."""
    character = line.times.character
    stops = [
        exchange.began + len(exchange.request) * character
        for exchange in exchanges
        if is_stop(exchange)
    ]
    latencies = []
    for index, key in enumerate(pressed):
        end = pressed[index + 1] if index + 1 < len(pressed) else key + WITHIN
        first = next((at for at in stops if key < at - 8 * character and at < end), None)
        if first is not None:
            latencies.append(first - key)
    longest = max((line.times.shortest(e) for e in exchanges if e.size), default=0.0)
    answered = [e for e in exchanges if e.size]
    span = exchanges[-1].began - exchanges[0].began if len(exchanges) > 1 else 1.0
    busy = sum(line.times.shortest(e) for e in answered) / span
    limit = longest + 8 * character
    return Result(case.name, latencies, len(pressed) - len(latencies), limit, busy)


def is_stop(exchange: Exchange) -> bool:
    """Return True if an exchange writes the command word of the watched drive."""
    request = exchange.request
    register = int.from_bytes(request[2:4], "big")
    return request[1] == 6 and (request[0], register) in COMMANDS


# All drives


@dataclass(frozen=True, slots=True)
class Wave:
    """One stop of all drives: until the last first frame, and the least that it can take, in s."""

    took: float
    least: float
    missing: int
    """Drives that were sent no frame."""


def measure_all(wire: WireLine, drives: dict[int, str], presses: int) -> list[Wave]:
    """Stop all drives of the line so many times, as the panel does, while they are looked at."""
    wire.set_up(drives, LineTiming(19200, "8E1", True))
    line = Line(link_of(wire))
    line.open(wait=PATIENCE)
    with TemporaryDirectory() as folder:
        journal = Journal(Path(folder))
        fleet = Fleet(line, journal)
        try:
            for address, family in drives.items():
                fleet.take(DriveSession(line, address, load(family)))
            end = time.monotonic() + PATIENCE
            while len(fleet.line_watch.states) < len(drives) and time.monotonic() < end:
                time.sleep(0.1)
            return [stop_all(wire, fleet) for _ in range(presses)]
        finally:
            fleet.forget()
            line.close()
            journal.close()


def link_of(wire: WireLine) -> SerialLink:
    """The line for a program in this process."""
    return SerialLink(wire.path, wire.timing.baud, wire.timing.format)


def stop_all(wire: WireLine, fleet: Fleet) -> Wave:
    """One stop of all drives."""
    time.sleep(SETTLING)
    wire.take()
    pressed = time.monotonic()
    fleet.stop(fleet.sessions)
    time.sleep(WITHIN)
    first: dict[int, Exchange] = {}
    for exchange in wire.take():
        if exchange.began > pressed and exchange.request[0] and exchange.request[1] == 6:
            first.setdefault(exchange.request[0], exchange)
    last = max((item.began for item in first.values()), default=pressed)
    took = last + 8 * wire.times.character - pressed
    least = sum(wire.times.shortest(item) for item in first.values())
    return Wave(took, least, len(fleet.sessions) - len(first))


# Telling


def table_of(results: Sequence[Result], drives: int) -> Table:
    """The figures as a table; times in ms, and as ratios to the limit."""
    table = Table(title=f"Stop key to last byte of the stop frame, {drives} drives, 19200 8E1")
    names = (
        "panel",
        "line in use",
        "keys",
        "no frame",
        "limit",
        "median",
        "95 %",
        "worst",
        "/ limit",
    )
    for name in names:
        table.add_column(name, justify="left" if name == "panel" else "right")
    for result in results:
        if not result.latencies:
            figures = ["-"] * 4
        else:
            values = (
                median(result.latencies),
                share(result.latencies, 0.95),
                max(result.latencies),
            )
            figures = [f"{1000 * (value or 0):.1f}" for value in values]
            figures.append(f"{max(result.latencies) / result.limit:.2f}")
        table.add_row(
            result.name,
            f"{result.busy:.0%}",
            str(len(result.latencies) + result.unanswered),
            str(result.unanswered),
            f"{1000 * result.limit:.1f}",
            *figures,
        )
    return table


def main() -> None:
    """Measure every case, print the table and one line of JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--presses", type=int, default=40, metavar="N")
    parser.add_argument("--drives", type=int, default=31, metavar="N")
    options = parser.parse_args()
    drives = fleet(options.drives) | {WATCHED: "atv21"}
    line = WireLine()
    try:
        results = [measure(line, drives, case, options.presses) for case in CASES]
        waves = measure_all(line, drives, ALL_PRESSES)
    finally:
        line.close()
    Console(width=110).print(table_of(results, options.drives))
    ratios = sorted(wave.took / wave.least for wave in waves)
    missing = sum(wave.missing for wave in waves)
    print(
        f"stop all, last frame of the first wave / {options.drives} exchanges:"
        f" median {median(ratios):.2f}, worst {ratios[-1]:.2f}, drives without a frame: {missing}"
    )
    reported = [
        {
            "case": result.name,
            "busy": result.busy,
            "unanswered": result.unanswered,
            "limit_ms": 1000 * result.limit,
            "median_ms": 1000 * median(result.latencies) if result.latencies else None,
            "p95_ms": 1000 * (share(result.latencies, 0.95) or 0) if result.latencies else None,
            "worst_ms": 1000 * max(result.latencies) if result.latencies else None,
        }
        for result in results
    ]
    everything = {"ratios": ratios, "missing": missing}
    print(
        json.dumps(
            {"benchmark": "stop", "drives": options.drives, "cases": reported, "all": everything}
        )
    )


if __name__ == "__main__":
    main()
