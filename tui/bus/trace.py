"""The last frames seen on a line, whole, with direction, time and a note."""

from __future__ import annotations

import math
from collections import deque
from time import monotonic
from typing import Literal

import msgspec

from .bounds import MOST_BYTES, ByteString, MonotonicTime, Word

FrameDirection = Literal["out", "in"]


class Frame(msgspec.Struct, frozen=True, array_like=True):
    """One frame, or bytes that form none; `time` is that of the line's clock."""

    time: MonotonicTime
    direction: FrameDirection
    data: ByteString
    note: Word = ""
    """Remark on the frame: empty for a request or its reply, else what is unusual."""


LOOKED_LATELY = 5.0


class Trace:
    """A bounded log of frames, written by the line's thread and read by any."""

    def __init__(self, length: int) -> None:
        self._frames: deque[Frame] = deque(maxlen=length)
        self.count = 0
        """Frames that were ever kept."""
        self._looked = -math.inf

    def add(self, time: float, direction: FrameDirection, data: bytes, note: str = "") -> None:
        """Keep a frame, of bytes the first MOST_BYTES; the oldest gives way."""
        self.append(Frame(time, direction, bytes(data[:MOST_BYTES]), note))

    def append(self, frame: Frame) -> None:
        """Keep a frame that is made."""
        self._frames.append(frame)
        self.count += 1

    def frames(self) -> tuple[Frame, ...]:
        """The frames kept, oldest first."""
        self._looked = monotonic()
        # copy() runs without giving up the interpreter, so no append comes in between
        return tuple(self._frames.copy())

    @property
    def looked_at(self) -> bool:
        """True if the frames were read in the last seconds."""
        return monotonic() - self._looked < LOOKED_LATELY
