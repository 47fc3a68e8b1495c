"""Trend: curves of any parameters of the line, from its record and live."""

from __future__ import annotations

import asyncio
import math
from typing import ClassVar

from textual.app import ComposeResult

from tui.drive.values import possible_decimals
from tui.session.console import DriveConsole
from tui.session.monitor.trend_bands import MOST_BANDS, stored_bands
from tui.session.record.history import oldest_reply
from tui.widgets.curve import curve_signs
from tui.widgets.lines import Lines

from ..keys.table import bindings
from .band_keys import BandKeys
from .contents import BandView, TrendRoom, TrendView
from .event_list import trend_events
from .loading import first_bands
from .page import TrendPage
from .table import TableRow
from .traces import BandTrace, reach_of_trace, value_at
from .view import scale_for, trend_room, trend_rows

AGAIN_AFTER = 3.0
"""Seconds after which the record is read again: it then has what was read while it was loaded."""
CURVES_SELDOM = 4.0
"""Seconds between two refreshes of the curves on a low-bandwidth link."""
EARLIER, LATER = 0.1, 15.0
"""Seconds between two refreshes by which the time may differ without another read of the record."""
LOADING_RECORD, PARTLY_REDUCED = "loading", "partly 10 s values"
NEW_BAND = "Band {} is empty. Press Enter to choose its parameter."
NOTHING_RECORDED = "Nothing older is recorded."


class TrendScreen(BandKeys):
    """Curves of up to four parameters, with a cursor, two marks and the events."""

    BINDINGS: ClassVar = bindings("trend")
    TITLE = "Trend"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__(console)
        self._event: int | None = None
        """Selected event while the events are open."""
        self._seen = 0.0
        """Time of the last refresh, in seconds since 1970."""
        self._drawn: object = None
        """Everything but values that was drawn last."""
        self._drawn_at = -math.inf

    def body(self) -> ComposeResult:
        """Create the one part."""
        yield Lines(id="trend")

    def on_mount(self) -> None:
        """Show the bands of the line, and begin to read them."""
        self._set_bands(stored_bands(self._line_key) or first_bands(self.console))
        self.set_timer(AGAIN_AFTER, self._load)

    def resume(self, before: object) -> None:
        """Keep the marks and the length of the page; it follows the new time."""
        if isinstance(before, TrendScreen):
            self.page = before.page.run()

    def draw(self, width: int) -> None:
        """Draw the bands with what was read since."""
        super().draw(width)
        if self._may_wait():
            return
        height = self.size.height - 4
        lines = trend_rows(self._view(), width, height)
        self.put_all("trend", lines)

    def _may_wait(self) -> bool:
        """True if only new values would be drawn, and a low-bandwidth link has others to send.

        What a key changes, and a band that is read no longer, is drawn at once.
        """
        now = self.app.clock.monotonic()
        bands = tuple(
            (trace.loaded, trace.trouble, trace.band in self._marks) for trace in self.traces
        )
        drawn = self.page, self._selected, self._event, bands, self.size
        waits = (
            self.app.low_bandwidth and drawn == self._drawn and now < self._drawn_at + CURVES_SELDOM
        )
        if not waits:
            self._drawn, self._drawn_at = drawn, now
        return waits

    def _view(self) -> TrendView:
        clock = self.app.clock
        now, page = clock.wall(), self.page
        start, span = page.begins(now), page.step.span
        turned = self._drawn_page != (start, span)
        if not page.held and not -EARLIER <= now - self._seen <= LATER:
            self._load()  # a replay has gone to another time, or the clock was set
        self._seen = now
        self._drawn_page = start, span
        if not page.held:
            for trace in self.traces:
                trace.add_live(start, span)
        several = len({trace.band.device for trace in self.traces}) > 1
        moment = clock.monotonic()
        bands = [self._band(trace, moment, several=several, turned=turned) for trace in self.traces]
        devices = frozenset(trace.band.device for trace in self.traces)
        return TrendView(
            bands=bands,
            selected=self._selected,
            page=page,
            now=now,
            moment=moment,
            events=trend_events(self._recorded, self.app.events.events, devices),
            event=self._event,
            oldest=self._oldest,
            plain=self.app.plain_signs,
            lean=self.app.low_bandwidth,
            signs=curve_signs(plain=self.app.plain_signs, braille=self.app.has_braille),
        )

    def _band(self, trace: BandTrace, moment: float, *, several: bool, turned: bool) -> BandView:
        page, entry = self.page, trace.entry
        digits = possible_decimals(entry) if entry is not None else 1
        reach = reach_of_trace(trace)
        name = f"{trace.band.device} {trace.band.code}" if several else trace.band.code
        note = "" if trace.loaded else LOADING_RECORD
        if trace.troubles:
            note = trace.troubles[0]
        elif any(point.reduced for point in trace.points):
            note = note or PARTLY_REDUCED
        reading = trace.reading(moment)
        number = reading.current_number if reading is not None and not trace.trouble else None
        points = trace.points
        reference = trace.reference.points if trace.reference is not None else []
        trace.scale = scale_for([*points, *reference], None if turned else trace.scale, number)
        row = TableRow(
            name=name,
            unit=trace.unit,
            digits=digits,
            now="" if number is None else f"{number:z.{digits}f}",
            at_cursor=page.cursor is not None,
            at_mark=page.mark_a is not None,
            cursor=None if page.cursor is None else value_at(points, page.cursor, reach),
            at_a=None if page.mark_a is None else value_at(points, page.mark_a, reach),
            marks=self._marks.get(trace.band) if page.mark_b is not None else None,
            seconds=(page.mark_b or 0.0) - (page.mark_a or 0.0),
        )
        return BandView(
            name=name,
            title=entry.name if entry is not None else "",
            unit=trace.unit,
            entry=entry,
            digits=digits,
            points=points,
            reach=reach,
            scale=trace.scale,
            reading=reading,
            trouble=trace.trouble,
            note=note,
            row=row,
            reference=trace.reference.band.code if trace.reference and reference else "",
            reference_points=reference,
        )

    def _room(self) -> TrendRoom:
        size = self.size
        return trend_room(
            size.width, size.height - 4, len(self.traces), events=self._event is not None
        )

    def _turn(self, page: TrendPage) -> None:
        """Show another page; read its record if it needs that."""
        now = self.app.clock.wall()
        before, self.page = self.page, page
        same = before.begins(now) == page.begins(now) and before.step == page.step
        if not same or (before.held and not page.held):
            self._load()
        self.look()

    def action_move_cursor(self, columns: int) -> None:
        """Move the cursor by columns; it opens at the newest value, and the curves are held."""
        self._turn(self.page.moved(columns, self._room().columns, self.app.clock.wall()))

    def action_mark(self) -> None:
        """Set a mark."""
        self.page = self.page.marked(self.app.clock.wall())
        self._marks = {}
        self._load_marks()
        self.look()

    def action_trend_window(self, step: int) -> None:
        """Lengthen or shorten the page."""
        self._turn(self.page.with_span(step, self.app.clock.wall()))

    def action_hold(self) -> None:
        """Hold the curves, or let them run."""
        now = self.app.clock.wall()
        self._turn(self.page.run() if self.page.held else self.page.hold(now))

    def action_page(self, pages: int) -> None:
        """Show an earlier or later time."""
        self._turn(self.page.turned(pages, self.app.clock.wall()))

    def action_newest(self) -> None:
        """Let the curves run."""
        self._turn(self.page.run())

    def action_oldest(self) -> None:
        """Show the oldest values of the record."""
        self.run_worker(self._show_oldest(), group="oldest", exclusive=True, exit_on_error=False)

    async def _show_oldest(self) -> None:
        devices = {trace.band.device for trace in self.traces}
        found = await asyncio.to_thread(oldest_reply, self._files(), devices)
        if found is None:
            self.app.tell(NOTHING_RECORDED)
            return
        self._turn(self.page.at(found, self.app.clock.wall()))

    def action_other_page(self) -> None:
        """Go to the events, or back to the curves."""
        self._event = 0 if self._event is None else None
        self.look()

    def action_move(self, rows: int) -> None:
        """Select another band, or another event while the events are open."""
        if self._event is not None:
            count = len(self._view().events)
            self._event = max(0, min(count - 1, self._event + rows))
        else:
            last = min(MOST_BANDS, len(self.traces) + 1) - 1
            self._selected = max(0, min(last, self._selected + rows))
            if self._selected == len(self.traces):
                self.app.tell(NEW_BAND.format(self._selected + 1))
        self.look()

    def action_pick_band(self) -> None:
        """Choose the parameter of the band; or show the time of the event."""
        if self._event is None:
            super().action_pick_band()
            return
        events = self._view().events
        if self._event < len(events):
            wall = min(events[self._event].wall, self.app.clock.wall())
            self._event = None
            self._turn(self.page.run().at(wall, self.app.clock.wall()))

    def action_leave(self) -> None:
        """Close the events or the cursor; else go back to Monitor."""
        if self._event is not None:
            self._event = None
            self.look()
        elif self.page.held:
            self.action_newest()
        else:
            super().action_leave()
