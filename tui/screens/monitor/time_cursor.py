"""Page of time that the curve shows, the cursor that reads it, and their keys."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tui.widgets.curve import PAGE_STEPS, PageStep, page_start

from .arrange import Arrangement
from .run_keys import InputKeys
from .time_axis import LABEL_CELLS, MARGIN_CELLS
from .view import USUAL_STEP

NOTHING_TO_READ = "Nothing has been read yet: there is no curve."
FIRST_OPEN = "{} moves the cursor. Press = first."


@dataclass(frozen=True, slots=True)
class TimeCursor:
    """Page of time, and the cursor on it; times are monotonic, in seconds.

    While the cursor is open the page does not turn, so the curve under it does not move.
    """

    step: PageStep = USUAL_STEP
    page: float | None = None
    """Start of the page while there is a cursor; None for the current page."""
    moment: float | None = None
    """Moment that the cursor reads; None if there is no cursor."""

    def with_span(self, step: int) -> TimeCursor:
        """Return a page longer or shorter by `step` places in PAGE_STEPS, with no cursor."""
        at = PAGE_STEPS.index(self.step) + step
        return TimeCursor(PAGE_STEPS[max(0, min(len(PAGE_STEPS) - 1, at))])

    def closed(self) -> TimeCursor:
        """Return the current page, with no cursor."""
        return TimeCursor(self.step)

    def opened(self, moment: float, apart: float) -> TimeCursor:
        """Return a cursor at a moment, on its page; `apart` is wall minus monotonic time."""
        return replace(self, page=page_start(moment + apart, self.step) - apart, moment=moment)

    def moved(self, columns: int, width: int, first: float, last: float) -> TimeCursor:
        """Return the cursor moved by columns of a page of `width`, within `first` and `last`.

        The page turns if the cursor crosses its edge.
        """
        if self.moment is None or self.page is None:
            return self
        cell = self.step.span / width
        # the middle of a column, so that rounding errors never cross its edge
        column = (self.moment - self.page) // cell + columns
        moment = self.page + (column + 0.5) * cell
        moment = max(first, min(last, moment))
        page = self.page
        while moment < page:
            page -= self.step.turn
        while moment >= page + self.step.span:
            page += self.step.turn
        return replace(self, page=page, moment=moment)


class CursorKeys(InputKeys):
    """Keys of the cursor on the curve; an open cursor changes no other key."""

    time_cursor = TimeCursor()
    _word: int | None = None
    """Index of the table shown instead of the curve; None for the curve."""

    def _room(self) -> Arrangement:
        raise NotImplementedError

    @property
    def reads_curve(self) -> bool:
        """True while the cursor is open."""
        return self.time_cursor.moment is not None

    def action_cursor(self) -> None:
        """Open the cursor at the newest values, or close it."""
        trend = self.console.monitor.trend
        if self.reads_curve:
            self.time_cursor = self.time_cursor.closed()
        elif not trend:
            self.app.tell(NOTHING_TO_READ)
        else:
            apart = self.app.clock.wall_of(0.0)
            self.time_cursor = self.time_cursor.opened(trend[-1].time, apart)
            self._word = None
        self.look()

    def action_move_cursor(self, columns: int) -> None:
        """Move the cursor by columns; if it is closed, name the key that opens it."""
        trend = self.console.monitor.trend
        if not self.reads_curve or not trend:
            self.app.tell(FIRST_OPEN.format("Left" if columns < 0 else "Right"))
            return
        width = self._room().width - LABEL_CELLS - 1 - MARGIN_CELLS
        self.time_cursor = self.time_cursor.moved(columns, width, trend[0].time, trend[-1].time)
        self.look()

    def action_leave(self) -> None:
        """Close the cursor; if it is closed, go back to Line."""
        if self.reads_curve:
            self.action_cursor()
            return
        super().action_leave()
