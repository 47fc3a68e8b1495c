"""Notes of programs on a line: messages about its drives for the next program, and profiles."""

from __future__ import annotations

import msgspec

from tui.bus.line_events import LineEvent, NoteReceived
from tui.bus.notes import MOST_NOTE, LineNote
from tui.bus.program import readable
from tui.bus.shared_state import SharedState

from .events import Event, EventLog

EVENTS_OF_LINE = "events"
PROFILE_OF_DRIVE = "profile"
"""Kind of the note, in JSON, that names the profile by which a program reads a drive."""
BLOCK_OF_DRIVE = "block"
"""Kind of the note, in JSON, that names the parameters in an indirect block or scanner."""
MOST_CHARACTERS = MOST_NOTE // 8
SAME_WITHIN = 2.0
"""Seconds in which equal messages of several programs are about the same event."""


class LeftEvent(msgspec.Struct, frozen=True):
    """An event with the program that has reported it."""

    program: str
    event: Event


class EventNotes:
    """Sends the events of one log to the owner of the line, and adds those of other programs."""

    def __init__(self, facts: SharedState, events: EventLog) -> None:
        self._facts = facts
        self._events = events
        self._heard: list[Event] = []
        events.left = self._leave
        facts.events.subscribe(self._hear)

    def ask(self) -> None:
        """Request the events of other programs."""
        self._facts.notes.ask(0, EVENTS_OF_LINE)

    def _leave(self, event: Event) -> None:
        text = readable(event.text, MOST_CHARACTERS)  # a file's name may have no UTF-8 form
        left = LeftEvent(self._facts.me.text, event._replace(text=text))
        self._facts.notes.leave(LineNote(0, EVENTS_OF_LINE, msgspec.msgpack.encode(left)))

    def _hear(self, event: LineEvent) -> None:
        match event:
            case NoteReceived(LineNote(0, kind, data)) if kind == EVENTS_OF_LINE:
                self._join(msgspec.msgpack.decode(data, type=LeftEvent))

    def _join(self, left: LeftEvent) -> None:
        if left.program != self._facts.me.text and not self._is_known(left.event):
            self._heard.append(left.event)
            text = readable(f"{left.event.text} ({left.program})")
            self._events.join(left.event._replace(text=text))

    def _is_known(self, event: Event) -> bool:
        """Return True if another program has reported the same."""
        return any(
            (item.device, item.kind, item.text) == (event.device, event.kind, event.text)
            and abs(item.wall - event.wall) < SAME_WITHIN
            for item in self._heard
        )
