"""The page of time that the curve shows, the cursor that reads it, and their keys."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tui.widgets.curve import PAGE_STEPS, PageStep, page_start

from .arrange import Arrangement
from .curves import LABEL_CELLS, MARGIN_CELLS
from .run_keys import InputKeys
from .view import USUAL_STEP

NOTHING_TO_READ = "Nothing has been read yet: there is no curve."
FIRST_OPEN = "{} moves the cursor. Press = first."


@dataclass(frozen=True, slots=True)
class TimeCursor:
    """A page of time, and the cursor on it; times are monotonic, in seconds.

    While there is a cursor the page does not turn: what is read stays where it is.
    """

    step: PageStep = USUAL_STEP
    page: float | None = None
    """Start of the page while there is a cursor; None for the current page."""
    moment: float | None = None
    """Moment that the cursor reads; None if there is no cursor."""

    def with_span(self, step: int) -> TimeCursor:
        """Return a page that is longer or shorter by a step, with no cursor."""
        at = PAGE_STEPS.index(self.step) + step
        return TimeCursor(PAGE_STEPS[max(0, min(len(PAGE_STEPS) - 1, at))])

    def closed(self) -> TimeCursor:
        """Return the current page, with no cursor."""
        return TimeCursor(self.step)

    def opened(self, moment: float, apart: float) -> TimeCursor:
        """Return a cursor at a moment, on its page; `apart` is wall minus monotonic time."""
        return replace(self, page=page_start(moment + apart, self.step) - apart, moment=moment)

    def moved(self, columns: int, width: int, first: float, last: float) -> TimeCursor:
        """Return the cursor so many columns of `width` further, from `first` to `last` at most.

        At an edge the page turns.
        """
        if self.moment is None or self.page is None:
            return self
        cell = self.step.span / width
        # the middle of a column: the error of a sum of columns never reaches its edge
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
    """Keys that read the curve at a moment; no other key changes its meaning."""

    time_cursor = TimeCursor()
    _word: int | None = None
    """The table in the place of the curve, which is None."""

    def _room(self) -> Arrangement:
        raise NotImplementedError

    @property
    def reads_curve(self) -> bool:
        """True if there is a cursor."""
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
        """Move the cursor; without one, name the key that opens it."""
        trend = self.console.monitor.trend
        if not self.reads_curve or not trend:
            self.app.tell(FIRST_OPEN.format("Left" if columns < 0 else "Right"))
            return
        width = self._room().width - LABEL_CELLS - 1 - MARGIN_CELLS
        self.time_cursor = self.time_cursor.moved(columns, width, trend[0].time, trend[-1].time)
        self.look()

    def action_leave(self) -> None:
        """Close the cursor; without one, go back to Line."""
        if self.reads_curve:
            self.action_cursor()
            return
        super().action_leave()
