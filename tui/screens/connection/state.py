"""What the Connection screen shows: lines, fields, drives, what happened, what to try next."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.events import Key, Resize
from textual.timer import Timer
from textual.worker import Worker, WorkerState

from tui.widgets.drawing import cut, rule, wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, FAULT, PLAIN, STRONG

from ..base import PanelScreen
from .drive_list import DriveList
from .found import FoundState
from .hints import hint_for
from .line_form import LineForm
from .line_list import LineList

if TYPE_CHECKING:
    from tui.session.fleet import FoundDrive
    from tui.session.monitor.line_watch import Look

log = logging.getLogger(__name__)

ERROR_KIND, ALARM_KIND = "error", "alarm"
STATES = 0.5
"""Seconds between two looks at the states that the line watch has seen."""
QUIET = 1.0
"""Seconds without a key after which drives go to their places in the list."""
LOOK_AT_LINE = 1.0
"""Seconds between two looks at the clock and the state of the line."""
MESSAGE = 3
"""Lines for what happened and what to try next."""


class ConnectionView(PanelScreen):
    """Lines on the left, the chosen line and its drives on the right, what to do next below."""

    def __init__(self) -> None:
        super().__init__()
        self.warned: set[int] = set()
        """Devices of which it was said that they trip when they are left alone."""
        self._happened: tuple[str, str, str] = ("", "", "")
        self._looking: list[Timer] = []
        self._away = False
        self._key_at = -math.inf
        """When the last key came, in seconds of the clock."""

    def body(self) -> ComposeResult:
        """Two columns and the lines below."""
        yield Lines(id="header")
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield Lines(id="lines-title")
                yield LineList(id="lines")
            with Vertical(id="right"):
                yield Lines(id="line-title")
                yield LineForm()
                yield Lines(id="drives-title")
                yield DriveList(id="drives")
        yield Lines(id="message")

    @property
    def found(self) -> Mapping[int, FoundDrive]:
        """The drives that answered on the open line, by device."""
        return self.app.fleet.found if self.app.fleet else {}

    @property
    def lines(self) -> LineList:
        """The list of lines."""
        return self.query_one(LineList)

    @property
    def drives(self) -> DriveList:
        """The list of drives."""
        return self.query_one(DriveList)

    @property
    def form(self) -> LineForm:
        """The fields."""
        return self.query_one(LineForm)

    def on_mount(self) -> None:
        """Show what there is."""
        self.say("", "Choose a line and press Enter, or n to type one.")
        self.lines.look_for_lines()
        self._looking = [
            self.set_interval(LOOK_AT_LINE, self.show_heads),
            self.set_interval(STATES, self.look),
        ]

    def on_resize(self, event: Resize) -> None:
        """Titles have the width of their columns, which is known before they are drawn."""
        self._redraw()
        self.call_after_refresh(self._redraw)  # with a scroll bar where one came

    def on_screen_suspend(self) -> None:
        """Stand still while another screen is on top.

        What stirs below a screen makes Textual draw the whole terminal again.
        """
        self._away = True
        for timer in self._looking:
            timer.pause()

    def on_screen_resume(self) -> None:
        """States may have changed meanwhile."""
        if self._away:
            self._away = False
            self.lines.look_for_lines()
        for timer in self._looking:
            timer.resume()
        self.call_after_refresh(self._redraw)

    def _redraw(self) -> None:
        self.show_heads()
        self.lines.fill()
        self.show_drives()
        self._show_message()

    def show_drives(self) -> None:
        """The drives that answered, as they are now."""
        found = self.found
        looks = self.app.fleet.line_watch.looks if self.app.fleet else {}
        connected = self._connected()
        states = {d: _state(drive, looks.get(d), connected) for d, drive in found.items()}
        self.drives.fill(found, states, sort=self._hands_are_quiet())

    def on_key(self, event: Key) -> None:
        """While keys come, nothing changes its place under them."""
        self._key_at = self.app.clock.monotonic()
        super().on_key(event)

    def _hands_are_quiet(self) -> bool:
        return self.app.clock.monotonic() - self._key_at >= QUIET

    # The titles

    def show_heads(self) -> None:
        """The titles, with the state of the line."""
        if not self.is_current:
            return
        width = self.size.width
        right = f"{self.app.clock.time_of_day()} "
        head = Text(no_wrap=True)
        head.append(cut(" Drive Panel · Connection", width - len(right)), STRONG)
        head.append(right, FAINT)
        self.put("header", [head])
        self._title("lines-title", "Lines")
        opened = self.app.opened
        state = opened.line.state if opened else None
        words = state.status.value if state else "not open"
        self._title("line-title", self.app.line_label or "No line", words)
        count = f"{len(self.found)} found" if self.found else ""
        self._title("drives-title", "Drives", count)
        if state is not None:
            from tui.bus.api import LineStatus

            if state.status is LineStatus.LOST:
                reason = f"LINE LOST: {state.reason}"
                self.say(reason, "It is tried again by itself.", ALARM_KIND)

    def _title(self, place: str, title: str, right: str = "") -> None:
        width = self.query_one(f"#{place}").size.width
        short = cut(title, min(len(title), max(4, width - 14)))
        self.put(place, [rule(short, width, right)])

    # What happened

    def say(self, happened: str, next_step: str, kind: str = "") -> None:
        """What happened last, and what to try next."""
        self._happened = (happened, next_step, kind)
        self._show_message()

    def fail(self, error: Exception) -> None:
        """Show an error with what to try next."""
        self.say(str(error), hint_for(error), ERROR_KIND)

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """An error that nobody foresaw: all of it to the log, one line to the person."""
        if event.state is WorkerState.ERROR:
            log.error("%s failed", event.worker.name, exc_info=event.worker.error)
            self.say(
                f"The panel failed at this: {event.worker.error}",
                "Try again; drivepanel.log in the state folder has more.",
                ERROR_KIND,
            )

    def _show_message(self) -> None:
        happened, next_step, kind = self._happened
        width = max(10, self.size.width - 2)
        style = {ERROR_KIND: FAULT, ALARM_KIND: ALARM}.get(kind, PLAIN)
        lines = [Text(f" {part}", style) for part in wrapped(happened, width, MESSAGE - 1)]
        room = MESSAGE - len(lines)
        lines += [Text(f" {part}", FAINT) for part in wrapped(next_step, width, room)]
        self.put("message", lines + [Text("")] * (MESSAGE - len(lines)))

    # The states of the drives

    def draw(self, width: int) -> None:
        """The states that the line watch of the line has seen."""
        super().draw(width)
        self.show_drives()
        if self.app.fleet is not None:
            self._warn(self.app.fleet.line_watch.looks)

    def _connected(self) -> bool:
        opened = self.app.opened
        if opened is None:  # the first picture waits for no import
            return False
        from tui.bus.api import LineStatus

        return opened.line.state.status is LineStatus.CONNECTED

    def _warn(self, looks: Mapping[int, Look]) -> None:
        """Say once of a drive that it trips when it is left alone."""
        watching = {d: look.timeout for d, look in looks.items() if look.timeout is not None}
        if not watching or watching.keys() <= self.warned:
            return
        self.warned |= watching.keys()
        which = ", ".join(f"{device} ({timeout:g} s)" for device, timeout in watching.items())
        self.say(
            f"Left alone so long, these drives act on their communication time-out: {which}.",
            "The panel asks them on while the line is open. Enter on a drive watches it.",
            ALARM_KIND,
        )


def _state(drive: FoundDrive, look: Look | None, connected: bool) -> FoundState:
    """What a drive does, by the last look at it, and the kind of that."""
    if not connected:
        return "not known", "unknown"
    if drive.session is None:
        return "no profile", ""
    if look is None:
        return "asking", ""
    return (look.state.headline, look.state.kind) if look.state else ("no answer", "unknown")
