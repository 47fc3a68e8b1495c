"""Listeners of tests to one kind of event of a line."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from tui.bus.line_events import LineEvent
from tui.bus.shared_state import SharedState

E = TypeVar("E")


def on_event(facts: SharedState, kind: type[E], hear: Callable[[E], object]) -> Callable[[], None]:
    """Call `hear` with each event of one kind; returns how to end that."""

    def listener(event: LineEvent) -> None:
        if isinstance(event, kind):
            hear(event)

    return facts.events.subscribe(listener)
