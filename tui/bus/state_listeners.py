"""Listeners for events of other programs on the line."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, ParamSpec

from .program import Program, readable

if TYPE_CHECKING:
    from concurrent.futures import Future

    from .model import Reply
    from .requests import Request

log = logging.getLogger(__name__)

P = ParamSpec("P")


class LineListeners(Generic[P]):
    """The listeners to one kind of event, called in the line's thread."""

    def __init__(self) -> None:
        self.listeners: list[Callable[P, object]] = []

    def __call__(self, listener: Callable[P, object]) -> Callable[[], None]:
        """Call `listener` each time; returns how to end that."""
        self.listeners.append(listener)

        def leave() -> None:
            if listener in self.listeners:
                self.listeners.remove(listener)

        return leave

    def tell(self, *what: P.args, **more: P.kwargs) -> None:
        """It has happened; a listener's fault is not the line's."""
        for listener in tuple(self.listeners):
            try:
                listener(*what, **more)
            except Exception:
                log.exception("a listener of the shared line failed")


class StateListeners:
    """Listeners of one line."""

    def __init__(self) -> None:
        self.on_change: LineListeners[[]] = LineListeners()
        """Programs or commanders are others than before."""
        self.on_text: LineListeners[[int, str]] = LineListeners()
        """Something is to be read about a device."""
        self.on_stop: LineListeners[[tuple[int, ...], str, Program]] = LineListeners()
        """Another program stops devices."""
        self.on_denied: LineListeners[[int, str]] = LineListeners()
        """A claim to a device was refused or ended, and why."""
        self.on_question: LineListeners[[int, Program]] = LineListeners()
        """A program asks for a device that is commanded from here."""
        self.on_reply: LineListeners[[int, bool, str]] = LineListeners()
        """A question about a device was answered, yes or no, and why."""
        self.on_gone: LineListeners[[Program]] = LineListeners()
        """In the owner only: a program left without saying so, or ended."""
        self.hear_denied, self.hear_question = self.on_denied.tell, self.on_question.tell

    def hear_text(self, device: int, text: str) -> None:
        """Something is to be read."""
        self.on_text.tell(device, readable(text))

    def hear_stop(self, devices: tuple[int, ...], by: str, program: Program) -> None:
        """Another program has stopped devices."""
        self.on_stop.tell(devices, readable(by), program)


class HolderHeard:
    """Listeners to what only the holder of a line learns of the programs on it."""

    def __init__(self) -> None:
        self.on_care: LineListeners[[int, bytes]] = LineListeners()
        """The care for a device; a listener returns True if it can use it."""
        self.on_left: LineListeners[[Program, Request, Future[Reply]]] = LineListeners()
        """A write that was perhaps sent when its program ended."""
        self.on_stop_due: LineListeners[[tuple[int, ...], str]] = LineListeners()
        """Devices are to be stopped, and by whom.

        Their stop was given by a program that is gone, or that leaves the rest to the holder.
        """
        self.hear_left, self.hear_stop_due = self.on_left.tell, self.on_stop_due.tell

    def hear_care(self, device: int, care: bytes) -> bool:
        """A program describes how to stop a device; False if a listener cannot use that."""
        taken = [listener(device, care) for listener in tuple(self.on_care.listeners)]
        return all(taken)
