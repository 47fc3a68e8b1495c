"""The one owner of a line: queues requests, sends them one at a time, hands back the replies."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from tui.safety import LATE_REPLY

from .coils import read_request, write_request
from .errors import RequestRefused, WrongReply
from .expectation import IDENTIFY
from .limits import Limits, send_refusal
from .link import Link
from .model import (
    DeviceState,
    IdentificationObjects,
    LineCounters,
    LineState,
    LineStatus,
    Priority,
    Reply,
    Timing,
)
from .prepared import PreparedWrite
from .program import Program
from .requests import (
    BROADCAST,
    REFERENCE,
    Diagnose,
    Identify,
    Objects,
    ReadWrite,
    ReportId,
    Request,
    diagnostic_of,
    own_words_of,
)
from .schedule.engine import Engine
from .schedule.patience import Devices
from .schedule.queue import Job
from .schedule.worker import ThreadWork, Worker
from .share.place import SharePlace
from .share.sharing import ShareLine, Sharing
from .shared_state import SharedState
from .trace import Frame

__all__ = [
    "DeviceState",
    "Frame",
    "IdentificationObjects",
    "Line",
    "LineCounters",
    "LineState",
    "LineStatus",
    "Priority",
    "Reply",
    "Timing",
    "Worker",
]

# frames of the protocol library are traced here; its own log must not reach the terminal
logging.getLogger("pymodbus").propagate = False
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class Line:
    """A line shared by everything that talks to its devices.

    All methods may be called from any thread, all coroutines awaited in any loop. Each raises
    LineClosed, LineLost, LineBusy or RequestRefused when nothing was sent (a lost line also
    during an exchange), and the ExchangeErrors when something was. To cancel an await does not
    cancel an exchange in flight; a request that still waits is not sent then.
    """

    def __init__(
        self,
        link: Link,
        *,
        read_only: bool = False,
        timing: Timing | None = None,
        clock: Callable[[], float] = time.monotonic,
        place: SharePlace | None = None,
        program: Program | None = None,
        share: ShareLine = Sharing,
        gated: bool = False,
    ) -> None:
        self.link, self.read_only = link, read_only
        self.held = ""
        self.timing = timing or timing_of(link)
        self.facts = SharedState(program)
        self.facts.gated = gated  # nothing is written to a device that is not armed
        """State shared by the programs on the line."""
        shared = partial(share, place) if place is not None else None
        self._engine = Engine(link, self.timing, clock, self.facts, shared)
        self.pace = self._engine.pace
        """Shares the line's time out among regular polls."""

    def open(self, *, wait: float | None = None) -> None:
        """Start the line; it connects and reconnects automatically.

        With `wait` the call returns once connected. Else it closes the line and raises PortBusy,
        PortMissing, PortRefused at once, or LineLost after that many seconds.
        """
        self._engine.start(wait)

    def close(self) -> None:
        """Close the line; requests that wait fail with LineClosed. May be called twice."""
        self._engine.close()

    @property
    def state(self) -> LineState:
        """State of the line; if it is unusable, with the reason and the time of the next
        attempt."""
        return self._engine.state

    @property
    def counters(self) -> LineCounters:
        """Counts since the line was opened."""
        return self._engine.tally.frozen()

    @property
    def trace(self) -> tuple[Frame, ...]:
        """The last frames, oldest first."""
        return self._engine.trace.frames()

    @property
    def _devices(self) -> Devices:
        return self._engine.devices

    def describe(self, device: int, limits: Limits) -> None:
        """Set the requests that a device accepts; the default is CAUTIOUS."""
        self._devices.describe(device, limits)

    def device_state(self, device: int) -> DeviceState:
        """Return the line's knowledge of a device."""
        return self._devices.state(device)

    async def read(
        self,
        device: int,
        address: int,
        count: int = 1,
        *,
        priority: Priority = Priority.POLL,
        function: int = 3,
        max_age: float = 0.0,
        within: float | None = None,
    ) -> Reply:
        """Read `count` registers by function 3, input registers by 4, coils by 1, inputs by 2.

        What was read for another program up to `max_age` seconds ago is taken in its place.
        `within` is in how many seconds the answer is to begin; see tui.bus.api.
        """
        request = read_request(device, address, count, function)
        return await self._ask(request, priority, max_age=max_age, within=within)

    async def write(
        self,
        device: int,
        address: int,
        values: Sequence[int],
        *,
        priority: Priority = Priority.OPERATOR_WRITE,
        multiple: bool | None = None,
        replaceable: bool = False,
        forbidden: Callable[[], str] | None = None,
        within: float | None = None,
    ) -> float:
        """Write registers, once; returns when the answer came (line's clock, seconds).

        One word goes by function 6 and more by 16, unless `multiple` says which; a device with
        only one of them gets that. At the place of a coil they go by functions 5 and 15. The answer
        alone proves little: read back. A `replaceable` write (a reference, never a command) raises
        Superseded without having been sent when a newer one of the same register came while it
        waited. `forbidden` is asked in the line's thread just before the frame goes out; where it
        gives a reason, RequestRefused is raised in its place.
        """
        limits = self._devices[device].limits
        request = write_request(device, address, values, multiple, limits.functions)
        reply = await self._ask(
            request, priority, replaceable=replaceable, forbidden=forbidden, within=within
        )
        return reply.time

    async def read_write(
        self,
        device: int,
        read_address: int,
        count: int,
        write_address: int,
        values: Sequence[int],
        *,
        priority: Priority = Priority.OPERATOR_WRITE,
        forbidden: Callable[[], str] | None = None,
    ) -> Reply:
        """Write registers, then read `count` others, by function 23, once; see `write`."""
        request = ReadWrite(device, read_address, count, write_address, tuple(values))
        return await self._ask(request, priority, forbidden=forbidden)

    async def diagnose(
        self,
        device: int,
        subfunction: int,
        data: int = 0,
        *,
        priority: Priority = Priority.OPERATOR_READ,
    ) -> int:
        """Send a request of function 8; returns the data word of the reply."""
        return diagnostic_of((await self._ask(Diagnose(device, subfunction, data), priority)).pdu)

    async def identify(
        self,
        device: int,
        *,
        priority: Priority = Priority.OPERATOR_READ,
        within: float | None = None,
        function: int = IDENTIFY,
    ) -> IdentificationObjects:
        """Request a device's identity by function 43/14, until nothing more follows; or by 17."""
        if function == ReportId.function:
            reply = await self._ask(ReportId(device), priority, within=within)
            return IdentificationObjects(0, {REFERENCE: own_words_of(reply.pdu)})
        found = Objects()
        while (first := found.next_object) is not None:
            request = Identify(device, first_object=first)
            found = found.with_more((await self._ask(request, priority, within=within)).pdu)
            if found.trouble:
                raise WrongReply(device, request.function, 0, found.trouble)
        return IdentificationObjects(found.conformity, found.objects)

    async def broadcast(
        self,
        address: int,
        values: Sequence[int],
        *,
        limits: Limits,
        priority: Priority = Priority.OPERATOR_WRITE,
    ) -> float:
        """Write registers of all devices; returns when it was sent (line's clock, seconds).

        Nobody answers; the line is left quiet afterwards, which this waits for.
        """
        request = write_request(BROADCAST, address, values, None, limits.broadcast_functions)
        return (await self._ask(request, priority, limits)).time

    def send_prepared(self, writes: Sequence[PreparedWrite], ended: Callable[[str], None]) -> None:
        """Send the finished frames of a stop around the queue; see tui.bus.api."""
        if self.read_only:
            ended("the line is read-only")
        else:
            self._engine.send_prepared(writes, ended)

    def spawn(self, work: ThreadWork, name: str) -> Worker:
        """Run a coroutine in the line's own loop, where no screen can delay it.

        The line must be open. The coroutine is canceled when the line is closed. Raises LineClosed.
        """
        return self._engine.spawn(work, name)

    async def _ask(
        self,
        request: Request,
        priority: Priority,
        limits: Limits | None = None,
        *,
        replaceable: bool = False,
        forbidden: Callable[[], str] | None = None,
        max_age: float = 0.0,
        within: float | None = None,
    ) -> Reply:
        """Check a request, queue it, await its reply."""
        limits = limits or self._devices[request.device].limits
        held = "" if priority is Priority.STOP else self.held
        reason = send_refusal(request, limits, read_only=self.read_only, held=held)
        if reason:
            raise RequestRefused(reason)
        job = Job(request, priority, limits, replaceable=replaceable, forbidden=forbidden)
        job.max_age, job.within = max_age, within
        self._engine.submit(job)
        return await asyncio.wrap_future(job.answer)


def timing_of(link: Link) -> Timing:
    """The usual timing of a line, with the timeout that a person has set."""
    usual = Timing()
    if link.timeout is None:
        return usual
    return replace(
        usual,
        first_timeout=link.timeout,
        min_timeout=min(usual.min_timeout, link.timeout),
        scan_timeout=min(usual.scan_timeout, link.timeout),
        patient_timeout=max(usual.patient_timeout, link.timeout),
        late_reply=max(usual.late_reply, LATE_REPLY * link.timeout),
    )
