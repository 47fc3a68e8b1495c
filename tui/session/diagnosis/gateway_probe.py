"""Probes of a silent gateway by another protocol, or for another unit.

Each probe reads one register, by function 3.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from tui.bus.api import ModbusLine, Priority
from tui.bus.errors import DeviceException, LineError
from tui.bus.link import ONLY_UNITS, RtuTcpLink, TcpLink, label
from tui.drive.profile.profile import Profile
from tui.wire.frames import frame, is_whole

from .reply_evidence import REFUSED, TCP_HEAD, is_whole_tcp

WITHIN = 1.0
"""Seconds each for the connection and for the reply."""
ANY_REGISTER = bytes.fromhex("030C810001")
"""A read whose RTU frame is not a message of Modbus TCP: its protocol would not be 0."""
GATEWAY_CODES = {10: "0A, it has no way to the drive", 11: "0B, the drive did not answer it"}
GATEWAY_REFUSALS = frozenset(GATEWAY_CODES)
ANY_UNIT, NO_UNIT = ONLY_UNITS
"""The line has no requests to 0."""
TRANSACTION = 0x4450


@dataclass(frozen=True, slots=True)
class Works:
    """The request that a gateway answers."""

    line: str
    unit: int | None = None
    """The unit that the gateway answers, if the unit is the difference."""


def _message(unit: int) -> bytes:
    head = TRANSACTION.to_bytes(2, "big") + b"\0\0" + (1 + len(ANY_REGISTER)).to_bytes(2, "big")
    return head + bytes([unit]) + ANY_REGISTER


def _answers_rtu(data: bytes, unit: int) -> bool:
    return data[:1] == bytes([unit]) and is_whole(data)


def _speaks_tcp(data: bytes, unit: int) -> bool:
    """True for a whole message to a unit; a gateway that misses its drive speaks TCP, too."""
    own = data[:2] == TRANSACTION.to_bytes(2, "big")
    return own and data[TCP_HEAD : TCP_HEAD + 1] == bytes([unit]) and is_whole_tcp(data)


def _answers_tcp(data: bytes, unit: int) -> bool:
    refused = len(data) > TCP_HEAD + 2 and data[TCP_HEAD + 1] & REFUSED
    missed = refused and data[TCP_HEAD + 2] in GATEWAY_REFUSALS
    return _speaks_tcp(data, unit) and not missed


def gateway_codes(profile: Profile | None) -> frozenset[int]:
    """Return the exceptions of a gateway that did not reach the drive, except those of the
    family."""
    own = (
        {exception.code for exception in profile.data.exceptions} if profile is not None else set()
    )
    return GATEWAY_REFUSALS - own


async def probed(line: ModbusLine, device: int, *, beside: bool = True) -> Works | None:
    """Find a request that a silent gateway answers; None if there is none.

    The line itself is tried first. A second connection might end that of the line, as many gateways
    accept one client. So it is tried only with `beside`, if the line never returned a reply and no
    other program uses it.
    """
    link = line.link
    assert isinstance(link, TcpLink | RtuTcpLink)
    others = {
        unit for unit, device_counters in line.counters.devices.items() if device_counters.replies
    }
    if others - {device, ANY_UNIT}:
        return None  # the gateway passes units on
    if isinstance(link, TcpLink) and link.unit is None and await _reads(line, ANY_UNIT):
        return _by_unit(link, ANY_UNIT)
    counters = line.counters
    if not beside or counters.replies or counters.exceptions or line.facts.others:
        return None
    over_rtu = Works(label(RtuTcpLink(link.host, link.port)))
    over_tcp = Works(label(TcpLink(link.host, link.port)))
    rtu = (frame(device, ANY_REGISTER), device, _answers_rtu, over_rtu)
    own = (_message(device), device, _speaks_tcp, over_tcp)
    unit = (_message(NO_UNIT), NO_UNIT, _answers_tcp, _by_unit(link, NO_UNIT))
    for request, named, answers, works in [rtu, unit] if isinstance(link, TcpLink) else [own]:
        if await _answered(link, request, lambda data, a=answers, u=named: a(data, u)):  # type: ignore[misc]
            return works
    return None


def _by_unit(link: TcpLink | RtuTcpLink, unit: int) -> Works:
    return Works(label(TcpLink(link.host, link.port, link.timeout, unit)), unit)


async def _reads(line: ModbusLine, unit: int) -> bool:
    """True if a unit answers on the line, by a value or a refusal of its own."""
    address = int.from_bytes(ANY_REGISTER[1:3], "big")
    try:
        await line.read(unit, address, 1, priority=Priority.OPERATOR_READ, within=WITHIN)
    except DeviceException as error:
        return error.code not in GATEWAY_REFUSALS
    except LineError:
        return False
    return True


async def _answered(
    link: TcpLink | RtuTcpLink, request: bytes, right: Callable[[bytes], bool]
) -> bool:
    """True if the expected reply arrives on a separate connection."""
    data = b""
    with suppress(OSError, TimeoutError):
        async with asyncio.timeout(WITHIN):
            reader, writer = await asyncio.open_connection(link.host, link.port)
        try:
            writer.write(request)
            async with asyncio.timeout(WITHIN):
                while not right(data) and (more := await reader.read(300)):
                    data += more
        finally:
            writer.close()
    return right(data)
