"""Simulated line: forwards each frame to its drive, and returns the reply."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..drive import SimulatedDrive
from ..errors import SimulatorError
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


class SimulatedLine:
    """Drives on one line with a common simulated time."""

    def __init__(
        self,
        drives: Sequence[SimulatedDrive],
        timing: LineTiming,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.drives = tuple(drives)
        self.timing = timing
        self._clock = clock
        self._lock = threading.Lock()
        self._last = clock()
        self.running = False
        """True if the drives' time passes with the clock."""

    def start(self) -> None:
        """Start the drives' time."""
        with self._lock:
            self._last = self._clock()
            self.running = True

    def advance(self, at_least: float = 0.0) -> None:
        """Advance the drives' time to the clock, if it is behind by more than this, in s."""
        with self._lock:
            now = self._clock()
            elapsed = now - self._last
            if not self.running or elapsed <= at_least:
                return
            self._last = now
        for drive in self.drives:
            drive.step(elapsed)

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
        listening = [d for d in self.drives if d.station.hears(self.timing, client)]
        if not is_sealed(frame):
            for drive in listening:
                if len(frame) >= 4 and drive.line_side.is_own(frame[0]):
                    drive.line_side.count_checksum_error()
            return None
        address, pdu = frame[0], frame[1:-2]
        reply = self._ask(listening, address, pdu)
        if reply is None:
            return None
        return PendingReply(seal(bytes([address]) + reply.data), reply.turnaround)

    def ask(self, unit: int, pdu: bytes) -> PendingReply | None:
        """Return the reply to a message of Modbus TCP; its data is a PDU."""
        if unit == ANY_UNIT and len(self.drives) == 1:
            unit = self.drives[0].address
        return self._ask(self.drives, unit, pdu)

    def _ask(
        self, drives: Sequence[SimulatedDrive], address: int, pdu: bytes
    ) -> PendingReply | None:
        self.advance(FRESH_VALUES)
        reply: PendingReply | None = None
        for drive in drives:
            if drive.line_side.is_called(address):
                drive.line_side.obey(pdu)
            elif reply is None and drive.line_side.answers_at(address):
                answer = drive.line_side.answer(address, pdu)
                if answer is not None:
                    reply = PendingReply(answer, drive.station.turnaround)
        return reply
