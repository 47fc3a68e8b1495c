"""Monitor screen: the motor's state at a glance, and its commands."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING, ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.events import Resize, ScreenResume
from textual.timer import Timer

from tui.session.command.stop_report import Phase, StopReport, as_seen
from tui.session.console import DriveConsole
from tui.session.shown import Rating
from tui.widgets.drawing import KeyLabel, key_line, key_styles
from tui.widgets.lines import Lines
from tui.widgets.palette import ATTENTION, FAINT, STALE, STRONG
from tui.widgets.strip import FrameView

from ..command.control import Control
from ..keys.action import MONITOR
from ..keys.table import bindings, keys_line
from ..state_words import stands_by
from .arrange import READOUT_ROWS, WIDE, Arrangement, arrange
from .assembly import (
    curve_or_table,
    monitor_parts,
    other_values,
    start_monitor,
    tables,
    watched_words,
)
from .readouts import framed
from .time_cursor import CursorKeys, TimeCursor
from .view import View

if TYPE_CHECKING:
    from tui.bus.model import LineCounters
    from tui.session.monitor.snapshot import Snapshot

    from ..app_port import Panel


def order_keys(view: View, keys: Sequence[KeyLabel]) -> Text:
    """Return the row of keys; commands that cannot work now are dim."""

    def styles(action: str) -> tuple[Style, Style]:
        if not action.startswith(("reset", "run_line")):
            return key_styles(action)
        return (ATTENTION, STRONG) if works_now(view, action) else (FAINT, FAINT)

    return key_line(keys, styles)


def works_now(view: View, action: str) -> bool:
    """Return True if a command can work now, as far as known without another read."""
    if view.control.armed_for is None or view.lost or view.snapshot is None:
        return False
    in_fault = view.snapshot.state.kind == "fault"
    if action == "reset" or in_fault:
        return in_fault and action in ("reset", "run_line('reference')")
    return view.control.hindrance is None or action == "run_line('reference')"


FROZEN_AFTER = 5.0
"""Seconds under a dialog after which the values below it are reported as frozen."""
STOP_SHOWN_FOR = {Phase.STOPPED: 10.0, Phase.FAILED: 60.0}
"""Seconds for which the result of a stop is shown."""
PERIODS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)


PLACED = frozenset({"top", "motor", "curve", "state", "said"})
"""Parts that must exist before `_place` sizes the screen."""


class MonitorScreen(CursorKeys):
    """Live values and commands of one drive, drawn from the snapshots of the line's worker."""

    CSS_PATH = "monitor.tcss"
    BINDINGS: ClassVar = bindings(MONITOR)
    TITLE = "Monitor"

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._source: ViewSource | None = None
        self._words = watched_words(self.session.profile)
        self._still: Timer | None = None
        self._reported: object = None
        """Urgent parts of the snapshot that was shown last."""
        self._bottom_rows = 0
        self._placed: tuple[Arrangement, int, int] | None = None
        self._has_drawn_values = False

    def body(self) -> ComposeResult:
        """Create the parts; `draw` fills them, and `_place` sizes them."""
        with Vertical(id="body"):
            with Horizontal(id="top"):
                yield Lines(id="readouts")
                yield Lines(id="state")
            yield Lines(id="motor")
            yield Lines(id="curve")
        yield Lines(id="message")

    def on_mount(self) -> None:
        """Start polling the drive."""
        if self.app.replay is None or not self.console.monitor.started:
            start_monitor(self.console, self.app.period)
            if self.app.replay is not None:
                from tui.session.replay import open_past

                open_past(self.app.replay, self.console, start_monitor, self.app.period)

    def look_in_time(self) -> None:
        """Refresh the screen; on a low-bandwidth link figures wait for the refresh of the frame.

        A new state, fault or error, and additional values, are shown immediately.
        """
        snapshot = self.console.monitor.latest
        reported = snapshot and (
            snapshot.state.kind,
            snapshot.state.headline,
            snapshot.state.fault,
            bool(snapshot.error),
            len(snapshot.readings),
        )
        if reported != self._reported:
            self.app.hurry()
        elif self.app.low_bandwidth:
            return
        self._reported = reported
        self.look()

    def on_unmount(self) -> None:
        """Disarm the drive and stop monitoring it: its state is no longer visible."""
        self.session.arming.disarm()
        self.console.monitor.stop()
        fleet = self.app.fleet if self.app.replay is not None else None
        if fleet is not None and fleet.console(self.session.device) is self.console:
            # its check is due now: the time of a replay may be held
            fleet.line_watch.keep(self.session, self.console.monitor)

    def on_resize(self, event: Resize) -> None:
        """Size the parts for the new terminal size."""
        if not self.is_too_small:
            self._place(self._room())

    def on_screen_suspend(self) -> None:
        """Mark the values as frozen after some time: only the screen on top is refreshed.

        A change below a screen makes Textual draw the whole terminal again.
        """
        since = self.app.clock.time_of_day()
        self._still = self.set_timer(FROZEN_AFTER, lambda: self._tell_still(since))

    def _tell_still(self, since: str) -> None:
        """Mark the values that are visible under a dialog with the time at which they froze."""
        if self.app.screen.styles.background.a < 1:
            room = self._room()
            frozen = [Text(f"as of {since}", STALE), *[Text("")] * (READOUT_ROWS - 3)]
            box = framed(Text(" State "), Text(), frozen, Text(), room.state_width)
            self.put("state", [*[Text("")] * room.lead, *box])

    def on_screen_resume(self, event: ScreenResume) -> None:
        """Refresh after another screen was on top."""
        if self._still is not None:
            self._still.stop()
        self.call_after_refresh(self.look)

    def draw_frame(self, view: FrameView) -> None:
        """Draw the frame; a message of several rows moves the parts above it and hides none."""
        super().draw_frame(view)
        if not self.is_too_small:
            self._place(self._room())

    def _room(self) -> Arrangement:
        """Return the rows of each part for the present terminal size and bandwidth."""
        lean = self.app.low_bandwidth
        third = self.size.width >= WIDE and not lean
        count = len(other_values(self.session.profile, wide=third))
        return arrange(*self.size, count, lean=lean)

    def _place(self, room: Arrangement) -> None:
        """Set the rows of each part; the layout runs again only if they change."""
        bottom = max(room.bottom, self._bottom_rows)
        placed = (room, bottom, self.message_rows)
        if placed == self._placed:
            return
        there = {part.id for part in self.query("Lines, Horizontal, Vertical")}
        if not there >= PLACED:
            return  # not mounted yet, or being removed
        self._placed = placed
        rows = {"top": room.top, "motor": room.values, "curve": room.curve}
        for place, height in rows.items():
            self.query_one(f"#{place}").styles.height = height
        self.query_one("#state").styles.width = room.state_width
        message = self.query_one("#message")
        message.styles.height = bottom
        message.styles.margin = (0, 0, 1 + placed[2], 0)

    def draw(self, width: int) -> None:
        """Draw the latest snapshot, the run line if it is open, and the keys that work now."""
        view, room = self._view(), self._room()
        parts = monitor_parts(view, room, self._words)
        if (run := self.run_line_lines(view.now, width)) is not None:
            parts["message"] = [*[Text("")] * (room.bottom - len(run)), *run]
        parts["keys"] = self._keys_of(view, width)
        if view.snapshot is not None and not self._has_drawn_values:
            # the curve follows in its own output: a slow link shows the state a second sooner
            self._has_drawn_values = True
            parts["curve"] = [Text("")] * room.curve
            self.call_after_refresh(self.look)
        self._bottom_rows = len(parts["message"])
        self._place(room)
        for place, lines in parts.items():
            self.put(place, lines)
        self.ask_unrecorded()

    def keys_now(self, width: int) -> list[Text]:
        """Return the keys of the run line while it is open, else those of the screen."""
        return self._keys_of(self._view(), width)

    def _keys_of(self, view: View, width: int) -> list[Text]:
        if self.line_is_open:
            return [self.run_line_keys(view.now)]
        return [order_keys(view, keys_line(MONITOR, width, self.app.stop_target_text))]

    def _view(self) -> View:
        if self._source is None:
            self._source = ViewSource(self.app, self.console)
        control = self.control(self.app.clock.monotonic())
        return self._source.view(control, self._word, self.time_cursor)

    def action_change_rate(self, step: int) -> None:
        """Change the poll period by `step` places in PERIODS; a positive step polls faster."""
        now = PERIODS.index(min(PERIODS, key=lambda p: abs(p - self.app.period)))
        self.app.period = PERIODS[max(0, min(len(PERIODS) - 1, now - step))]
        self.console.monitor.period = self.app.period
        self.app.tell(f"The drive is polled {1 / self.app.period:.1f} times a second.")
        self.look()

    def action_trend_window(self, step: int) -> None:
        """Lengthen or shorten the page of time by `step`, and show the curve without a cursor."""
        self.time_cursor = self.time_cursor.with_span(step)
        self._word = None
        self.look()

    def action_next_word(self) -> None:
        """Show the next table of values or bits; after the last table, show the curve."""
        room = self._room()
        found = tables(self.session.profile, room, self._words)
        after = 0 if self._word is None else self._word + 1
        self._word = after if after < len(found) else None
        self.time_cursor = self.time_cursor.closed()
        if self.is_current and self.size.width:
            self.put("curve", curve_or_table(self._view(), room, self._words))

    def action_rating(self) -> None:
        """Prompt for the rated current, in A, of a drive that gives its current in %."""
        from ..dialogs.ask import Ask

        current = self.session.profile.quantity("motor_current")
        if current is None or current.unit != "%":
            self.app.notify("This drive gives its current in A.", timeout=3)
            return

        def reported(text: str | None) -> None:
            if text:
                rated = Rating(Decimal(text.replace(",", ".")), "A")
                self.session.ratings[current.code] = rated
                self.look()

        base = current.base or "not confirmed by a manual"
        about = f"The current at 100 % of {current.code}, from the drive's nameplate. Base: {base}."
        requested = Ask("Rated current in A", fault_of_rating, about=about, number=True)
        self.app.push_screen(requested, reported)


class ViewSource:
    """Source of Monitor's views; use it only in the panel's event loop."""

    def __init__(self, app: Panel, console: DriveConsole) -> None:
        self._app = app
        self._console = console
        self._counted: tuple[Snapshot | None, float, LineCounters] | None = None
        """The counters of the line, with the time and the latest snapshot then."""

    def _counters(self, snapshot: Snapshot | None, now: float) -> LineCounters:
        """Return the counters, 1 s old at most; they change with the snapshot, in one output."""
        if self._counted is None or self._counted[0] is not snapshot or now >= self._counted[1] + 1:
            self._counted = snapshot, now, self._console.session.line.counters
        return self._counted[2]

    def view(self, control: Control, word: int | None, cursor: TimeCursor) -> View:
        """Return the present contents; `word` is the index of a table, None for the curve."""
        app, console, session = self._app, self._console, self._console.session
        now, monitor, fleet = app.clock.monotonic(), console.monitor, app.fleet
        snapshot = monitor.latest
        return View(
            profile=session.profile,
            snapshot=snapshot,
            line=session.line.state,
            device=session.device,
            counters=self._counters(snapshot, now),
            trend=monitor.trend,
            period=monitor.period,
            now=now,
            read_only=app.read_only,
            plain=app.plain_signs,
            braille=app.has_braille,
            colored=app.has_colors,
            watch=fleet.line_watch.watch(session.device) if fleet else None,
            heard=session.line.device_state(session.device).heard,
            control=control,
            stop=self._stop(now),
            was=monitor.was,
            step=cursor.step,
            apart=app.clock.wall_of(0.0),
            page=cursor.page,
            cursor=cursor.moment,
            stands_by=snapshot is not None and stands_by(console.session, snapshot.state),
            fault_at=self._fault_at(),
            word=word,
            lean=app.low_bandwidth,
            me=session.line.facts.me.text,
            replayed=app.replay is not None,
        )

    def _fault_at(self) -> str:
        """Return when this drive tripped or its fault was first seen; empty without a fault."""
        fleet, device = self._app.fleet, self._console.session.device
        active = fleet.alarms.active if fleet else ()
        return next((fault.when for fault in active if fault.device == device), "")

    def _stop(self, now: float) -> StopReport | None:
        """Return the report of this drive's latest stop; None once it is overtaken or expired."""
        fleet, session = self._app.fleet, self._console.session
        report = fleet.stopper.reports.get(session.device) if fleet else None
        if report is None:
            return None
        if (latest := self._console.latest) is not None and not latest.error:
            report = as_seen(report, session.profile, latest.state, latest.readings)
        if self._is_overtaken(report):
            return None
        return report if now - report.since < STOP_SHOWN_FOR.get(report.phase, now) else None

    def _is_overtaken(self, report: StopReport) -> bool:
        """Return True if a later command, or a motor that runs again, supersedes the report."""
        outcome, latest = self._console.session.work.outcome, self._console.latest
        if outcome is not None and outcome.time > report.since:
            return True
        runs = latest is not None and not latest.error and latest.state.motion == "running"
        return runs and report.phase is Phase.STOPPED


def fault_of_rating(text: str) -> str:
    """Return the error in a typed rated current; empty if it is valid."""
    try:
        number = Decimal(text.strip().replace(",", "."))
    except InvalidOperation:
        return f"{text!r} is not a number. Write it like 9.1."
    fits = number.is_finite() and 0 < number < 10000
    return "" if fits else "A rated current is above 0 and below 10,000 A."
