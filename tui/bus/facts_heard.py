"""Who hears what other programs on the line do."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

from .program import Program, readable

log = logging.getLogger(__name__)

T = TypeVar("T")


StopListener = Callable[[tuple[int, ...], str, Program], None]
DeniedListener = Callable[[int, str], None]
QuestionListener = Callable[[int, Program], None]
ReplyListener = Callable[[int, bool, str], None]
GoneListener = Callable[[Program], None]
TextListener = Callable[[int, str], None]
ChangeListener = Callable[[], None]


class FactsHeard:
    """Listeners of one line, called in its thread; a listener's fault is not the line's."""

    def __init__(self) -> None:
        self._on_stop: list[StopListener] = []
        self._on_denied: list[DeniedListener] = []
        self._on_question: list[QuestionListener] = []
        self._on_reply: list[ReplyListener] = []
        self._on_gone: list[GoneListener] = []
        self._on_text: list[TextListener] = []
        self._on_change: list[ChangeListener] = []

    def on_change(self, listener: ChangeListener) -> Callable[[], None]:
        """Call `listener` when programs or commanders are others than before."""
        return subscribed(self._on_change, listener)

    def _changed(self) -> None:
        for listener in tuple(self._on_change):
            heard(listener)

    def on_text(self, listener: TextListener) -> Callable[[], None]:
        """Call `listener` with what is to be read about a device."""
        return subscribed(self._on_text, listener)

    def hear_text(self, device: int, text: str) -> None:
        """Something is to be read."""
        for listener in tuple(self._on_text):
            heard(listener, device, readable(text))

    def on_stop(self, listener: StopListener) -> Callable[[], None]:
        """Call `listener` when another program stops devices; returns how to end that."""
        return subscribed(self._on_stop, listener)

    def hear_stop(self, devices: tuple[int, ...], by: str, program: Program) -> None:
        """Another program has stopped devices."""
        for listener in tuple(self._on_stop):
            heard(listener, devices, readable(by), program)

    def on_denied(self, listener: DeniedListener) -> Callable[[], None]:
        """Call `listener` with device and reason when a claim was refused or ended."""
        return subscribed(self._on_denied, listener)

    def hear_denied(self, device: int, why: str) -> None:
        """What this program claimed is not, or no longer, its own."""
        for listener in tuple(self._on_denied):
            heard(listener, device, why)

    def on_question(self, listener: QuestionListener) -> Callable[[], None]:
        """Call `listener` when a program asks for a device that is commanded from here."""
        return subscribed(self._on_question, listener)

    def hear_question(self, device: int, program: Program) -> None:
        """A program asks for a device that is commanded from here."""
        for listener in tuple(self._on_question):
            heard(listener, device, program)

    def on_reply(self, listener: ReplyListener) -> Callable[[], None]:
        """Call `listener` with device, yes or no, and why, when a question was answered."""
        return subscribed(self._on_reply, listener)

    def on_gone(self, listener: GoneListener) -> Callable[[], None]:
        """Call `listener`, in the owner only, when a program left without saying so, or ended."""
        return subscribed(self._on_gone, listener)


def subscribed(listeners: list[T], listener: T) -> Callable[[], None]:
    """Add a listener; returns how to end that."""
    listeners.append(listener)

    def leave() -> None:
        if listener in listeners:
            listeners.remove(listener)

    return leave


def heard(listener: Callable[..., None], *what: object) -> None:
    """Call a listener with what it hears."""
    try:
        listener(*what)
    except Exception:
        # a listener's fault is not the line's
        log.exception("a listener of the shared line failed")
