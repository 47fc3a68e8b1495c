"""Events of a line: one union of what can happen on it, and the one way to hear of it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import msgspec
from msgspec import Meta
from msgspec.structs import force_setattr

from .bounds import DeviceId, MonotonicTime, RegisterValue, WrittenPlace
from .program import Program, readable

if TYPE_CHECKING:
    from concurrent.futures import Future

    from .model import LineState, Reply
    from .notes import LineNote
    from .requests import Request


MOST_WRITTEN = 125
"""Registers of one write."""


class DeviceWritten(msgspec.Struct, frozen=True, tag=True):
    """Registers that a device has acknowledged; device 0 is a broadcast, which none does."""

    device: DeviceId
    address: WrittenPlace
    values: Annotated[tuple[RegisterValue, ...], Meta(max_length=MOST_WRITTEN)]
    program: Program
    time: MonotonicTime
    """When the last byte of the reply came."""

    @property
    def words(self) -> dict[int, int]:
        """The written words by place; a coil is a word of 0 or 1."""
        return dict(enumerate(self.values, self.address))


log = logging.getLogger(__name__)


class StateChanged(msgspec.Struct, frozen=True):
    """The line was connected, lost or closed."""

    state: LineState


class ProgramsChanged(msgspec.Struct, frozen=True):
    """Programs came or left, or another one commands a device."""


class NoticeReceived(msgspec.Struct, frozen=True):
    """A text about a device that every person on the line is to read; device 0 is the line."""

    device: int
    text: str

    def __post_init__(self) -> None:
        force_setattr(self, "text", readable(self.text))


class DevicesStopped(msgspec.Struct, frozen=True):
    """Another program has stopped devices; `by` names the key or command."""

    devices: tuple[int, ...]
    by: str
    program: Program

    def __post_init__(self) -> None:
        force_setattr(self, "by", readable(self.by))


class ControlDenied(msgspec.Struct, frozen=True):
    """This program may not command a device, or no longer."""

    device: int
    why: str


class ControlRequested(msgspec.Struct, frozen=True):
    """Another program asks for a device that this program commands."""

    device: int
    program: Program


class ControlAnswered(msgspec.Struct, frozen=True):
    """The commander of a device has answered this program's request for it."""

    device: int
    granted: bool
    why: str


class ProgramLost(msgspec.Struct, frozen=True):
    """A program has left the line or no longer answers; in the holder of the line only."""

    program: Program


class WriteAbandoned(msgspec.Struct, frozen=True):
    """A program left while its write was perhaps being sent; in the holder of the line only."""

    program: Program
    request: Request
    answer: Future[Reply]


class StopDue(msgspec.Struct, frozen=True):
    """Devices whose stop the holder of the line must complete, as its program has left."""

    devices: tuple[int, ...]
    by: str


class NoteReceived(msgspec.Struct, frozen=True):
    """A note has arrived that this program asked for."""

    note: LineNote


LineEvent = (
    StateChanged | ProgramsChanged | NoticeReceived | DevicesStopped | ControlDenied
    | ControlRequested | ControlAnswered | ProgramLost | WriteAbandoned | StopDue | NoteReceived
    | DeviceWritten
)  # fmt: skip


class EventHub:
    """Passes the events of one line to their listeners. May be used from any thread.

    A listener is called in the thread that emits: the line's for all that other programs or the
    port cause, the caller's for what this program does itself. Listeners are called in the order
    of their subscription and must not wait. An error of one is logged and concerns no other.
    """

    def __init__(self) -> None:
        self._listeners: tuple[Callable[[LineEvent], object], ...] = ()
        self._lock = threading.Lock()

    def subscribe(self, listener: Callable[[LineEvent], object]) -> Callable[[], None]:
        """Call `listener` with each event; returns how to end that."""
        with self._lock:
            self._listeners = (*self._listeners, listener)

        def unsubscribe() -> None:
            with self._lock:
                rest = list(self._listeners)
                if listener in rest:
                    rest.remove(listener)
                self._listeners = tuple(rest)

        return unsubscribe

    def emit(self, event: LineEvent) -> None:
        """Call the listeners."""
        for listener in self._listeners:
            try:
                listener(event)
            except Exception:
                log.exception("a listener of the line failed")
