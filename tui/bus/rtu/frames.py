"""Frames of Modbus RTU inside whatever bytes a line delivers: pure functions, no clock."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tui.wire.frame_search import frame_ends
from tui.wire.frames import is_whole

from ..expectation import EXCEPTION, Expectation, exception_code, exception_extents
from ..result import Piece


@dataclass(frozen=True, slots=True)
class Match:
    """The awaited reply inside received bytes, from `start` to `end`."""

    start: int
    end: int
    pdu: bytes
    exception: int | None = None


def find_reply(
    data: bytes | bytearray,
    device: int,
    expectation: Expectation,
    *,
    start: int = 0,
    exceptions: bool = True,
) -> Match | None:
    """The first reply from `start` on that is the awaited one, checksum included.

    With `exceptions` a refusal of the awaited function counts as well.
    """
    at = data.find(device, start)
    while at >= 0:
        for match in _candidates(data, at, expectation, exceptions):
            if is_whole(data[match.start : match.end]):
                return match
        at = data.find(device, at + 1)
    return None


def _candidates(
    data: bytes | bytearray, at: int, expectation: Expectation, exceptions: bool
) -> Iterator[Match]:
    extent = expectation.extent(data, at + 1)
    if extent and at + extent + 3 <= len(data):
        yield Match(at, at + extent + 3, bytes(data[at + 1 : at + 1 + extent]))
    function = expectation.function
    if not exceptions or data[at + 1 : at + 2] != bytes([function | EXCEPTION]):
        return
    for length in exception_extents(function):
        pdu = bytes(data[at + 1 : at + 1 + length])
        code = exception_code(function, pdu)
        if code is not None and at + length + 3 <= len(data):
            yield Match(at, at + length + 3, pdu, code)


def pieces(data: bytes | bytearray) -> list[Piece]:
    """Received bytes taken apart into whole frames and what lies between them."""
    found: list[Piece] = []
    loose = 0
    for at, end in sorted(frame_ends(data).items()):
        if at < loose:
            continue  # inside the frame before
        if at > loose:
            found.append(Piece(bytes(data[loose:at]), whole=False))
        found.append(Piece(bytes(data[at:end]), whole=True))
        loose = end
    if len(data) > loose:
        found.append(Piece(bytes(data[loose:]), whole=False))
    return found


def begins_reply(data: bytes, device: int, function: int) -> bool:
    """Return True if a reply of the device to the function seems to begin somewhere in the
    bytes."""
    heads = (bytes([device, function]), bytes([device, function | EXCEPTION]))
    return any(head in data for head in heads)
