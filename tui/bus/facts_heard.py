"""Who hears what other programs on the line do, and how this one tells them."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, TypeVar

from .leases import WriteLease
from .program import Program, readable

if TYPE_CHECKING:
    from .keep_alive import KeepAlive
    from .notes import LineNote

log = logging.getLogger(__name__)

T = TypeVar("T")


class LineVoice(Protocol):
    """Carries what is done here to the other programs; called in any thread."""

    def stop_given(self, devices: tuple[int, ...], by: str) -> None:
        """Devices are stopped from here."""

    def stop_directly(self, devices: tuple[int, ...]) -> None:
        """Have another holder of the line stop devices, around a loop that hangs here."""

    def claim(self, device: int, take: bool) -> None:
        """This program commands a device now, or no longer."""

    def ask(self, device: int) -> None:
        """This program wants a device that another one commands."""

    def reply(self, device: int, program: str, yes: bool, why: str) -> None:
        """The answer to a program that asked."""

    def hushed(self, device: int, why: str) -> None:
        """A device is left alone by this program, or with no reason no longer."""

    def armed(self, device: int, lease: WriteLease) -> None:
        """This program may write to a device until a time, or no more if that is over."""

    def kept_alive(self, one: KeepAlive) -> None:
        """This program has a device kept alive, or no more."""

    def told(self, device: int, text: str) -> None:
        """Something that everybody on the line is to read."""

    def noted(self, note: LineNote) -> None:
        """A note from here for the next program, or without data a request for some."""


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
