"""Requests that sessions, screens and commands make to a line: the Protocol `ModbusLine`.

`tui.bus.line.Line` is the one for live drives, `tui.bus.fake.FakeLine` the one without a wire.
Whatever only uses a line types against the Protocol; only who opens a line names `Line`. The
values that go with it can be imported from here too, without what a real line is made of.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from .expectation import IDENTIFY
from .model import (
    TURNAROUND_EDGES,
    Contact,
    DeviceCounters,
    DeviceState,
    IdentificationObjects,
    LastMinute,
    LineCounters,
    LineState,
    LineStatus,
    Priority,
    Reply,
    Timing,
    contact_of,
)
from .trace import Frame

if TYPE_CHECKING:
    from .limits import Limits
    from .link import Link
    from .prepared import PreparedWrite
    from .schedule.pace import Pace
    from .shared_state import SharedState

__all__ = [
    "TURNAROUND_EDGES",
    "Contact",
    "DeviceCounters",
    "DeviceState",
    "Frame",
    "IdentificationObjects",
    "LastMinute",
    "LineCounters",
    "LineState",
    "LineStatus",
    "LineWorker",
    "ModbusLine",
    "Priority",
    "Reply",
    "contact_of",
]


class LineWorker(Protocol):
    """A coroutine at work in the line's loop; all methods may be called from any thread."""

    def cancel(self) -> object:
        """Ask the work to end; more than once does no harm."""

    def done(self) -> bool:
        """True if the work has ended: completed, by cancel() or by an error."""


class ModbusLine(Protocol):
    """A line shared by everything that talks to its devices.

    A device is 1..247, an address a register number from 0, a word 0..65535, a time the line's
    clock in seconds. Requests go out one at a time: by priority, then first come first served.
    Each raises LineClosed, LineLost, LineBusy or RequestRefused where nothing was sent (a lost
    line also during an exchange), and an ExchangeError where something was: NoAnswer,
    ChecksumFault, WrongReply or DeviceException. A read may be repeated, a write never is.
    """

    held: str
    """Reason, as a sentence, if only stops are written until a person confirms; else empty."""

    @property
    def link(self) -> Link:
        """Serial port or connection of the line."""

    @property
    def read_only(self) -> bool:
        """True if everything that changes a device is refused with RequestRefused."""

    @property
    def timing(self) -> Timing:
        """Timeouts for replies."""

    @property
    def pace(self) -> Pace:
        """Shares the line's time out among regular polls."""

    @property
    def facts(self) -> SharedState:
        """State shared by the programs on the line: commanders, stops; and the line's events."""

    @property
    def state(self) -> LineState:
        """State of the line; if it is unusable, with the reason and the time of the next
        attempt."""

    @property
    def counters(self) -> LineCounters:
        """Counts since the line was opened."""

    @property
    def trace(self) -> tuple[Frame, ...]:
        """The last frames, oldest first."""

    def open(self, *, wait: float | None = None) -> None:
        """Start the line; with `wait` return once connected, or raise after so many seconds."""

    def close(self) -> None:
        """Close the line; requests that wait fail with LineClosed. May be called twice."""

    def describe(self, device: int, limits: Limits) -> None:
        """Set the requests that a device accepts; an undescribed one gets reads of one word
        only."""

    def device_state(self, device: int) -> DeviceState:
        """Return the line's knowledge of a device."""

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

        A value that another program read up to `max_age` seconds ago is used instead. `within` is
        the timeout in seconds, from the end of the request to the start of the reply, for an
        address that may have no device. By default it follows from the line's knowledge of the
        device.
        """

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
        """Write registers, once; returns when the answer came.

        One word goes by function 6 and more by 16, unless `multiple` says which. At the place of a
        coil (wire_place() in tui.wire.frames) they are coils, by functions 5 and 15. A
        `replaceable` write that a newer one of the same register overtook raises Superseded,
        unsent. `forbidden` is asked just before the frame goes out; a reason that it gives is
        raised as RequestRefused in its place. `within` as for a read.
        """

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

    async def identify(
        self,
        device: int,
        *,
        priority: Priority = Priority.OPERATOR_READ,
        within: float | None = None,
        function: int = IDENTIFY,
    ) -> IdentificationObjects:
        """Request a device's identity by function 43/14, or by 17; `within` as for a read.

        The text of function 17 is object 1, the reference, with conformity 0.
        """

    async def diagnose(
        self,
        device: int,
        subfunction: int,
        data: int = 0,
        *,
        priority: Priority = Priority.OPERATOR_READ,
    ) -> int:
        """Send a request of function 8; returns the data word of the reply."""

    async def broadcast(
        self,
        address: int,
        values: Sequence[int],
        *,
        limits: Limits,
        priority: Priority = Priority.OPERATOR_WRITE,
    ) -> float:
        """Write registers of all devices; returns when it was sent. Nobody answers."""

    def send_prepared(self, writes: Sequence[PreparedWrite], ended: Callable[[str], None]) -> None:
        """Send the finished frames of a stop around the queue, after an internal error.

        `ended` gets the reason if one of them was not sent, else an empty text; in the line's
        thread, or at once. No reply is awaited. Raises LineClosed.
        """

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        """Run a coroutine in the line's own loop; it ends with the line. Raises LineClosed."""
