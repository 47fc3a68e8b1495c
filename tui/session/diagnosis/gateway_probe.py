"""Other ways to reach a silent gateway: as another protocol, or for another unit.

Each try has a connection of its own and asks for one register, by function 3.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from tui.bus.link import RtuTcpLink, TcpLink
from tui.wire.frames import frame, is_whole

from .heard import REFUSED, TCP_HEAD

WITHIN = 1.0
"""Seconds for the connection, and for the reply."""
ANY_REGISTER = bytes.fromhex("030C810001")
"""A read whose RTU frame is not a message of Modbus TCP: its protocol would not be 0."""
GATEWAY_REFUSALS = (10, 11)
LONE_UNITS = (255, 0)
"""Units by which Modbus TCP reaches the only drive of a gateway."""
TRANSACTION = 0x4450


@dataclass(frozen=True, slots=True)
class Works:
    """The request that a gateway answers."""

    line: str
    """The line that works; empty if the unit is the difference."""
    unit: int | None = None


def _message(unit: int) -> bytes:
    head = TRANSACTION.to_bytes(2, "big") + b"\0\0" + (1 + len(ANY_REGISTER)).to_bytes(2, "big")
    return head + bytes([unit]) + ANY_REGISTER


def _answers_rtu(data: bytes, unit: int) -> bool:
    return data[:1] == bytes([unit]) and is_whole(data)


def _answers_tcp(data: bytes, unit: int) -> bool:
    right = data[:2] == TRANSACTION.to_bytes(2, "big") and data[TCP_HEAD : TCP_HEAD + 1] == bytes(
        [unit]
    )
    refused = len(data) > TCP_HEAD + 2 and data[TCP_HEAD + 1] & REFUSED
    return right and not (refused and data[TCP_HEAD + 2] in GATEWAY_REFUSALS)


async def probed(link: TcpLink | RtuTcpLink, device: int) -> Works | None:
    """Find a request that a silent gateway answers; None for nothing."""
    place = f"{link.host}:{link.port}"
    rtu = (frame(device, ANY_REGISTER), device, _answers_rtu, Works(f"rtu-tcp:{place}"))
    own = (_message(device), device, _answers_tcp, Works(f"tcp:{place}"))
    units = [(_message(unit), unit, _answers_tcp, Works("", unit)) for unit in LONE_UNITS]
    for request, unit, answers, works in [rtu, *units] if isinstance(link, TcpLink) else [own]:
        if await _answered(link, request, lambda data, a=answers, u=unit: a(data, u)):  # type: ignore[misc]
            return works
    return None


async def _answered(
    link: TcpLink | RtuTcpLink, request: bytes, right: Callable[[bytes], bool]
) -> bool:
    """True if the right reply comes on a connection of its own."""
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
