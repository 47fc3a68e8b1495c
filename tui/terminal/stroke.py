"""Facts about a key besides its name: its time, its burst, the stop before it."""

from __future__ import annotations

from typing import Any, NamedTuple

from textual.events import Event


class Stroke(NamedTuple):
    """One key as it was read."""

    read_at: float
    """Seconds of `time.monotonic` at which its first character was read."""
    stamp: object
    """The app's `stop_stamp` at that time: the key is discarded if it has changed."""
    alone: bool = True
    """True if no other key was read within 50 ms of it."""
    held: bool = False
    """True if it is the repeat of an arrow that is held down."""
    steps: bool = True
    """True if it may step a value: alone, held, or the first of a piece of one arrow only."""
    piece: int = 1
    """Number of keys that arrived together, as far as known."""
    at_once: bool = False
    """True if it did not wait to be classified: it may only move, type text or show."""

    @property
    def acts(self) -> bool:
        """True if it may do more than type text and move a cursor."""
        return self.alone or self.held


class Pressed(NamedTuple):
    """A key for the app."""

    name: str
    character: str | None
    stroke: Stroke


def attach(event: Event, stroke: Stroke) -> None:
    """Attach a stroke to a Textual event."""
    vars(event)["stroke"] = stroke


def stroke_of(event: Event) -> Stroke | None:
    """Return the stroke of an event; None if no terminal sent the key."""
    known: Any = vars(event).get("stroke")
    return known if isinstance(known, Stroke) else None
