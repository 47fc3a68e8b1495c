"""Time that Trend shows: its page, the cursor and the two marks; pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tui.widgets.curve import PAGE_STEPS, PageStep, page_start

MINUTE, HOUR = 60.0, 3600.0
TREND_STEPS = (
    *PAGE_STEPS,
    PageStep(30 * MINUTE, 5 * MINUTE, 5 * MINUTE),
    PageStep(HOUR, 10 * MINUTE, 10 * MINUTE),
    PageStep(4 * HOUR, HOUR / 2, HOUR / 2),
    PageStep(8 * HOUR, HOUR, HOUR),
    PageStep(24 * HOUR, 3 * HOUR, 3 * HOUR),
)
FIRST_STEP = next(step for step in TREND_STEPS if step.span == MINUTE)


@dataclass(frozen=True, slots=True)
class TrendPage:
    """Page of time; times are in seconds since 1970."""

    step: PageStep = FIRST_STEP
    start: float | None = None
    """Start of the page while it is held; None if it follows the time."""
    until: float = 0.0
    """Time at which it was held: nothing after it is drawn."""
    cursor: float | None = None
    mark_a: float | None = None
    mark_b: float | None = None

    @property
    def held(self) -> bool:
        """True if new values do not change the curves."""
        return self.start is not None

    def begins(self, now: float) -> float:
        """Return the start of the page."""
        return page_start(now, self.step) if self.start is None else self.start

    def ends(self, now: float) -> float:
        """Return the time after which nothing is drawn."""
        return self.until if self.held else now

    def hold(self, now: float) -> TrendPage:
        """Return the page, held now."""
        if self.held:
            return self
        return replace(self, start=page_start(now, self.step), until=now)

    def run(self) -> TrendPage:
        """Return a page that follows the time, without a cursor."""
        return replace(self, start=None, cursor=None)

    def with_span(self, step: int, now: float) -> TrendPage:
        """Return a longer or shorter page by places in TREND_STEPS.

        A held page has its cursor in it, or else its last value.
        """
        at = TREND_STEPS.index(self.step) + step
        wider = replace(self, step=TREND_STEPS[max(0, min(len(TREND_STEPS) - 1, at))])
        if not self.held:
            return wider
        kept = self.cursor if self.cursor is not None else min(self.until, self._last())
        return replace(wider, start=page_start(kept, wider.step))

    def _last(self) -> float:
        """Return the last moment of a held page."""
        return (self.start or 0.0) + self.step.span - 1e-3

    def moved(self, columns: int, width: int, now: float) -> TrendPage:
        """Return the page with its cursor moved by columns of `width`.

        It opens at the newest value. The page turns if the cursor crosses its edge.
        """
        held = self.hold(now)
        if held.cursor is None:
            return replace(held, cursor=min(held.until, held._last()))
        cell = self.step.span / width
        start = held.begins(now)
        column = (held.cursor - start) // cell + columns
        return held.at(min(held.until, start + (column + 0.5) * cell), now)

    def at(self, moment: float, now: float) -> TrendPage:
        """Return the page with its cursor at a moment, turned so that the moment is in it."""
        held = self.hold(now)
        start, turn = held.begins(now), self.step.turn
        while moment < start:
            start -= turn
        while moment >= start + self.step.span:
            start += turn
        return replace(held, start=start, cursor=moment)

    def turned(self, pages: int, now: float) -> TrendPage:
        """Return an earlier or later page, by most of its length, and no cursor."""
        held = self.hold(now)
        start = held.begins(now) + pages * (self.step.span - self.step.turn)
        latest = page_start(held.until, self.step)
        return replace(held, start=min(start, latest), cursor=None)

    def marked(self, now: float) -> TrendPage:
        """Return the page with mark A, then B, at the cursor or the newest value; then without."""
        if self.mark_a is not None and self.mark_b is not None:
            return replace(self, mark_a=None, mark_b=None)
        at = self.cursor if self.cursor is not None else self.ends(now)
        if self.mark_a is None:
            return replace(self, mark_a=at)
        return replace(self, mark_b=at)
