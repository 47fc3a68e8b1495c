"""What is known of a key besides its name: when it was read, in what company, before which stop."""

from __future__ import annotations

from typing import Any, NamedTuple

from textual.events import Event


class Stroke(NamedTuple):
    """One key as it was read."""

    read_at: float
    """Seconds of `time.monotonic` at which its first character was read."""
    stamp: object
    """What the app's `stop_stamp` was then: the key is void where it is another one now."""
    alone: bool = True
    """Whether no other key was read within 50 ms of it."""
    held: bool = False
    """Whether it is the repeat of an arrow that is held down."""
    steps: bool = True
    """Whether it may step a value: alone, held, or the first of a piece of one arrow only."""
    piece: int = 1
    """How many keys came at once, as far as that was known."""

    @property
    def acts(self) -> bool:
        """Whether it may do more than write text and move a cursor."""
        return self.alone or self.held


def attach(event: Event, stroke: Stroke) -> None:
    """Let an event of Textual carry what is known of the key."""
    vars(event)["stroke"] = stroke


def stroke_of(event: Event) -> Stroke | None:
    """What is known of the key of an event; None for one that no terminal has sent."""
    known: Any = vars(event).get("stroke")
    return known if isinstance(known, Stroke) else None
