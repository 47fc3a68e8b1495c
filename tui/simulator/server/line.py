"""Simulated line: forwards each frame to its drive, and returns the reply."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from ..drive import SimulatedDrive
from ..errors import SimulatorError
from ..ghost import GhostDrive
from ..spec import LineTiming
from .client_settings import ClientSettings
from .frames import is_sealed, seal

FRESH_VALUES = 0.004
"""Age in s up to which the drives' values are recent enough for a reply."""
ANY_UNIT = 255
"""Unit that Modbus TCP clients use for the only device behind an address."""


@dataclass(frozen=True, slots=True)
class PendingReply:
    """Reply in transit: its bytes, and the drive's turnaround in s."""

    data: bytes
    turnaround: float
    took: float | None = None
    """Time in s from the end of the request to the end of the reply, by a record; None without."""


class SimulatedLine:
    """Drives on one line, and ghosts of recorded ones.

    Each drive has a time of its own that follows the clock, so that a request costs the steps of
    the drives that it concerns only.
    """

    def __init__(
        self,
        drives: Sequence[SimulatedDrive],
        timing: LineTiming,
        clock: Callable[[], float] = time.monotonic,
        ghosts: Sequence[GhostDrive] = (),
    ) -> None:
        self.drives = tuple(drives)
        self.ghosts = tuple(ghosts)
        self.timing = timing
        self._clock = clock
        self._lock = threading.Lock()
        self._last = [clock()] * len(self.drives)
        """Time to which each drive has advanced."""
        self.running = False
        """True if the drives' time passes with the clock."""

    def start(self) -> None:
        """Start the drives' time."""
        with self._lock:
            self._last = [self._clock()] * len(self.drives)
            self.running = True

    def advance(self, at_least: float = 0.0) -> None:
        """Advance the drives' time to the clock, each that is behind by more than this, in s."""
        for place in range(len(self.drives)):
            self.advance_drive(place, at_least)

    def advance_drive(self, place: int, at_least: float = 0.0) -> None:
        """Advance the time of one drive, by its place in `drives`."""
        with self._lock:
            now = self._clock()
            elapsed = now - self._last[place]
            if not self.running or elapsed <= at_least:
                return
            self._last[place] = now
        self.drives[place].step(elapsed)

    def drive(self, address: int) -> SimulatedDrive:
        """Return the drive with this address at present; raises SimulatorError."""
        for drive in self.drives:
            if drive.address == address:
                return drive
        known = ", ".join(str(d.address) for d in self.drives) or "none"
        raise SimulatorError(f"No simulated drive has address {address}. Addresses: {known}.")

    def receive(self, frame: bytes, client: ClientSettings | None = None) -> PendingReply | None:
        """Return the reply to the bytes between two pauses; None for no reply.

        A drive whose baud, parity or stop bits differ from those of the `client` ignores the bytes.
        """
        if not is_sealed(frame):
            for drive in self.drives:
                heard = len(frame) >= 4 and drive.station.hears(self.timing, client)
                if heard and drive.line_side.is_own(frame[0]):
                    drive.line_side.count_checksum_error()
            return None
        address, pdu = frame[0], frame[1:-2]
        concerned = (
            place
            for place in self._concerned(address)
            if self.drives[place].station.hears(self.timing, client)
        )
        reply = self._ask(concerned, address, pdu)
        if reply is None:
            return None
        return replace(reply, data=seal(bytes([address]) + reply.data))

    def ask(self, unit: int, pdu: bytes) -> PendingReply | None:
        """Return the reply to a message of Modbus TCP; its data is a PDU."""
        if unit == ANY_UNIT and len(self.drives) == 1:
            unit = self.drives[0].address
        return self._ask(self._concerned(unit), unit, pdu)

    def _concerned(self, address: int) -> list[int]:
        """Return the places of the drives that an address calls, or that reply at it."""
        sides = [drive.line_side for drive in self.drives]
        return [
            place
            for place, side in enumerate(sides)
            if side.is_called(address) or side.answers_at(address)
        ]

    def _ask(self, places: Iterable[int], address: int, pdu: bytes) -> PendingReply | None:
        reply: PendingReply | None = None
        for place in places:
            self.advance_drive(place, FRESH_VALUES)
            drive = self.drives[place]
            if drive.line_side.is_called(address):
                drive.line_side.obey(pdu)
            elif reply is None and drive.line_side.answers_at(address):
                answer = drive.line_side.answer(address, pdu)
                if answer is not None:
                    reply = PendingReply(answer, drive.station.turnaround)
        for ghost in self.ghosts:
            if ghost.address == address and (found := ghost.answer(pdu)) is not None:
                return PendingReply(found.data, found.took, found.took)
        return reply
