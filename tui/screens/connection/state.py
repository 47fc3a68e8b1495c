"""Contents of Line: lines and form on the left, drives of the open line on the right."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.events import Key, Resize, ScreenResume
from textual.timer import Timer
from textual.worker import Worker, WorkerState

from tui.session.connect.named_lines import line_settings
from tui.widgets.drawing import pair, rule, short
from tui.widgets.lines import Lines
from tui.widgets.palette import FAINT, KEY, PLAIN, STRONG

from ..base import PanelScreen
from .advice import ALARM_KIND, ERROR_KIND, Advice, advice_lines, hint_for
from .choices import LIST_MARKS, ListMark
from .drive_list import DriveList
from .line_form import LineForm
from .line_list import LineList
from .progress import far_text, left_text, scan_forms

if TYPE_CHECKING:
    from tui.session.connect.search import Search
    from tui.session.fleet import Fleet, FoundDrive
    from tui.session.monitor.look import Look

    from .wall import WallColumns, WallRow
    from .wall_curves import WallCurves

log = logging.getLogger(__name__)

STATES = 0.5
"""Refresh interval of drives and line, in seconds."""
QUIET = 1.0
"""Seconds without a key press after which the list of drives is sorted again."""
SEARCH_LABEL = 11
SEARCH_TEXT = 18
"""Minimum cells for the progress of a scan next to its full label."""
KEPT_FROM_TRIPPING = (
    "Kept alive while this line is open: {which}. If polling stops, they trip at the end of their"
    " communication timeout."
)
KEPT_FROM_REACTING = (
    "Kept alive while this line is open: {which}. If polling stops, they react at the end of their"
    " communication timeout."
)
"""Events shown once per drive, with its address and communication timeout in s."""
OPEN_CLASS = "-open"
"""Class of the screen while a line is open; else the list of lines is wider."""
WIDE_CLASS = "-wide"
"""Class of the screen while the drives have the whole width."""
NOBODY: Mapping[int, WallRow] = MappingProxyType({})
NOTHING_BELOW = [Text(""), Text("")]
"""Rows below the lists while no line is open."""


class LineView(PanelScreen):
    """Lines on the left, drives on the right, details of the chosen drive below.

    While the cursor is on the drives, they have the whole width, and the lines one row above.
    """

    _was_shown = False

    def __init__(self) -> None:
        super().__init__()
        self.warned: set[int] = set()
        """Devices whose reaction to lost polling has been reported."""
        self._advice = Advice(
            "No line is open.", "Choose a line and press Enter, or n to type one."
        )
        self.later = 0.0
        """Estimated seconds of the searches that follow the current one."""
        self.families = ""
        """Possible drives that react to lost polling; shown while the line is scanned."""
        self._looking: list[Timer] = []
        self._away = self._was_lost = False
        self._typed_at = -math.inf
        """Time of the last key press, in seconds on the monotonic clock."""
        self._curves: WallCurves | None = None

    def body(self) -> ComposeResult:
        """Yield the two columns, and the details of the chosen drive below."""
        yield Lines(id="open-lines")
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield Lines(id="lines-title", fit=_lines_title)
                yield LineList(id="lines")
                yield LineForm()
                yield Lines(id="search", fit=self._how_far)
            with Vertical(id="right"):
                yield Lines(id="drives-title", fit=self._drives_title)
                yield Lines(id="columns")
                yield Lines(id="message", fit=self._advice_lines)
                yield DriveList(id="drives", moved=self.show_about, resized=self.show_drives)
        yield Lines(id="about")

    @property
    def found(self) -> Mapping[int, FoundDrive]:
        """The drives that answered on the open line, by device."""
        return self.app.fleet.found if self.app.fleet else {}

    @property
    def lines(self) -> LineList:
        return self.query_one(LineList)

    @property
    def drives(self) -> DriveList:
        return self.query_one(DriveList)

    @property
    def form(self) -> LineForm:
        return self.query_one(LineForm)

    @property
    def search(self) -> Search | None:
        """The current or last search on the open line; None if there was none."""
        return self.app.fleet.search if self.app.fleet else None

    def on_mount(self) -> None:
        """Fill the list of lines, report errors in the settings file, and start the refresh."""
        self.lines.look_for_lines()
        for fault in line_settings().faults:
            self.app.events.add(ALARM_KIND, fault)
        self.lines.fill(self.app.line_text, self.app.open_texts)
        self.form.offer_settings(self.lines.chosen)
        if not self.app.low_bandwidth:  # there the refresh of the frame does it
            self._looking = [self.set_interval(STATES, self.look)]

    def on_resize(self, event: Resize) -> None:
        """Redraw at the new width, and again after the layout has settled."""
        self._redraw()
        self.call_after_refresh(self._redraw)  # a scroll bar may have appeared

    def on_screen_suspend(self) -> None:
        """Pause the refresh while another screen is on top.

        A change below another screen makes Textual redraw the whole terminal.
        """
        self._away = True
        for timer in self._looking:
            timer.pause()

    def on_screen_resume(self, event: ScreenResume) -> None:
        """Resume the refresh, and find lines again after another screen was on top."""
        if not self._was_shown:
            # all parts are already styled; styling them again would delay the first screen
            event.refresh_styles, self._was_shown = False, True
        if self._away:
            self._away = False
            self.lines.look_for_lines()
        for timer in self._looking:
            timer.resume()
        self.call_after_refresh(self._redraw)
        self.call_after_refresh(self._put_fields)

    async def _put_fields(self) -> None:
        """Mount the fields of the form after the first draw, if this screen is still on top."""
        if self.is_current:
            await self.form.put_fields()

    def _redraw(self, *, lines: bool = True) -> None:
        if not self.app.is_running:
            return  # as in `look`: on exit, a screen's parts are removed one by one
        if lines:
            self.lines.fill(self.app.line_text, self.app.open_texts, self.app.faulty_texts)
        self.show_drives()
        self.show_heads()

    def draw(self, width: int) -> None:
        """Show drives, line state and scan progress; report drives that react to lost polling."""
        super().draw(width)
        self._follow_line()
        self._redraw(lines=len(self.app.panel_lines) > 1)
        fleet = self.app.fleet if self.app.replay is None else None
        if fleet is not None and not (self.search and self.search.goes_on):
            self._warn(fleet.line_watch.looks)

    # The drives

    def show_drives(self) -> None:
        """Redraw the drives; does nothing below another screen."""
        if not self.is_current:
            return
        self._give_room()
        rows: Mapping[int, WallRow] = {}
        lines: Mapping[int, Text] = {}
        heads: list[Text] = []
        if self.app.fleet is not None:
            rows, lines, heads = self._table(self.app.fleet)
        self.drives.fill(lines, rows, sort=self._is_user_idle())
        width = self.query_one("#drives-title").size.width
        self.put("drives-title", self._drives_title(width, rows))
        self.put("columns", heads)
        self._show_advice()
        self.show_about()

    def _table(self, fleet: Fleet) -> tuple[Mapping[int, WallRow], Mapping[int, Text], list[Text]]:
        """Return the row of each drive, its line as drawn, and the heads of the columns."""
        # imported late: speeds up the start
        from .rows import drive_names, rows_of
        from .wall import column_heads, columns_for, wall_line

        width = max(20, self.drives.size.width - 1)
        now, wall = self.app.clock.monotonic(), self.app.clock.wall()
        two_rows = 2 * len(self.found) <= self.drives.size.height
        columns = columns_for(width, two_rows=two_rows, names=drive_names(fleet))
        curves: Mapping[int, tuple[str, ...]] = {}
        scale: float | None = None
        if columns.curve:
            curves, scale = self._draw_curves(fleet, columns, now, wall)
        rows = rows_of(fleet, now, connected=self._connected(), wall=wall, curves=curves)
        lines = {device: wall_line(row, columns) for device, row in rows.items()}
        return rows, lines, [column_heads(columns, scale)] if rows else []

    def _draw_curves(
        self, fleet: Fleet, columns: WallColumns, now: float, wall: float
    ) -> tuple[Mapping[int, tuple[str, ...]], float]:
        """Return the curves of the last minute by device, and the end of their scale in Hz."""
        # imported late: speeds up the start
        from tui.widgets.curve import curve_signs

        from .rows import TRUSTED_LOOKS
        from .wall_curves import CurveCells, WallCurves

        if self._curves is None:
            self._curves = WallCurves()
        signs = curve_signs(plain=self.app.plain_signs, braille=self.app.has_braille)
        reach = TRUSTED_LOOKS * fleet.line_watch.glance_period
        cells = CurveCells(columns.curve, columns.rows, signs)
        return self._curves.draw(fleet.consoles, cells, now=now, wall=wall, reach=reach)

    def _give_room(self) -> None:
        """Give the drives the whole width while the cursor is not on the lines or the form."""
        left = self.query_one("#left")
        focused = self.focused
        self.set_class(self.app.fleet is not None, OPEN_CLASS)
        wide = bool(self.found) and (focused is None or left not in focused.ancestors)
        if wide is not self.has_class(WIDE_CLASS):
            self.set_class(wide, WIDE_CLASS)
            self.call_after_refresh(self._redraw)
        if wide:
            self.put("open-lines", [self._open_lines()])

    def _open_lines(self) -> Text:
        """Return the open lines with their numbers of drives, and the keys for another."""
        text = Text(" Lines ", FAINT, no_wrap=True)
        lines = self.app.panel_lines
        if not lines and self.app.fleet is not None:
            text.append(" ").append(*LIST_MARKS["shown"]).append(self.app.line_label, STRONG)
            text.append(f" {len(self.found)}  ", FAINT)
        for line in lines:
            shown = line.opened is self.app.opened
            faulty = bool(line.fleet.alarms.active)
            mark: ListMark = "shown" if shown else "fault" if faulty else "open"
            text.append(" ").append(*LIST_MARKS[mark])
            text.append(line.opened.label, STRONG if shown else PLAIN)
            text.append(f" {len(line.fleet.found)}  ", FAINT)
        for key, does in ((".", "drive"), ("n", "new"), ("Tab", "lines")):
            if text.cell_len + len(f" {key} {does}") <= self.size.width:
                text.append(f" {key}", KEY).append(f" {does}  ", FAINT)
        return text

    def _drives_title(self, width: int, rows: Mapping[int, WallRow] = NOBODY) -> list[Text]:
        if not rows:
            return [rule(short(self.app.line_label or "No line", max(4, width - 2)), width)]
        from .wall import heading

        return [heading(list(rows.values()), scan_forms(self.search, self.later), width)]

    def show_about(self) -> None:
        """Show details of the drive under the cursor, its next step, and line health."""
        drive, fleet = self.found.get(self.drives.chosen or 0), self.app.fleet
        left = fleet.left_behind(drive.console) if drive and drive.console and fleet else ""
        line = self.app.opened.line if self.app.opened is not None else None
        if fleet is None and line is None:
            self.put_all("about", NOTHING_BELOW)
            return
        from .rows import about_lines

        self.put_all("about", about_lines(drive, left, self.size.width, line))

    def on_key(self, event: Key) -> None:
        """Note the time of the key press: the list is not sorted while keys arrive."""
        self._typed_at = self.app.panel_clock.monotonic()
        super().on_key(event)

    def _is_user_idle(self) -> bool:
        return self.app.panel_clock.monotonic() - self._typed_at >= QUIET

    # The titles

    def show_heads(self) -> None:
        """Show the title of the lines and the progress of the scan."""
        if not self.is_current:
            return
        for place, fit in (("lines-title", _lines_title), ("search", self._how_far)):
            self.put(place, fit(self.query_one(f"#{place}").size.width))

    def _how_far(self, width: int) -> list[Text]:
        """Return the progress of the scan, or why there is none."""
        label = SEARCH_LABEL if width > SEARCH_LABEL + SEARCH_TEXT else len(" Scan ")
        far = "no line open" if self.app.fleet is None else "press s"
        if self.search is not None:
            far = far_text(self.search, self.later, width - label)
        return [pair(" Scan", far, PLAIN, label)]

    # Events and advice

    def say(self, happened: str, next_step: str, kind: str = "") -> None:
        """Record an event; while there is no drive, also show it with the next step."""
        self.app.events.add(kind or "told", happened)
        self.advise(happened, next_step, kind)

    def advise(self, now: str, next_step: str, kind: str = "") -> None:
        """While there is no drive, show an event with the next step."""
        self._advice = Advice(now, next_step, kind)
        self._show_advice()

    def fail(self, error: Exception) -> None:
        """Record an error, and show it with the next step."""
        self.app.events.add(ERROR_KIND, str(error))
        self.hint_keys(hint_for(error) if self.found else "")
        self.advise(str(error), hint_for(error), ERROR_KIND)

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """Log an unexpected error with its traceback, and report it in one line."""
        if event.state is WorkerState.ERROR:
            log.error("%s failed", event.worker.name, exc_info=event.worker.error)
            self.say(
                f"Internal error: {event.worker.error}",
                "Try again. See drivepanel.log in the state folder.",
                ERROR_KIND,
            )

    def _show_advice(self) -> None:
        if not self.is_current:
            return
        width = self.query_one("#right").size.width
        self.put("message", [] if self.found else self._advice_lines(width))

    def _advice_lines(self, width: int) -> list[Text]:
        """Lay out the current advice for the right column."""
        return advice_lines(
            self._advice,
            width,
            left=left_text(self.search, self.later),
            families=self.families,
            read_only=self.app.read_only,
        )

    def _follow_line(self) -> None:
        """Show that the line is lost, and that it is back; visible while there is no drive."""
        opened = self.app.opened
        if opened is None:
            return
        lost = opened.line.state.status.value == "lost"
        if lost:
            reason = f"LINE LOST: {opened.line.state.reason}"
            self.advise(reason, "Reconnecting automatically. Then press s to scan.", ALARM_KIND)
        elif self._was_lost and self._connected():
            self.advise("The line is back.", "Press s to scan.")
        self._was_lost = lost or (self._was_lost and not self._connected())

    def _connected(self) -> bool:
        opened = self.app.opened
        return opened is not None and opened.line.state.status.value == "connected"

    def _warn(self, looks: Mapping[int, Look]) -> None:
        """Report each drive with an active communication timeout once."""
        assert self.app.fleet is not None
        watching = {d: look.timeout for d, look in looks.items() if look.timeout is not None}
        new = {device: timeout for device, timeout in watching.items() if device not in self.warned}
        if not new or self.app.fleet.line_watch.unread():
            return  # wait, and report all drives together
        self.warned |= new.keys()
        which = ", ".join(f"{device} ({timeout:g} s)" for device, timeout in sorted(new.items()))
        watches = [self.app.fleet.line_watch.watch(device) for device in new]
        trip = all(watch and watch.trips for watch in watches)
        text = KEPT_FROM_TRIPPING if trip else KEPT_FROM_REACTING
        self.app.events.add("done", text.format(which=which))


def _lines_title(width: int) -> list[Text]:
    return [rule("Lines", width)]
