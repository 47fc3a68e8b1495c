"""What is looked at on every screen, now and then: the frame, new faults, stops that failed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tui.widgets.strip import FrameView

from .app_port import Panel
from .frame import SELDOM, Framed
from .frame_source import FrameSource

if TYPE_CHECKING:
    from tui.session.command.stop_report import StopReport

FRAME_LOOK = 0.25
"""Seconds between two looks at what stands around every screen."""


class Lookout(Panel):
    """Draws the frame of the screen on top, and says what must be heard wherever one is."""

    bell_rings = True
    """Whether a new fault rings."""

    def __init__(self) -> None:
        super().__init__()
        self._cried: list[StopReport] = []
        """Stops that failed, and of which that was said."""
        self._frame = FrameSource(self)
        self._drawn: object = None
        """What of the frame is shown at once, as it was drawn last."""
        self._drawn_at = 0.0
        self._stops_whom = ""
        """Whom the stop key meant at the last look."""
        self._journal_trouble = ""

    def look_around(self) -> None:
        """What must be seen on every screen: the frame, a new fault, a stop that failed."""
        if not self.is_running:
            return  # the panel ends: its screens are gone before its timers
        new = [fleet.alarms.take(fleet.line_watch.states) for fleet in self.fleets]
        if any(new) and self.bell_rings:
            self.bell()
        self._cry_for_stops()
        trouble = self.journal_trouble
        if trouble and trouble != self._journal_trouble:
            self.notify(trouble, severity="error")
        self._journal_trouble = trouble
        self.draw_frame()

    def frame_now(self) -> FrameView:
        """What stands around every screen at this moment."""
        return self._frame.view()

    def draw_frame(self) -> None:
        """Put the frame of the screen on top as it is now; on a slow link its figures seldom."""
        if not isinstance(self.screen, Framed):
            return
        if self.stops_whom != self._stops_whom:
            self._stops_whom = self.stops_whom
            self.screen.draw_stop_keys()
        view, now = self._frame.view(), self.clock.monotonic()
        drawn = (self.screen, self.screen.size, view.at_once)
        if drawn != self._drawn:
            self.hurry()
        elif self.low_bandwidth and now < self._drawn_at + SELDOM:
            return
        self._drawn, self._drawn_at = drawn, now
        self.screen.draw_frame(view)

    def _cry_for_stops(self) -> None:
        """Say over everything, once, that a motor does not stop."""
        failed = []
        labels = {id(one.fleet): f"{one.opened.label}: " for one in self.panel_lines}
        for fleet in self.fleets:
            line = labels.get(id(fleet), "") if len(labels) > 1 else ""
            for report in fleet.stopper.reports.values():
                if report.phase.value == "failed":
                    failed.append(report)
                    if report not in self._cried:
                        self.cry(f"{line}Device {report.device}: {report.text}")
        self._cried = failed
