"""The last frames seen on a line, whole, with direction, time and a note."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Literal

FrameDirection = Literal["out", "in"]


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame, or bytes that form none; `time` is that of the line's clock."""

    time: float
    direction: FrameDirection
    data: bytes
    note: str = ""
    """What the frame is: empty for a request or its reply, else why it is out of the ordinary."""


class Trace:
    """A bounded log of frames, written by the line's thread and read by any."""

    def __init__(self, length: int) -> None:
        self._frames: deque[Frame] = deque(maxlen=length)

    def add(self, time: float, direction: FrameDirection, data: bytes, note: str = "") -> None:
        """Keep a frame; the oldest gives way."""
        self._frames.append(Frame(time, direction, bytes(data), note))

    def frames(self) -> tuple[Frame, ...]:
        """The frames kept, oldest first."""
        # copy() runs without giving up the interpreter, so no append comes in between
        return tuple(self._frames.copy())
