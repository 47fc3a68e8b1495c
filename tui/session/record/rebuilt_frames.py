"""Frames of a line as they were on the wire, made of the rows of its record; pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from .schema import DAMAGED, QUALITIES, STRAY, WRONG, ReplyRow, read_reply

CHECKED_REPLIES = ("good", "exception", "possible copy of the previous reply")
"""Qualities of replies of which the record has function and data."""
MULTIPLE, SINGLE = 16, 6
"""Functions that write registers, whose requests have the words."""
WRITE_REPLY = 5
"""Bytes of a request to write that its reply repeats."""
_NOTES = {DAMAGED: "damaged", WRONG: "not the reply"}


class RebuiltFrame(NamedTuple):
    """One frame, or what was received instead."""

    device: int
    data: bytes
    """Function and data without the checksum; with `checked` False all bytes as received."""
    wall: float
    """End of the frame in seconds since 1970."""
    request: bool
    checked: bool = True
    note: str = ""
    """Remark of the line on what was received, as it is in a trace."""


def frames_of(row: ReplyRow) -> Iterator[RebuiltFrame]:
    """Yield the request of an exchange, and what was received."""
    sent, came = row.utc / 1e6, (row.utc + row.took) / 1e6
    request = b""
    if row.quality != STRAY:
        request = row.sent if row.sent is not None else _request(row)
        yield RebuiltFrame(row.device, request, sent, request=True)
    if QUALITIES[row.quality] not in CHECKED_REPLIES:
        if row.received:
            note = _NOTES.get(row.quality, "")
            yield RebuiltFrame(row.device, row.received, came, False, False, note)
        return
    reply = row.received if row.received is not None else _reply(row, request)
    yield RebuiltFrame(row.device, reply, came, request=False)


def _request(row: ReplyRow) -> bytes:
    """The request of a function whose parts are in columns of their own."""
    words = row.words or b""
    parts = [bytes([row.function]), (row.address or 0).to_bytes(2, "big")]
    if row.function != SINGLE:
        parts.append(row.registers.to_bytes(2, "big"))
    if row.function == MULTIPLE:
        parts.append(bytes([len(words)]))
    if row.function in (SINGLE, MULTIPLE):
        parts.append(words)
    return b"".join(parts)


def _reply(row: ReplyRow, request: bytes) -> bytes:
    """The good reply of a function whose words are in a column of their own."""
    if row.function in (SINGLE, MULTIPLE):
        return request[:WRITE_REPLY]
    return read_reply(row.function, row.words or b"")
