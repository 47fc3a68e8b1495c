"""Simulated drives on a line whose time a test controls, with the rows of its record.

Nothing takes real time: an exchange sleeps by the same clock as the monitors.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from tui.bus.errors import DeviceException, ExchangeError, NoAnswer, RequestRefused
from tui.bus.expectation import IDENTIFY
from tui.bus.fake import FakeLine
from tui.bus.fake_device import FakeDevice
from tui.bus.limits import CAUTIOUS, STANDARD_EXCEPTIONS
from tui.bus.line_events import StateChanged
from tui.bus.link import SerialLink
from tui.bus.model import (
    EndedExchange,
    IdentificationObjects,
    LineCounters,
    LineState,
    LineStatus,
    Priority,
)
from tui.bus.notes import LineNote
from tui.bus.requests import Objects, Request
from tui.bus.tally import Tally
from tui.session.event_notes import BLOCK_OF_DRIVE, EVENTS_OF_LINE, PROFILE_OF_DRIVE, LeftEvent
from tui.session.record.ghost import GhostRecord
from tui.session.record.record_file import RecordFile
from tui.session.record.replay_clock import ReplayClock
from tui.session.record.schema import EventRow, ReplyRow, reply_row, to_microseconds
from tui.simulator import DriveSpec, Simulation
from tui.simulator.ghost import GhostDrive

BEGUN = 1_795_000_000.0
TIMEOUT = 0.3
"""Seconds without a reply after which a request has failed."""
ON_THE_WIRE = 0.008
"""Seconds of a request and its reply on the wire, besides the turnaround of the drive."""
CLOCK_STEP = 1e-5
"""Seconds: a shorter sleep does not move a clock that counts from 1970."""
TURNS = 5
"""Turns of the loop in which new work begins to sleep."""
END_OF_TIME = 4e9


class VirtualLine(FakeLine):
    """A line of simulated drives by `time`, which a test lets go on."""

    def __init__(self, record: Path, *drives: DriveSpec, ghost: GhostRecord | None = None) -> None:
        """`record` is the file of its record, which can be read at any time."""
        self.time = ReplayClock(BEGUN, END_OF_TIME, BEGUN)
        registers: dict[int, dict[int, int]] = {spec.address: {} for spec in drives}
        link = SerialLink("/dev/ttyUSB0", 19200, "8E1")
        super().__init__(registers, link=link, clock=self.time.monotonic)
        ghosts = []
        if ghost is not None:
            exchanges, clock = ghost.exchanges, self.time.monotonic
            ghosts = [GhostDrive(ghost.device, exchanges, ghost.profile, clock=clock)]
            self.devices[ghost.device] = FakeDevice(ghost.device)
        self.simulation = Simulation(drives, clock=self.time.monotonic, ghosts=ghosts)
        self.simulation.line.start()
        self._file = RecordFile(record, "serial:/dev/ttyUSB0,19200,8E1", "test")
        self._rows: list[ReplyRow] = []
        self._events: list[EventRow] = []
        self._tally = Tally(clock=self.time.monotonic)
        self._free = BEGUN
        """Time at which the wire is free again."""
        self.facts.notes.heard = self._hear_note

    def _hear_note(self, note: LineNote) -> None:
        if note.kind in (PROFILE_OF_DRIVE, BLOCK_OF_DRIVE):
            self._note(note.kind, note.data.decode(), note.device)
        elif note.kind == EVENTS_OF_LINE:
            left = msgspec.msgpack.decode(note.data, type=LeftEvent)
            wall, device, kind, text = left.event
            self._note(kind, text, device, wall)

    def _note(
        self, kind: str, text: str, device: int | None = None, wall: float | None = None
    ) -> None:
        at = to_microseconds(self.time.monotonic() if wall is None else wall)
        self._events.append(EventRow(at, at, device, kind, text))

    def become(self, status: LineStatus, reason: str = "") -> None:
        """Lose the line, or regain it; the record has it."""
        self.state = LineState(status, reason, self.time.monotonic())
        self._note("line", f"{status.value} {reason}".strip())
        self.facts.events.emit(StateChanged(self.state))

    async def _exchange(
        self,
        request: Request,
        kind: str,
        carry_out: Callable[[], Any],
        forbidden: Callable[[], str] | None = None,
        priority: Priority = Priority.POLL,
    ) -> Any:
        self._check(request, self.limits.get(request.device, CAUTIOUS), priority)
        while (wait := self._free - self.time.monotonic()) > CLOCK_STEP:
            await self.time.sleep(wait)
        if forbidden is not None and (why := forbidden()):
            raise RequestRefused(why)
        return self._decoded(request, await self._on_wire(request.device, request.pdu()))

    async def _on_wire(self, device: int, pdu: bytes) -> bytes | ExchangeError:
        """Return the reply of a drive, or the error without one; record it."""
        begun = self.time.monotonic()
        reply = None
        there = self._device(device)
        if not there.silent:
            reply = self.simulation.line.ask(device, pdu)
        took = TIMEOUT
        if reply is not None:
            took = ON_THE_WIRE + reply.turnaround if reply.took is None else reply.took
        self._free = begun + took
        await self.time.sleep(took)
        end = self.time.monotonic()
        data = b"" if reply is None else reply.data
        result = "nothing" if reply is None else "exception" if data[0] & 0x80 else "reply"
        error: ExchangeError | None = None
        place = device, pdu[0], int.from_bytes(pdu[1:3], "big")
        if reply is None:
            error = NoAnswer(*place)
        elif data[0] & 0x80:
            error = DeviceException(*place, data[1], STANDARD_EXCEPTIONS.get(data[1], ""))
        there.noted(error, end)
        self._count(device, took, error)
        ended = EndedExchange(device, pdu, result, data, begun, end, end, "panel")
        self._rows.append(reply_row(ended, "panel"))
        return data if error is None else error

    def _count(self, device: int, took: float, error: ExchangeError | None) -> None:
        tally = self._tally
        tally.count_sent(device, 0)
        tally.count_end(device, took, 0)
        if isinstance(error, NoAnswer):
            tally.count_silence(device, searched=False)
        else:
            tally.count_reply(device, took)
            tally.count_good(device, was_heard=True)
        if isinstance(error, DeviceException):
            tally.count_exception(device, error.code)

    @property
    def counters(self) -> LineCounters:
        """The counts of this moment."""
        return self._tally.frozen()

    @counters.setter
    def counters(self, value: LineCounters) -> None:
        """Those of a plain fake line are not used."""

    def _decoded(self, request: Request, found: bytes | ExchangeError) -> Any:
        if isinstance(found, ExchangeError):
            raise found
        if found[0] not in (3, 4):
            return None
        return tuple(int.from_bytes(found[at : at + 2], "big") for at in range(2, len(found), 2))

    async def identify(
        self, device: int, *, function: int = IDENTIFY, **_: Any
    ) -> IdentificationObjects:
        """Ask for the objects by function 43, until there are no more."""
        objects, wanted = Objects(), 0
        while True:
            while (wait := self._free - self.time.monotonic()) > CLOCK_STEP:
                await self.time.sleep(wait)
            found = await self._on_wire(device, bytes([IDENTIFY, 14, 1, wanted]))
            if isinstance(found, ExchangeError):
                raise found
            objects = objects.with_more(found)
            if objects.next_object is None:
                return IdentificationObjects(objects.conformity, objects.objects)
            wanted = objects.next_object

    def send_prepared(self, writes: Sequence[Any], ended: Callable[[str], None]) -> None:
        """Refuse: no test moves a motor here."""
        ended("Nothing is sent.")

    async def pass_time(self, seconds: float) -> None:
        """Let time go on, with all that happens on the way; the record has it then."""
        end = self.time.monotonic() + seconds
        for _ in range(TURNS):
            await asyncio.sleep(0)
        await self.time.run_to(end)
        self._file.write(self._rows, self._events)
        self._rows.clear()
        self._events.clear()

    def end_record(self) -> None:
        """Close the record; in the thread that created the line."""
        self._file.close()
