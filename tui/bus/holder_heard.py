"""Listeners to what only the holder of a line learns of the programs on it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING

from .facts_heard import heard, subscribed
from .program import Program

if TYPE_CHECKING:
    from .model import Reply
    from .requests import Request

CareListener = Callable[[int, bytes], bool]
LeftListener = Callable[[Program, "Request", "Future[Reply]"], None]
DueListener = Callable[[tuple[int, ...], str], None]


class HolderHeard:
    """Listeners of one line, called in its thread while this program holds it."""

    def __init__(self) -> None:
        self._on_care: list[CareListener] = []
        self._on_left: list[LeftListener] = []
        self._on_due: list[DueListener] = []

    def on_care(self, listener: CareListener) -> Callable[[], None]:
        """Call `listener` with the care for a device; it returns True if it can use it."""
        return subscribed(self._on_care, listener)

    def hear_care(self, device: int, care: bytes) -> bool:
        """A program describes how to stop a device; False if a listener cannot use that."""
        taken = [listener(device, care) for listener in tuple(self._on_care)]
        return all(taken)

    def on_left(self, listener: LeftListener) -> Callable[[], None]:
        """Call `listener` with each write that was perhaps sent when its program ended."""
        return subscribed(self._on_left, listener)

    def hear_left(self, program: Program, request: Request, answer: Future[Reply]) -> None:
        """A program has ended that had asked for a write."""
        for listener in tuple(self._on_left):
            heard(listener, program, request, answer)

    def on_stop_due(self, listener: DueListener) -> Callable[[], None]:
        """Call `listener` with devices and by whom, when it is to stop them.

        Their stop was given by a program that is gone, or that leaves the rest to the holder.
        """
        return subscribed(self._on_due, listener)

    def hear_stop_due(self, devices: tuple[int, ...], by: str) -> None:
        """A stop was given that no program carries out."""
        for listener in tuple(self._on_due):
            heard(listener, devices, by)
