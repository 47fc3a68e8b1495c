"""Simulated line, with its conversion of received bytes to frames, and of replies to timed bytes.

The conversion has no input, output or clock of its own. An endpoint passes the bytes that it reads,
requests the next due time, and writes due bytes. Times are those of a monotonic clock, in s.
"""

from __future__ import annotations

import heapq
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from ..drive import SimulatedDrive
from ..errors import SimulatorError
from ..ghost import GhostDrive
from ..spec import LineTiming
from .client_settings import ClientSettings
from .faults import FaultPlan
from .frames import is_sealed, request_length, seal

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


PAUSE = 0.01
"""Least time in s from a master's request to the reply."""
READ = 3


class PollingMaster:
    """Master that polls one drive after another; `period` in s between two requests, 0 for
    never."""

    def __init__(self, line: SimulatedLine, period: float) -> None:
        self._line = line
        self._period = period
        self._polls = 0
        self.due: float | None = 0.0 if period and line.drives else None
        """Time of its next request, on a monotonic clock."""

    def talk(self, now: float) -> list[tuple[float, bytes]]:
        """Return its due request and the reply to it: delays in s, and bytes."""
        if self.due is None or now < self.due:
            return []
        self.due = now + self._period
        drive = self._line.drives[self._polls % len(self._line.drives)]
        self._polls += 1
        status = drive.profile.quantity("status_word")
        place = status.address if status is not None else 0
        request = seal(bytes([drive.address, READ, *place.to_bytes(2, "big"), 0, 1]))
        reply = self._line.receive(request)
        sent = [(0.0, request)]
        if reply is not None:
            time = len(request) * self._line.timing.character
            sent.append((max(PAUSE, time + reply.turnaround), reply.data))
        return sent


SILENCE_ENDS_FRAME = 0.05
"""Pause in s that ends a frame of unknown length if the line does not keep real time."""
MBAP = 7
MAX_MBAP_LENGTH = 254


class Conversation(Protocol):
    """One end of the line, for an endpoint."""

    def feed(self, data: bytes, now: float, /) -> None:
        """Process received bytes."""

    def poll(self, now: float, /) -> bytes:
        """Return the bytes due by now."""

    @property
    def due(self) -> float | None:
        """Return the time of the next `poll`; None: not before more bytes arrive."""


@dataclass(order=True)
class _Sending:
    """Bytes being sent: when the next of them is on the wire, and the time of each."""

    time: float
    number: int
    data: bytes = field(compare=False)
    character: float = field(compare=False)


class _Outbox:
    """Pending output, paced character by character if necessary."""

    def __init__(self) -> None:
        self._heap: list[_Sending] = []
        self._number = 0

    def put(self, start: float, data: bytes, character: float) -> None:
        self._number += 1
        heapq.heappush(self._heap, _Sending(start + character, self._number, data, character))

    def take(self, now: float) -> bytes:
        out = b""
        while self._heap and self._heap[0].time <= now:
            sending = heapq.heappop(self._heap)
            ready = len(sending.data)
            if sending.character:
                ready = min(ready, 1 + int((now - sending.time) / sending.character))
            out += sending.data[:ready]
            if rest := sending.data[ready:]:
                later = sending.time + ready * sending.character
                item = _Sending(later, sending.number, rest, sending.character)
                heapq.heappush(self._heap, item)
        return out

    @property
    def due(self) -> float | None:
        return self._heap[0].time if self._heap else None


class RtuConversation:
    """Modbus RTU on one medium.

    In real time, a frame ends with a pause of 3.5 characters. Two requests without that pause
    between them are one unit that no drive understands. `client` holds the settings of the other
    side. A `paced` medium (a real port) spends the time of its characters itself. Without real
    time, a frame ends as soon as it has the length it announces, or after a short pause.
    """

    def __init__(
        self,
        line: SimulatedLine,
        faults: FaultPlan,
        *,
        paced: bool = False,
        client: Callable[[], ClientSettings] | None = None,
    ) -> None:
        self._line = line
        self._timing = line.timing
        self._look = client
        self._client: ClientSettings | None = None
        """Settings of the client at its last bytes, if visible."""
        self._faults = faults
        self._paced = paced
        self._buffer = b""
        self._received = 0.0
        """Time when the last character was, or will have been, on the wire."""
        self._outbox = _Outbox()
        self._master = PollingMaster(line, faults.habits.master)

    def feed(self, data: bytes, now: float) -> None:
        """Process received bytes."""
        if self._buffer and now >= self._end:
            self._finish()
        if self._look is not None:
            self._client = self._look()
            self._timing = self._client.pace(self._line.timing)
        if self._paced or not self._timing.real_time:
            self._received = now
        else:
            self._received = max(self._received, now) + len(data) * self._timing.character
        self._buffer += data
        if not self._timing.real_time or self._paced:
            expected = request_length(self._buffer)
            if expected == len(self._buffer) and is_sealed(self._buffer):
                self._finish()

    @property
    def _end(self) -> float:
        """Return the time when the pause after the received bytes is long enough."""
        silence = self._timing.silence if self._timing.real_time else SILENCE_ENDS_FRAME
        return self._received + (max(silence, SILENCE_ENDS_FRAME) if self._paced else silence)

    def poll(self, now: float) -> bytes:
        """Return the bytes due by now."""
        if self._buffer and now >= self._end:
            self._finish()
        for delay, data in self._master.talk(now):
            self._outbox.put(now + delay, data, self._pace)
        return self._outbox.take(now)

    @property
    def _pace(self) -> float:
        """Return the time of each character sent by the simulator; 0 on a medium that spends it
        itself."""
        return self._timing.character if self._timing.real_time and not self._paced else 0.0

    @property
    def due(self) -> float | None:
        """Return the time of the next `poll`."""
        times = [self._end] if self._buffer else []
        times += [due for due in (self._outbox.due, self._master.due) if due is not None]
        return min(times, default=None)

    def _finish(self) -> None:
        frame, self._buffer = self._buffer, b""
        reply = self._line.receive(frame, self._client) if self._faults.reaches() else None
        if reply is None:
            return
        start = self._received
        if self._timing.real_time:
            turnaround = reply.turnaround
            if reply.took is not None:
                turnaround = reply.took - len(reply.data) * self._timing.character
            start += max(turnaround, self._timing.silence)
        elif reply.took is not None:
            start += reply.took
        for delay, data in self._faults.carry(reply.data):
            self._outbox.put(start + delay, data, self._pace)


class TcpConversation:
    """Modbus TCP on one connection."""

    def __init__(self, line: SimulatedLine, faults: FaultPlan) -> None:
        self._line = line
        self._faults = faults
        self._buffer = b""
        self._outbox = _Outbox()
        self.broken = False
        """True once the client sent bytes that are not Modbus TCP."""

    def feed(self, data: bytes, now: float) -> None:
        """Process received bytes."""
        self._buffer += data
        while not self.broken and len(self._buffer) >= MBAP:
            length = int.from_bytes(self._buffer[4:6], "big")
            if self._buffer[2:4] != b"\0\0" or not 2 <= length <= MAX_MBAP_LENGTH:
                self.broken = True
                return
            if len(self._buffer) < 6 + length:
                return
            message, self._buffer = self._buffer[: 6 + length], self._buffer[6 + length :]
            self._answer(message, now)

    def _answer(self, message: bytes, now: float) -> None:
        unit = message[6]
        first = self._line.drives[0].address if self._line.drives else unit
        served = self._faults.served(unit, first)
        if served is None or not self._faults.reaches():
            return
        reply = self._line.ask(served, message[MBAP:])
        if reply is None:
            return
        wait = reply.turnaround if self._line.timing.real_time else reply.took or 0.0
        for delay, replier, pdu in self._faults.carry_message(unit, reply.data):
            head = message[:4] + (len(pdu) + 1).to_bytes(2, "big") + bytes([replier])
            self._outbox.put(now + wait + delay, head + pdu, 0.0)

    def poll(self, now: float) -> bytes:
        """Return the bytes due by now."""
        return self._outbox.take(now)

    @property
    def due(self) -> float | None:
        """Return the time of the next `poll`."""
        return self._outbox.due
