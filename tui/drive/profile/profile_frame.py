"""Example frames of a profile: bytes of a request and its reply, and the values in them."""

from __future__ import annotations

from typing import NamedTuple

from tui.wire.frames import BIT_READS, SPACES, bits_of, crc16

from .schema import ProfileFrame

READING, WRITING_COIL, WRITING_ONE, WRITING_COILS, WRITING_SEVERAL = SPACES, 5, 6, 15, 16


class FrameError(ValueError):
    """An example frame that is not an exchange of a drive; the text gives the reason."""


class FrameContents(NamedTuple):
    """Contents of an example frame."""

    request: bytes
    """Request without address and checksum."""
    reply: bytes
    function: int
    space: int
    """Function that reads the address space."""
    address: int
    words: tuple[int, ...]
    """Words or coils that are read or written, from the address on."""


def frame_contents(frame: ProfileFrame) -> FrameContents:
    """Return the contents of an example frame; raises FrameError."""
    sent, answered = _unsealed("sent", frame.sent), _unsealed("answered", frame.answered)
    if sent[0] != answered[0] or sent[1] != answered[1]:
        raise FrameError("answered is from another drive, or of another function.")
    request, reply = sent[1:], answered[1:]
    function, address = request[0], int.from_bytes(request[1:3], "big")
    space = 1 if function in (WRITING_COIL, WRITING_COILS) else 3
    count = int.from_bytes(request[3:5], "big")
    if function in BIT_READS or function == WRITING_COILS:
        bits = reply[2:] if function in BIT_READS else request[6:]
        if len(bits) != (count + 7) // 8:
            raise FrameError("it has another number of bits than sent.")
        space = function if function in BIT_READS else space
        return FrameContents(request, reply, function, space, address, bits_of(bits, count))
    if function == WRITING_COIL:
        return FrameContents(request, reply, function, space, address, (int(count != 0),))
    if function in READING:
        space, data = function, reply[2:]
        if len(data) != reply[1] or len(data) != 2 * count:
            raise FrameError("answered has another number of words than sent.")
    elif function == WRITING_ONE:
        data = request[3:5]
    elif function == WRITING_SEVERAL:
        data = request[6:]
    else:
        raise FrameError(f"function {function} neither reads nor writes registers.")
    words = tuple(int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2))
    return FrameContents(request, reply, function, space, address, words)


def _unsealed(key: str, text: str) -> bytes:
    """Return the bytes of a frame without its checksum."""
    try:
        frame = bytes.fromhex(text)
    except ValueError:
        raise FrameError(f"{key} is not a row of bytes in hexadecimal.") from None
    if len(frame) < 5:
        raise FrameError(f"{key} is too short for a frame.")
    if crc16(frame):
        raise FrameError(f"{key} has a wrong checksum.")
    return frame[:-2]
