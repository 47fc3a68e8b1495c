"""Length of a frame from its first bytes, as a request and as a reply. Pure functions.

A listener does not know if a frame is a request or a reply. Pauses do not show it either, because
an adapter delivers collected bytes.
"""

from __future__ import annotations

from ..frames import MAX_FRAME, MIN_FRAME, is_whole

REFUSAL = 0x80
"""Bit that a reply sets in the function code to refuse a request."""
IDENTIFICATION, IDENTIFICATION_KIND = 43, 14
_CHECKSUM = 2
_REQUESTS = {1: 8, 2: 8, 3: 8, 4: 8, 5: 8, 6: 8, 7: 4, 8: 8, 11: 4, 12: 4, 17: 4, 22: 10, 43: 7}
_COUNTED_REQUESTS = {15: 6, 16: 6, 23: 10}
"""By function, the offset of the byte that counts the bytes after it."""
_REPLIES = {5: 8, 6: 8, 7: 5, 8: 8, 11: 8, 15: 8, 16: 8, 22: 10}
_COUNTED_REPLIES = {1: 2, 2: 2, 3: 2, 4: 2, 12: 2, 17: 2, 23: 2}
_OBJECTS_FROM = 8
"""Offset of the objects in an identification; the byte before is their number."""
SAME_BOTH_WAYS = frozenset({5, 6, 8, 22})
"""Functions whose reply may be equal to the request."""

Lengths = tuple[int, ...] | None
"""Possible lengths of a frame; None if more bytes are needed."""


def request_lengths(head: bytes | bytearray) -> Lengths:
    """Return the lengths of requests with this beginning; empty if there is none."""
    if len(head) < 2:
        return None
    function = head[1]
    if (place := _COUNTED_REQUESTS.get(function)) is not None:
        return _counted(head, place)
    return (_REQUESTS[function],) if function in _REQUESTS else ()


def reply_lengths(head: bytes | bytearray) -> Lengths:
    """Return the lengths of replies with this beginning; empty if there is none."""
    if len(head) < 2:
        return None
    function = head[1]
    if function & REFUSAL:
        # a refused identification may or may not contain its kind
        return (5, 6) if function & ~REFUSAL == IDENTIFICATION else (5,)
    if function == IDENTIFICATION:
        return _identification(head)
    if (place := _COUNTED_REPLIES.get(function)) is not None:
        return _counted(head, place)
    return (_REPLIES[function],) if function in _REPLIES else ()


def _counted(head: bytes | bytearray, place: int) -> Lengths:
    return (place + 1 + head[place] + _CHECKSUM,) if len(head) > place else None


def _identification(head: bytes | bytearray) -> Lengths:
    """Return the length from the lengths of its objects."""
    if len(head) < _OBJECTS_FROM:
        return () if len(head) > 2 and head[2] != IDENTIFICATION_KIND else None
    at = _OBJECTS_FROM
    for _ in range(head[at - 1]):
        if len(head) < at + 2:
            return None
        at += 2 + head[at + 1]
        if at + _CHECKSUM > MAX_FRAME:
            return ()
    return (at + _CHECKSUM,)


def whole_length(data: bytes | bytearray) -> int:
    """Return the length of the whole frame at the beginning, by its function; 0 if there is
    none."""
    found = {*(request_lengths(data) or ()), *(reply_lengths(data) or ())}
    # if the checksum ends with a zero, the frame also seems whole without it
    return _whole(data, tuple(sorted(found, reverse=True)))


def due_length(data: bytes | bytearray, *, reply: bool) -> int:
    """Return the same if it is known that a reply, or a request, is due.

    A frame of the other kind does not count while the due one is still possible. A frame that ends
    with a zero also seems whole without it, and one kind may be the beginning of the other.
    """
    due, other = reply_lengths(data), request_lengths(data)
    if not reply:
        due, other = other, due
    if (length := _whole(data, due)) or due is None or any(n > len(data) for n in due):
        return length
    return _whole(data, other)


def _whole(data: bytes | bytearray, lengths: Lengths) -> int:
    fits = (n for n in lengths or () if MIN_FRAME <= n <= min(len(data), MAX_FRAME))
    return next((n for n in fits if is_whole(data[:n])), 0)


def may_grow(data: bytes | bytearray) -> bool:
    """Return True if the data may become a whole frame with more bytes."""
    if len(data) >= MAX_FRAME:
        return False
    both = request_lengths(data), reply_lengths(data)
    if None in both or both == ((), ()):
        return True  # a frame of an unknown function ends only with a pause
    return any(length > len(data) for lengths in both for length in lengths or ())


def fits_request(frame: bytes) -> bool:
    """Return True if a whole frame has the length of a request of its function."""
    return _fits(request_lengths(frame), frame)


def fits_reply(frame: bytes) -> bool:
    """Return True if a whole frame has the length of a reply of its function."""
    return _fits(reply_lengths(frame), frame)


def _fits(lengths: Lengths, frame: bytes) -> bool:
    # a frame of an unknown function may be either
    return (lengths == () and not frame[1] & REFUSAL) or len(frame) in (lengths or ())
