"""Bytes that were heard on a line, taken apart into frames of whatever master. No clock, no port.

Frames are found by the length that their function has, and their checksum. Where that leads
nowhere (noise, a cut frame, a function that is not known here), the next frame is looked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..frames import MAX_FRAME, MIN_FRAME, is_whole
from .lengths import REFUSAL, due_length, may_grow, whole_length

LONGEST_HEAP = 4 * MAX_FRAME
"""Bytes without a frame that are kept at most, waiting for a pause."""
SILENT_BEFORE = 0.001
"""Seconds of silence before a reading with which a frame may begin, whatever lies before it."""


@dataclass(frozen=True, slots=True)
class HeardFrame:
    """A frame, or bytes that form none; times are those of the listener's clock, in seconds."""

    begun: float
    ended: float
    data: bytes
    whole: bool
    pause: float | None = None
    """Silence before it; None where it came in one reading with what was before."""
    gap: float = 0.0
    """The longest silence between two of its bytes, as far as readings show."""

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
    """Bytes of one reading that are left; when the first began and the last ended."""

    length: int
    begun: float
    ended: float
    apart: bool = False
    """True if it was silent before it."""
    fresh: bool = True
    """True if none of it was given yet."""

    def give(self, count: int) -> float:
        """Take bytes from its beginning; when the last of them ended."""
        each = (self.ended - self.begun) / self.length
        self.length -= count
        self.begun = self.ended if not self.length else self.begun + count * each
        self.fresh = False
        return self.begun


class FrameSplitter:
    """Takes readings of a line, gives frames; `character` is what a byte takes, in seconds.

    With a `character` of 0 all bytes of a reading count as of one moment. `reply_due` says for a
    device and a function whether a reply is due, by the frames until then.
    """

    def __init__(
        self, character: float = 0.0, reply_due: Callable[[int, int], bool] = lambda _d, _f: False
    ) -> None:
        self._character = character
        self._reply_due = reply_due
        self._data = bytearray()
        self._chunks: list[_Chunk] = []
        self._dead = 0
        """Bytes at the beginning with none of which a frame can begin."""
        self._complete = False
        """True if the last byte that was read is known to end a frame."""
        self._ended = float("-inf")
        """When the last byte that was read had ended."""
        self._given: float | None = None
        """When the last frame that was given had ended."""

    @property
    def waiting(self) -> bool:
        """True if there are bytes that form no frame yet."""
        return bool(self._data)

    def take(self, data: bytes, time: float) -> Iterator[HeardFrame]:
        """Bytes that were read at a time; the frames that are whole by now, each to be taken."""
        self._complete = False
        if data:
            self._data += data
            begun = min(time, max(self._ended, time - len(data) * self._character))
            apart = begun - self._ended > SILENT_BEFORE
            self._chunks.append(_Chunk(len(data), begun, time, apart))
            self._ended = time
        yield from self._frames(final=False)

    def pause(self) -> Iterator[HeardFrame]:
        """The line has been silent for long: no frame goes on, so all that is left is given."""
        return self._frames(final=True)

    def _frames(self, *, final: bool) -> Iterator[HeardFrame]:
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
            # it proves that nothing before it goes on, nor it itself; that may be whole frames
            self._complete = True
            length = whole_length(self._data)
            return bool(length), length or self._frame_behind()
        return False, self._dead if self._dead > LONGEST_HEAP else 0

    def _length(self, data: bytearray) -> int:
        """Bytes of the frame at the beginning; 0 where it is none yet."""
        if len(data) < MIN_FRAME:
            return 0
        if self._complete:
            return whole_length(data)
        device, function = data[0], data[1] & ~REFUSAL
        return due_length(data, reply=self._reply_due(device, function))

    def _last(self) -> tuple[bool, int]:
        """The same where nothing more comes."""
        if length := whole_length(self._data):
            return True, length
        if start := self._frame_behind():
            return False, start
        # a function that is not known here: between two pauses, with a right checksum
        whole = MIN_FRAME <= len(self._data) <= MAX_FRAME and is_whole(self._data)
        return whole and self._chunks[0].fresh, len(self._data)

    def _frame_behind(self) -> int:
        """Return the place of the next whole frame; 0 if there is none."""
        starts = range(max(1, self._dead), len(self._data) - MIN_FRAME + 1)
        return next((at for at in starts if whole_length(self._data[at:])), 0)

    def _frame_of_its_own(self) -> bool:
        """Return True if a frame lies between a silence and the last byte: it belongs to no
        other."""
        at = 0
        for chunk in self._chunks:
            if chunk.apart and at and whole_length(self._data[at:]) == len(self._data) - at:
                return True
            at += chunk.length
        return False

    def _cut(self, length: int, *, whole: bool) -> HeardFrame:
        """Give so many bytes from the beginning."""
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
        return HeardFrame(begun, ended, data, whole, pause, gap)
