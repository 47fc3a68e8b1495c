"""Length of a frame from its first bytes, once as a request and once as a reply. Pure functions.

A listener does not know which of both it is, and a pause between frames is not a measure: an
adapter hands over what it has collected.
"""

from __future__ import annotations

from ..frames import MAX_FRAME, MIN_FRAME, is_whole

REFUSAL = 0x80
"""Bit of the function in a reply that refuses."""
IDENTIFICATION, IDENTIFICATION_KIND = 43, 14
_CHECKSUM = 2
_REQUESTS = {1: 8, 2: 8, 3: 8, 4: 8, 5: 8, 6: 8, 7: 4, 8: 8, 11: 4, 12: 4, 17: 4, 22: 10, 43: 7}
_COUNTED_REQUESTS = {15: 6, 16: 6, 23: 10}
"""By function, the place of the byte that counts the bytes after it."""
_REPLIES = {5: 8, 6: 8, 7: 5, 8: 8, 11: 8, 15: 8, 16: 8, 22: 10}
_COUNTED_REPLIES = {1: 2, 2: 2, 3: 2, 4: 2, 12: 2, 17: 2, 23: 2}
_OBJECTS_FROM = 8
"""Offset of the objects of an identification; the byte before counts them."""
SAME_BOTH_WAYS = frozenset({5, 6, 8, 22})
"""Functions whose reply repeats the request, or may do so."""

Lengths = tuple[int, ...] | None
"""Possible lengths of a frame, or None if more of it must come."""


def request_lengths(head: bytes | bytearray) -> Lengths:
    """Length of the request that begins like this; none if no request does."""
    if len(head) < 2:
        return None
    function = head[1]
    if (place := _COUNTED_REQUESTS.get(function)) is not None:
        return _counted(head, place)
    return (_REQUESTS[function],) if function in _REQUESTS else ()


def reply_lengths(head: bytes | bytearray) -> Lengths:
    """Length of the reply that begins like this; none if no reply does."""
    if len(head) < 2:
        return None
    function = head[1]
    if function & REFUSAL:
        # a refused identification has its kind, or has it not
        return (5, 6) if function & ~REFUSAL == IDENTIFICATION else (5,)
    if function == IDENTIFICATION:
        return _identification(head)
    if (place := _COUNTED_REPLIES.get(function)) is not None:
        return _counted(head, place)
    return (_REPLIES[function],) if function in _REPLIES else ()


def _counted(head: bytes | bytearray, place: int) -> Lengths:
    return (place + 1 + head[place] + _CHECKSUM,) if len(head) > place else None


def _identification(head: bytes | bytearray) -> Lengths:
    """By the lengths of its objects."""
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
    """Bytes of the whole frame that the data begins with, as its function has it; else 0."""
    found = {*(request_lengths(data) or ()), *(reply_lengths(data) or ())}
    # a frame whose checksum ends with a zero may be whole without that, too
    return _whole(data, tuple(sorted(found, reverse=True)))


def due_length(data: bytes | bytearray, *, reply: bool) -> int:
    """The same where it is known whether a reply is due, or else a request.

    A frame of the other kind is none as long as one that is due may still come of it: a frame that
    ends with a zero is whole without that, too, and one may be the beginning of the other.
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
    """Return True if a frame that begins so may still be whole once more of it has come."""
    if len(data) >= MAX_FRAME:
        return False
    both = request_lengths(data), reply_lengths(data)
    if None in both or both == ((), ()):
        return True  # a function that is not known here ends with a pause only
    return any(length > len(data) for lengths in both for length in lengths or ())


def fits_request(frame: bytes) -> bool:
    """Return True if a whole frame is as long as a request of its function."""
    return _fits(request_lengths(frame), frame)


def fits_reply(frame: bytes) -> bool:
    """Return True if a whole frame is as long as a reply of its function."""
    return _fits(reply_lengths(frame), frame)


def _fits(lengths: Lengths, frame: bytes) -> bool:
    # of a function that is not known here either may be
    return (lengths == () and not frame[1] & REFUSAL) or len(frame) in (lengths or ())
