"""A line without a wire, for tests and for programs that want a `ModbusLine` of their own making.

    line = FakeLine({1: {3201: 0x0237, 8501: 0}})
    line.describe(1, limits)                                 # as DriveSession does
    line.fail_read(1, 3201, NoAnswer(1, 3, 3201), times=2)   # the next two reads of it
    line.fail_write(1, 8501, 4)                              # every write: exception 4
    line.delay(1, 0.2)                                       # its answers take so long
    line.silence(2)                                          # it answers nothing
    ... await line.read(1, 3201) ...
    assert line.requests == [Read(1, 3201, 1)]               # all that went out, in order

Registers, failures and delays may be changed at any time. Requests are checked as on a real line:
by the limits that describe() gave a device, and by read-only. All work runs in the caller's loop,
so a fake line belongs to one thread; it queues nothing and repeats nothing.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Coroutine, Mapping, Sequence
from typing import Any, TypeVar

from tui.wire.frames import BIT_READS, wire_place

from .api import LineWorker
from .coils import read_request, write_request
from .errors import ExchangeError, LineClosed, LineError, LineLost, NoAnswer, RequestRefused
from .expectation import IDENTIFY
from .fake_device import FakeDevice, PlannedFailure
from .limits import CAUTIOUS, Limits, send_refusal
from .line_events import StateChanged
from .link import Link, SerialLink
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
from .requests import BROADCAST, Diagnose, Identify, ReadWrite, ReportId, Request
from .schedule.pace import Pace
from .shared_state import SharedState
from .trace import Frame

T = TypeVar("T")


class FakeLine:
    """Devices as dictionaries of registers, failures by address, and a log of requests.

    `registers` are words by address by device, coils and inputs words of 0 or 1 by wire_place(). A
    device that is not among them is silent, an address that it lacks is refused with exception 2.
    """

    def __init__(
        self,
        registers: Mapping[int, Mapping[int, int]] | None = None,
        *,
        link: Link | None = None,
        read_only: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.link: Link = link or SerialLink("/dev/null")
        self.read_only = read_only
        self.held = ""
        self.timing = Timing()
        self.pace = Pace()
        self.facts = SharedState()
        self.devices = {n: FakeDevice(n, words) for n, words in (registers or {}).items()}
        """The devices; may be extended, and replaced by other implementations."""
        self.requests: list[Request] = []
        """All requests that were sent, in order; not the refused ones."""
        self.limits: dict[int, Limits] = {}
        """Arguments of describe()."""
        self.state = LineState(LineStatus.CONNECTED, "", clock())
        self.counters = LineCounters()
        """Never changed by the line, see `requests`; may be set."""
        self.trace: tuple[Frame, ...] = ()
        """No frames are made; may be set."""
        self._clock = clock
        self._workers: list[LineWorker] = []

    # What is to happen

    def fail_read(
        self, device: int, address: int | None, error: LineError | int, *, times: float = math.inf
    ) -> None:
        """Make reads of an address fail; None stands for any address.

        An int is the code of the exception with which the device refuses. `times` requests fail,
        one after another; 0 cancels the failures of that address.
        """
        self.devices[device].fail("read", PlannedFailure(error, address, times))

    def fail_write(
        self,
        device: int,
        address: int | None,
        error: LineError | int,
        *,
        times: float = math.inf,
        taken: bool = False,
    ) -> None:
        """Make writes fail, see fail_read; if `taken`, the device stores the words anyway.

        RequestRefused, Superseded, LineBusy and the like are raised before the request is sent.
        """
        self.devices[device].fail("write", PlannedFailure(error, address, times, taken))

    def fail_identify(
        self, device: int, error: LineError | int, *, times: float = math.inf
    ) -> None:
        """Let function 43/14 fail, see fail_read."""
        self.devices[device].fail("identify", PlannedFailure(error, None, times))

    def delay(self, device: int, seconds: float) -> None:
        """Delay each reply of a device."""
        self.devices[device].seconds = seconds

    def silence(self, device: int, silent: bool = True) -> None:
        """Make a device silent, or let it answer again."""
        self.devices[device].silent = silent

    def become(self, status: LineStatus, reason: str = "") -> None:
        """Lose the line, or regain it."""
        self.state = LineState(status, reason, self._clock())
        self.facts.events.emit(StateChanged(self.state))

    # A line

    def open(self, *, wait: float | None = None) -> None:
        """It is open from the beginning."""

    def close(self) -> None:
        """Close the line, and end its workers."""
        if self.state.status is not LineStatus.CLOSED:
            self.become(LineStatus.CLOSED)
        for worker in self._workers:
            worker.cancel()

    def describe(self, device: int, limits: Limits) -> None:
        """Set the requests that a device accepts."""
        self.limits[device] = limits

    def device_state(self, device: int) -> DeviceState:
        """Return the state set for the device, or derived from the requests so far."""
        return self._device(device).state

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
        """Read registers; nothing is shared here, so each is read again."""
        held = self._device(device).held
        request = read_request(device, address, count, function)
        place = wire_place(function, address) if function in BIT_READS else address
        words = await self._exchange(request, "read", lambda: held(place, count))
        return Reply(words, self._clock())

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
        """Write registers, once."""
        take = self._device(device).take
        functions = self.limits.get(device, CAUTIOUS).functions
        request = write_request(device, address, values, multiple, functions)
        await self._exchange(request, "write", lambda: take(address, values), forbidden, priority)
        return self._clock()

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
        """Write registers, then read others, once."""
        there = self._device(device)

        def both() -> tuple[int, ...]:
            there.take(write_address, values)
            return there.held(read_address, count)

        request = ReadWrite(device, read_address, count, write_address, tuple(values))
        return Reply(await self._exchange(request, "write", both, forbidden), self._clock())

    async def identify(
        self,
        device: int,
        *,
        priority: Priority = Priority.OPERATOR_READ,
        within: float | None = None,
        function: int = IDENTIFY,
    ) -> IdentificationObjects:
        """The objects that the device's `identity` holds; by function 17 those of `called`."""
        there = self._device(device)
        if function == ReportId.function:
            return await self._exchange(ReportId(device), "identify", there.own_words)
        return await self._exchange(Identify(device), "identify", there.objects)

    async def diagnose(
        self,
        device: int,
        subfunction: int,
        data: int = 0,
        *,
        priority: Priority = Priority.OPERATOR_READ,
    ) -> int:
        """Every sub-function gives its data back."""
        request = Diagnose(device, subfunction, data)
        return await self._exchange(request, "diagnose", lambda: data)

    async def broadcast(
        self,
        address: int,
        values: Sequence[int],
        *,
        limits: Limits,
        priority: Priority = Priority.OPERATOR_WRITE,
    ) -> float:
        """Write registers of all devices that have them."""
        request = write_request(BROADCAST, address, values, None, limits.broadcast_functions)
        self._check(request, limits, priority)
        self.requests.append(request)
        for device in self.devices.values():
            if not device.silent and address in device.words:
                device.take(address, values)
        return self._clock()

    def send_prepared(self, writes: Sequence[PreparedWrite], ended: Callable[[str], None]) -> None:
        """Have the devices carry out finished frames."""
        for write in writes:
            self.requests.append(write.request)
            device = self._device(write.request.device)
            if not device.silent:
                device.take(*write.request.written)
        ended("")

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        """Run a coroutine in the loop of the caller."""
        if self.state.status is LineStatus.CLOSED:
            raise LineClosed
        worker: LineWorker = asyncio.get_running_loop().create_task(work(), name=name)
        self._workers.append(worker)
        return worker

    # One exchange

    def _device(self, device: int) -> FakeDevice:
        """The device; an unknown one is silent."""
        if device not in self.devices:
            self.devices[device] = FakeDevice(device)
            self.devices[device].silent = True
        return self.devices[device]

    def _check(self, request: Request, limits: Limits, priority: Priority) -> None:
        """Refuse a request that a real line would not send."""
        held = "" if priority is Priority.STOP else self.held
        if reason := send_refusal(request, limits, read_only=self.read_only, held=held):
            raise RequestRefused(reason)
        if self.state.status is LineStatus.CLOSED:
            raise LineClosed
        if self.state.status is not LineStatus.CONNECTED:
            raise LineLost(self.state.reason)

    async def _exchange(
        self,
        request: Request,
        kind: str,
        carry_out: Callable[[], T],
        forbidden: Callable[[], str] | None = None,
        priority: Priority = Priority.POLL,
    ) -> T:
        """Check a request, log it, let the device do it, wait as long as its answer takes."""
        self._check(request, self.limits.get(request.device, CAUTIOUS), priority)
        if forbidden is not None and (why := forbidden()):
            raise RequestRefused(why)
        device = self._device(request.device)
        failure = device.next_failure(kind, request)
        error = failure.raised(request) if failure else None
        if error is not None and not isinstance(error, ExchangeError):
            raise error
        self.requests.append(request)
        if device.silent:
            error = NoAnswer(request.device, request.function, request.register)
        try:
            if not device.silent and (failure is None or failure.taken):
                done = carry_out()
            # the device has it by now, even if the caller no longer waits
            await asyncio.sleep(device.seconds)
            if error is not None:
                raise error
        except ExchangeError as raised:
            device.noted(raised, self._clock())
            raise
        device.noted(None, self._clock())
        return done
