"""The open lines of the panel: one is shown, the others stay open; and a line being opened."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from tui.session.events import Event, EventLog

if TYPE_CHECKING:
    from textual.worker import Worker

    from tui.session.connect.open_line import OpenLine
    from tui.session.fleet import Fleet


class PanelLine(NamedTuple):
    """An open line with the drives on it."""

    opened: OpenLine
    fleet: Fleet


class LineOpening:
    """The opening of a line, from the key that asks for it; keys are ignored until it ends.

    `text` is the line as it was typed. Times are those of time.monotonic(). It may be read in any
    thread.
    """

    def __init__(self, text: str = "") -> None:
        self.text = text
        self.connected = False
        """True once the line is open, while the work that asked for it still has to end."""
        self.ended = float("-inf")
        """When the last opening ended: a key read before was typed during it."""
        self._goes_on = bool(text)
        self._work: Worker[Any] | None = None

    @property
    def goes_on(self) -> bool:
        """True while a line is being opened."""
        work = self._work
        return self._goes_on and (work is None or not work.is_finished)

    def begin(self, text: str, work: Worker[Any]) -> None:
        """Ignore keys until this work, or the work that replaces it, ends the opening."""
        self.text, self._work, self.connected, self._goes_on = text, work, False, True

    def end(self, work: Worker[Any] | None = None) -> None:
        """Accept keys again; no effect if another work has begun an opening since."""
        if self._goes_on and (work is None or work is self._work):
            self.ended, self._goes_on = time.monotonic(), False

    def cancel(self) -> bool:
        """Cancel the work; False if it has not begun yet."""
        if self._work is None:
            return False
        self._work.cancel()
        self.end()
        return True


class LineEvents(EventLog):
    """Events of the drives of one line; with the line's name, unless it is the one shown."""

    def __init__(self, events: EventLog, label: str, is_shown: Callable[[], bool]) -> None:
        super().__init__()
        self._all = events
        self._label = label
        self._is_shown = is_shown

    def add(
        self, kind: str, text: str, device: int | None = None, wall: float | None = None
    ) -> Event | None:
        """Add an event to those of all lines; None if it repeats the one before."""
        text_of_all, device_of_all = self._named(text, device)
        new = self._all.add(kind, text_of_all, device_of_all, wall)
        if new is not None:
            self.left(new._replace(text=text, device=device))
        return new

    def join(self, event: Event) -> None:
        """Add an event of another program on the line to those of all lines."""
        text, device = self._named(event.text, event.device)
        self._all.join(event._replace(text=text, device=device))

    def _named(self, text: str, device: int | None) -> tuple[str, int | None]:
        """Text and device of an event in the list of all lines."""
        if self._is_shown():
            return text, device
        if device is None:
            return f"{self._label}: {text}", None
        return f"{self._label}, drive {device}: {text}", None

    @property
    def newest(self) -> Event | None:
        """The last event of all lines."""
        return self._all.newest

    @property
    def events(self) -> tuple[Event, ...]:
        """The events of all lines, oldest first."""
        return self._all.events
