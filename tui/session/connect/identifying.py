"""Identification requests to a drive, until the answer or its absence is certain."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Protocol

from tui.bus.api import (
    DeviceCounters,
    IdentificationObjects,
    LineCounters,
    Priority,
    Reply,
)
from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    ExchangeError,
    NoAnswer,
    RequestRefused,
    WrongReply,
)
from tui.bus.expectation import IDENTIFY

TRIES = 3
"""Number of requests for one identification if replies are lost or damaged."""

ControlRead = Callable[[], Awaitable[bool]]
"""Sends a request that the device is known to answer; False if no intact reply arrived."""


class Askable(Protocol):
    """The part of a line that identification uses."""

    @property
    def counters(self) -> LineCounters:
        """Counts since the line was opened."""
        ...

    async def identify(
        self,
        device: int,
        *,
        priority: Priority,
        within: float | None = None,
        function: int = IDENTIFY,
    ) -> IdentificationObjects:
        """Request the identification by function 43 or 17."""
        ...

    async def read(
        self,
        device: int,
        address: int,
        count: int = 1,
        *,
        priority: Priority,
        within: float | None = None,
    ) -> Reply:
        """Read holding registers by function 3."""
        ...


class NotIdentified(ChecksumFault):
    """Lost or damaged frames left the identity of a device open."""

    def __init__(self, device: int, function: int = IDENTIFY) -> None:
        text = (
            f"No identification of device {device} came through: frames were lost or damaged."
            " Its family is not known; identify it again."
        )
        super().__init__(device, function, 0, text)


async def ask_identification(
    line: Askable,
    device: int,
    control: ControlRead,
    *,
    priority: Priority,
    within: float | None = None,
    function: int = IDENTIFY,
    tries: int = TRIES,
    silences: int = TRIES,
    healthy: bool = False,
) -> IdentificationObjects | None:
    """The identification of a device that is present; None if it has none.

    It has none if it refuses the function, or leaves `silences` requests unanswered on a line that
    carried all other frames intact. With `healthy`, the line must have done so for the last minute.
    Raises ChecksumFault or WrongReply if the result is uncertain.
    """
    damage = _damage(line)
    unclear: ExchangeError | None = None
    for _ in range(tries):
        try:
            return await line.identify(device, priority=priority, within=within, function=function)
        except (DeviceException, RequestRefused):
            return None
        except (ChecksumFault, WrongReply) as error:
            unclear = error
        except NoAnswer:
            if not await control():
                unclear = NotIdentified(device, function)
            silences -= 1
            if not silences:
                break
    if unclear is not None:
        raise unclear
    if _damage(line) != damage or (healthy and _is_sick(line, device)):
        raise NotIdentified(device, function)
    return None


async def intact(request: Awaitable[object]) -> bool:
    """True if a device answers a request, also if it refuses it."""
    try:
        await request
    except (DeviceException, RequestRefused):
        return True
    except ExchangeError:
        return False
    return True


def _damage(line: Askable) -> int:
    """Number of replies on the line that were damaged or from another device."""
    return line.counters.checksum + line.counters.wrong


def _is_sick(line: Askable, device: int) -> bool:
    """True if faults of the line in its last minute may explain this device's missing reply.

    Replies missed by the device itself do not count: without the function it misses each request.
    """
    counted = line.counters
    own = counted.devices.get(device, DeviceCounters()).minute.lost
    minute = counted.minute
    return bool(minute.damaged or minute.foreign or minute.strays) or minute.lost > own
