"""Regular checks on every screen: the frame, new faults, failed stops."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tui.widgets.strip import FrameView

from .app_port import Panel
from .frame import SELDOM, Framed
from .frame_source import FrameSource

if TYPE_CHECKING:
    from tui.session.console import DriveConsole

HEALTH_LOOK = 1.0
"""Seconds between two checks of the lines' last minute."""

WHAT_TO_DO = "Open it, then press Space to stop it or T to take it over."


class StatusRefresher(Panel):
    """Draws the frame of the screen on top, and reports faults and troubles on every screen."""

    bell_rings = True
    """True if a new fault rings."""

    def __init__(self) -> None:
        super().__init__()
        self._frame = FrameSource(self)
        self._drawn: object = None
        """Urgent parts of the frame as last drawn."""
        self._drawn_at = 0.0
        self._keys_shown = ("", False)
        """Label of the stop key at the last check, and True if a line was being opened then."""
        self._journal_trouble = ""
        self._left_behind_seen: set[DriveConsole] = set()
        """Drives that were reported as running without a commander."""
        self._judged_at = -math.inf
        """When the health of the lines was last checked, on the panel's clock."""

    def look_around(self) -> None:
        """Update the frame, ring for a new fault, and report new troubles."""
        if not self.is_running:
            return  # the panel ends: its screens are removed before its timers
        live = self.live_fleets
        new = [
            fleet.alarms.take(fleet.line_watch.states, fleet.line_watch.onsets.by_device)
            and fleet in live
            for fleet in self.fleets
        ]
        if any(new) and self.bell_rings:
            self.bell()
        self._say_left_behind()
        if (now := self.panel_clock.monotonic()) >= self._judged_at + HEALTH_LOOK:
            self._judged_at = now
            self._judge_lines()
        trouble = self.journal_trouble
        if trouble and trouble != self._journal_trouble:
            self.notify(trouble, severity="error")
        self._journal_trouble = trouble
        self.draw_frame()
        if isinstance(self.screen, Framed) and self.screen.is_mounted:
            self.screen.look_in_time()

    def frame_now(self) -> FrameView:
        """Return the frame around every screen at this moment."""
        return self._frame.view()

    def draw_frame(self) -> None:
        """Draw the frame of the screen on top; on a slow link its figures less often."""
        if not isinstance(self.screen, Framed):
            return
        keys_shown_now = self.stop_target_text, self.opening.goes_on
        if keys_shown_now != self._keys_shown:
            self._keys_shown = keys_shown_now
            self.screen.draw_stop_keys()
        view, now = self._frame.view(), self.panel_clock.monotonic()
        drawn = (self.screen, self.screen.size, view.at_once)
        if drawn != self._drawn:
            self.hurry()
        elif self.low_bandwidth and now < self._drawn_at + SELDOM:
            return
        self._drawn, self._drawn_at = drawn, now
        self.screen.draw_frame(view)
        if self.low_bandwidth and self.screen.is_mounted:
            self.screen.look()  # both in one output

    def _judge_lines(self) -> None:
        """Report once each trouble in the last minute of a line, and its end."""
        labels = {id(item.fleet): item.opened.label for item in self.panel_lines}
        for fleet in self.live_fleets:
            # not shared with other programs: each of them reports it itself
            label = "" if fleet is self.fleet else f"{labels[id(fleet)]}: "
            health, line = fleet.health, fleet.line
            if line.state.status.value != "connected":
                health.forget()
                continue
            for kind, text in health.look(line.counters):
                self.events.add(kind, f"{label}{text}")

    def _say_left_behind(self) -> None:
        """Report once each running motor whose program has exited and that has no commander."""
        left = set()
        for fleet in self.fleets:
            for console in fleet.consoles:
                if text := fleet.left_behind(console):
                    left.add(console)
                    if console not in self._left_behind_seen:
                        self.events.add("alarm", f"{text} {WHAT_TO_DO}", console.device)
        self._left_behind_seen = left
