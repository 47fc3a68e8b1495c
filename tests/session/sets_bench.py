"""A simulated drive on a real line with a writer of its settings, for tests of settings."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from tests.programs import wait_until
from tests.sent import words_written
from tui.bus.api import LineStatus
from tui.bus.errors import DeviceException, LineError
from tui.bus.line import Line
from tui.bus.link import Link, RtuTcpLink, SerialLink
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.settings.edits import Edits
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.monitor.monitor import Monitor
from tui.session.read.retrying_reader import RetryingReader
from tui.session.settings.applied import Applied
from tui.session.settings.apply import apply_edits
from tui.session.work import Permit
from tui.simulator import DriveSpec, FaultRates, Simulation
from tui.simulator.drive import SimulatedDrive

FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]


@dataclass(slots=True)
class Bench:
    """A drive, the session with it, and the journal."""

    drive: SimulatedDrive
    session: DriveSession
    journal: Journal
    simulation: Simulation

    @property
    def profile(self) -> Profile:
        """The drive's profile."""
        return self.session.profile

    def permit(self) -> Permit:
        """The permit to write: armed for the whole test if the line allows it."""
        if not self.session.line.read_only:
            self.session.arming.arm(seconds=math.inf)
        return Permit(self.session.work, self.session.work.stops)

    async def stage(self, **typed: str) -> Edits:
        """Edits as typed, compared with the drive's values."""
        retrying = RetryingReader(self.session)
        codes = [*typed, *(p.code for p in self.profile.parameters if p.quantity in SOURCES)]
        raws = await retrying.ask_raws(codes)
        edits = Edits()
        for code, text in typed.items():
            edits = edits.stage(self.profile, code, text, raws, retrying.lacking)
        return edits

    async def apply(self, **typed: str) -> Applied:
        """Stage and apply."""
        return await self.write(await self.stage(**typed))

    async def write(self, edits: Edits, **how: Any) -> Applied:
        """Apply the staged edits, armed."""
        return await apply_edits(self.session, self.journal, edits, permit=self.permit(), **how)

    def after_writes(self, count: int, then: Callable[[], None]) -> None:
        """Run a function once the drive has answered this many more writes."""
        honest, left = self.session.line.write, [count]

        async def counted(*what: Any, **how: Any) -> float:
            answered = await honest(*what, **how)
            left[0] -= 1
            if left[0] == 0:
                then()
            return answered

        self.session.line.write = counted  # type: ignore[method-assign]

    def refuse(self, code: str) -> None:
        """Make the drive refuse this parameter, like a busy one."""
        honest, refused = self.session.line.write, self.profile[code].address

        async def picky(device: int, address: int, *what: Any, **how: Any) -> float:
            if address == refused:
                raise DeviceException(device, 6, address, 4)
            return await honest(device, address, *what, **how)

        self.session.line.write = picky  # type: ignore[method-assign]

    def lose_answer(self, code: str, error: LineError, *, taken: bool) -> list[int]:
        """Leave writes of this parameter unanswered; return the sent words."""
        honest, lost, sent = self.session.line.write, self.profile[code].address, list[int]()

        async def silent(device: int, address: int, words: Sequence[int], **how: Any) -> float:
            if address != lost:
                return await honest(device, address, words, **how)
            sent.extend(words)
            if taken:
                await honest(device, address, words, **how)
            raise error

        self.session.line.write = silent  # type: ignore[assignment, method-assign]
        return sent

    def writes(self) -> list[tuple[int, int]]:
        """Registers and words of all writes of one word so far."""
        return words_written(self.session.line)

    def lose_line(self) -> None:
        """Unplug the adapter, and wait until the line notices."""
        self.simulation.unplug()
        self._until(LineStatus.LOST)

    def regain_line(self) -> None:
        """Put the plug back, and wait for the line."""
        self.simulation.replug()
        self._until(LineStatus.CONNECTED)

    def _until(self, status: LineStatus) -> None:
        end = time.monotonic() + 60
        while self.session.line.state.status is not status:
            assert time.monotonic() < end, f"the line does not become {status}"
            time.sleep(0.02)


SOURCES = {"ramp_increment", "high_speed", "low_speed", "max_frequency"}


def state_known(monitor: Monitor) -> bool:
    """True if the drive may be armed; a first cycle may fail on a busy machine."""
    latest = monitor.latest
    return latest is not None and not latest.error and latest.state.kind != "unknown"


@contextmanager
def bench(
    family: str,
    *,
    read_only: bool = False,
    faults: FaultRates | None = None,
    serial: bool = False,
    **spec: object,
) -> Iterator[Bench]:
    """A simulated drive on RTU over TCP, or on a serial port if its settings matter."""
    drive = DriveSpec(family, 1, **spec)  # type: ignore[arg-type]
    simulation = Simulation([drive], faults=faults, seed=3)
    simulation.start()
    link: Link = (
        SerialLink(simulation.serve_pty(), 19200, "8N1")
        if serial
        else RtuTcpLink(*simulation.serve_rtu_tcp())
    )
    line = Line(link, read_only=read_only)
    journal = Journal()
    try:
        line.open(wait=5.0)
        if spec.get("run_hz"):
            wait_until(lambda: simulation.drive(1).motor.frequency > 0, "the motor turns")
        session = DriveSession(line, 1, library.load(family))
        yield Bench(simulation.drive(1), session, journal, simulation)
    finally:
        journal.close()
        line.close()
        simulation.stop()
