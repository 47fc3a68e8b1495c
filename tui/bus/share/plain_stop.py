"""A stop in a form that never changes: any version of any program may send it to a line's owner.

    STOP 2 3    the devices at these addresses
    STOP all    every device that the owner knows

It is one line of ASCII text, in place of a Hello. The answer is GIVEN, then the connection closes.
The shell's short way sends it before anything slow is imported: tui.cli.short_stop.
"""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Collection, Iterable
from pathlib import Path

from ..program import Program
from .messages import NoMessage, StopGiven
from .place import Peer, reached

STOP_HEAD = b"STOP"
"""Read as the length of a message, this is longer than any."""
GIVEN = b"GIVEN\n"
LONGEST_PLAIN_STOP = 1100
"""Bytes of such a line after its head; all addresses take fewer."""
GIVEN_WITHIN = 0.5
"""Seconds for each step of sending such a line."""
_DEVICES = range(1, 248)
_ADDRESSES = {str(device).encode(): device for device in _DEVICES}
_ALL = [b"all"]
_BY = "drivepanel stop"


async def plain_stop(
    reader: asyncio.StreamReader, known: Collection[int], peer: Peer | None
) -> StopGiven:
    """The stop of a program that has sent its head; a program of its own gives it.

    `known` are the devices that are meant by all. Raises NoMessage, EOFError, OSError.
    """
    try:
        line = await reader.readuntil(b"\n")
    except asyncio.LimitOverrunError as error:
        raise NoMessage("a stop without an end") from error
    devices = stop_devices(line, known)
    program = Program(uuid.uuid4().hex, "stop", peer.pid if peer is not None else 0)
    return StopGiven(devices, (1,) * len(devices), _BY, program)


def send_plain_stop(address: Path, devices: Iterable[int]) -> None:
    """Send such a line to the socket of a holder, and await its answer. Raises OSError."""
    with reached(address, GIVEN_WITHIN) as connection:
        connection.sendall(b"%s %s\n" % (STOP_HEAD, " ".join(map(str, devices)).encode()))
        if connection.recv(len(GIVEN)) != GIVEN:
            raise OSError(f"{address} does not take a stop")


def stop_devices(line: bytes, known: Collection[int]) -> tuple[int, ...]:
    """The devices that the rest of such a line names, each once. Raises NoMessage."""
    if len(line) > LONGEST_PLAIN_STOP:
        raise NoMessage("a stop that is too long")
    blank, *words = line.removesuffix(b"\n").split(b" ")
    if blank or not words:
        raise NoMessage("a stop without a device")
    if words == _ALL:
        return tuple(device for device in known if device in _DEVICES)
    try:
        return tuple(dict.fromkeys(_ADDRESSES[word] for word in words))
    except KeyError:
        raise NoMessage("a stop of a wrong address") from None
