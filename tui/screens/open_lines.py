"""The lines that the panel has open: one is shown, the others go on below."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from tui.session.events import Event, EventLog

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.fleet import Fleet


class PanelLine(NamedTuple):
    """An open line with the drives on it."""

    opened: OpenLine
    fleet: Fleet


class LineEvents(EventLog):
    """What is said about the drives of one line: with its name, unless it is the one shown."""

    def __init__(self, events: EventLog, label: str, is_shown: Callable[[], bool]) -> None:
        super().__init__()
        self._all = events
        self._label = label
        self._is_shown = is_shown

    def add(self, kind: str, text: str, device: int | None = None) -> None:
        """Keep an event among those of all lines."""
        if self._is_shown():
            self._all.add(kind, text, device)
        else:
            drive = "" if device is None else f", drive {device}"
            self._all.add(kind, f"{self._label}{drive}: {text}")

    @property
    def newest(self) -> Event | None:
        """The last event of all lines."""
        return self._all.newest

    @property
    def events(self) -> tuple[Event, ...]:
        """The events of all lines, oldest first."""
        return self._all.events
