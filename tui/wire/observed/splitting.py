"""Frames of any master, found in the bytes that were received on a line. No clock, no port.

A frame is found by the length for its function, and by its checksum. After noise, a cut frame or an
unknown function, the next frame is searched for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..frames import MAX_FRAME, MIN_FRAME, is_whole
from .lengths import REFUSAL, due_length, may_grow, whole_length

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
