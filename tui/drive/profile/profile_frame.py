"""Example frames of a profile: bytes of a request and its reply, and the values in them."""

from __future__ import annotations

from typing import NamedTuple

from tui.wire.frames import crc16

from .schema import ProfileFrame

READING, WRITING_ONE, WRITING_SEVERAL = (3, 4), 6, 16


class FrameError(ValueError):
    """An example frame that is not an exchange of a drive; the text gives the reason."""


class FrameContents(NamedTuple):
    """Contents of an example frame."""

    request: bytes
    """Request without address and checksum."""
    reply: bytes
    function: int
    address: int
    words: tuple[int, ...]
    """Words that are read or written, from the address on."""


def frame_contents(frame: ProfileFrame) -> FrameContents:
    """Return the contents of an example frame; raises FrameError."""
    sent, answered = _unsealed("sent", frame.sent), _unsealed("answered", frame.answered)
    if sent[0] != answered[0] or sent[1] != answered[1]:
        raise FrameError("answered is from another drive, or of another function.")
    request, reply = sent[1:], answered[1:]
    function, address = request[0], int.from_bytes(request[1:3], "big")
    if function in READING:
        data = reply[2:]
        if len(data) != reply[1] or len(data) != 2 * int.from_bytes(request[3:5], "big"):
            raise FrameError("answered has another number of words than sent.")
    elif function == WRITING_ONE:
        data = request[3:5]
    elif function == WRITING_SEVERAL:
        data = request[6:]
    else:
        raise FrameError(f"function {function} neither reads nor writes registers.")
    words = tuple(int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2))
    return FrameContents(request, reply, function, address, words)


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
