"""Frames of any master, found in the bytes that were received on a line. No clock, no port.

A frame is found by the length for its function, and by its checksum. Nothing shows if it is a
request or a reply: not even pauses, because an adapter delivers collected bytes. After noise, a cut
frame or an unknown function, the next frame is searched for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

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


LONGEST_HEAP = 4 * MAX_FRAME
"""Most bytes without a frame that are kept until a pause."""
SILENT_BEFORE = 0.001
"""Seconds of silence before a reading, after which a frame may begin in any case."""


@dataclass(frozen=True, slots=True)
class ObservedFrame:
    """A frame, or bytes outside any frame; times are those of the listener's clock, in seconds."""

    begun: float
    ended: float
    data: bytes
    whole: bool
    pause: float | None = None
    """Silence before it; None if it was received in one reading with the bytes before."""
    gap: float = 0.0
    """The longest silence between two of its bytes, as far as readings show it."""

    @property
    def device(self) -> int:
        """The first byte of a whole frame."""
        return self.data[0]

    @property
    def function(self) -> int:
        """The second byte of a whole frame."""
        return self.data[1]

    @property
    def pdu(self) -> bytes:
        """Function and data of a whole frame."""
        return self.data[1:-2]


@dataclass(slots=True)
class _Chunk:
    """The remaining bytes of one reading, with the times of their start and end."""

    length: int
    begun: float
    ended: float
    apart: bool = False
    """True after silence."""
    fresh: bool = True
    """True if none of its bytes was removed yet."""

    def give(self, count: int) -> float:
        """Remove bytes from its beginning; return the time when the last of them ended."""
        each = (self.ended - self.begun) / self.length
        self.length -= count
        self.begun = self.ended if not self.length else self.begun + count * each
        self.fresh = False
        return self.begun


class FrameSplitter:
    """Splits readings of a line into frames; `character` is the time of a byte in seconds.

    With a `character` of 0, all bytes of a reading count as simultaneous. `reply_due` returns True
    if a reply of a device to a function is due, according to the frames so far.
    """

    def __init__(
        self, character: float = 0.0, reply_due: Callable[[int, int], bool] = lambda _d, _f: False
    ) -> None:
        self._character = character
        self._reply_due = reply_due
        self._data = bytearray()
        self._chunks: list[_Chunk] = []
        self._dead = 0
        """Number of bytes at the beginning at which no frame can begin."""
        self._complete = False
        """True if the last byte is known to end a frame."""
        self._ended = float("-inf")
        """Time of the end of the last byte."""
        self._given: float | None = None
        """Time of the end of the last frame that was returned."""

    @property
    def waiting(self) -> bool:
        """True if there are bytes that do not form a frame yet."""
        return bool(self._data)

    def take(self, data: bytes, time: float) -> Iterator[ObservedFrame]:
        """Take bytes that were read at a time; yield the frames that are now complete."""
        self._complete = False
        if data:
            self._data += data
            begun = min(time, max(self._ended, time - len(data) * self._character))
            apart = begun - self._ended > SILENT_BEFORE
            self._chunks.append(_Chunk(len(data), begun, time, apart))
            self._ended = time
        yield from self._frames(final=False)

    def pause(self) -> Iterator[ObservedFrame]:
        """Yield all remaining bytes after a long silence: no frame continues."""
        return self._frames(final=True)

    def _frames(self, *, final: bool) -> Iterator[ObservedFrame]:
        while self._data:
            whole, length = self._last() if final else self._next()
            if not length:
                break
            yield self._cut(length, whole=whole)

    def _next(self) -> tuple[bool, int]:
        """Return whether a frame or noise is at the beginning, and its length; 0 if unknown."""
        while self._dead < len(self._data):
            rest = self._data[self._dead : self._dead + MAX_FRAME]
            if length := self._length(rest):
                return not self._dead, self._dead or length
            if may_grow(rest):
                break
            self._dead += 1
        if self._frame_of_its_own():
            # nothing before it continues, nor does it; so there may be whole frames
            self._complete = True
            length = whole_length(self._data)
            return bool(length), length or self._frame_behind()
        return False, self._dead if self._dead > LONGEST_HEAP else 0

    def _length(self, data: bytearray) -> int:
        """Return the length of the frame at the beginning; 0 if it is not complete yet."""
        if len(data) < MIN_FRAME:
            return 0
        if self._complete:
            return whole_length(data)
        device, function = data[0], data[1] & ~REFUSAL
        return due_length(data, reply=self._reply_due(device, function))

    def _last(self) -> tuple[bool, int]:
        """Return the same if no more bytes follow."""
        if length := whole_length(self._data):
            return True, length
        if start := self._frame_behind():
            return False, start
        # an unknown function: between two pauses, with a correct checksum
        whole = MIN_FRAME <= len(self._data) <= MAX_FRAME and is_whole(self._data)
        return whole and self._chunks[0].fresh, len(self._data)

    def _frame_behind(self) -> int:
        """Return the place of the next whole frame; 0 if there is none."""
        starts = range(max(1, self._dead), len(self._data) - MIN_FRAME + 1)
        return next((at for at in starts if whole_length(self._data[at:])), 0)

    def _frame_of_its_own(self) -> bool:
        """Return True if a frame begins after silence and ends with the last byte, so that it is
        separate."""
        at = 0
        for chunk in self._chunks:
            if chunk.apart and at and whole_length(self._data[at:]) == len(self._data) - at:
                return True
            at += chunk.length
        return False

    def _cut(self, length: int, *, whole: bool) -> ObservedFrame:
        """Remove this number of bytes from the beginning, and return them as a frame."""
        data = bytes(self._data[:length])
        del self._data[:length]
        self._dead = max(0, self._dead - length)
        first = self._chunks[0]
        begun, ended, gap = first.begun, first.begun, 0.0
        pause = begun - self._given if first.fresh and self._given is not None else None
        while length:
            chunk = self._chunks[0]
            if chunk is not first:
                gap = max(gap, chunk.begun - ended)
            taken = min(length, chunk.length)
            ended = chunk.give(taken)
            length -= taken
            if not chunk.length:
                self._chunks.pop(0)
        self._given = ended
        return ObservedFrame(begun, ended, data, whole, pause, gap)
