"""Data for Monitor, gathered from the drive and its line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tui.session.command.stop_report import Phase, StopReport

from ..command.control import Control
from ..frame_source import stands_by
from .view import View

if TYPE_CHECKING:
    from tui.session.console import DriveConsole

    from ..app_port import Panel

STOP_TOLD = {Phase.STOPPED: 10.0, Phase.FAILED: 60.0}
"""Seconds for which the end of a stop is shown."""


class ViewSource:
    """Makes Monitor's view of the moment; belongs to the panel's loop."""

    def __init__(self, app: Panel, console: DriveConsole) -> None:
        self._app = app
        self._console = console
        self._was = ""

    def view(self, control: Control, span: float, word: int | None) -> View:
        """All that the screen shows now; `span` is the window of the trend in seconds."""
        app, console, session = self._app, self._console, self._console.session
        now, monitor, fleet = app.clock.monotonic(), console.monitor, app.fleet
        snapshot = monitor.latest
        if snapshot is not None and not snapshot.error and snapshot.state.kind != "unknown":
            self._was = snapshot.state.headline
        return View(
            profile=session.profile,
            snapshot=snapshot,
            line=session.line.state,
            counters=session.line.counters,
            trend=monitor.trend,
            period=monitor.period,
            now=now,
            read_only=app.read_only,
            low_bandwidth=app.low_bandwidth,
            plain=app.plain_signs,
            watch=fleet.line_watch.watch(session.device) if fleet else None,
            heard=session.line.device_state(session.device).heard,
            control=control,
            stop=self._stop(now),
            was=self._was,
            span=span,
            stands_by=snapshot is not None and stands_by(console, snapshot.state),
            fault_at=self._fault_at(),
            word=word,
        )

    def _fault_at(self) -> str:
        """The time of this drive's trip, or since when its fault was seen."""
        fleet, device = self._app.fleet, self._console.session.device
        active = fleet.alarms.active if fleet else ()
        return next((fault.when for fault in active if fault.device == device), "")

    def _stop(self, now: float) -> StopReport | None:
        """Return the result of a stop of this drive; a good result for a while only."""
        fleet, session = self._app.fleet, self._console.session
        report = fleet.stopper.reports.get(session.device) if fleet else None
        if report is None or self._is_overtaken(report):
            return None
        return report if now - report.since < STOP_TOLD.get(report.phase, now) else None

    def _is_overtaken(self, report: StopReport) -> bool:
        """Return True if something newer is true: a later command, or a motor that runs again."""
        outcome, latest = self._console.session.work.outcome, self._console.latest
        if outcome is not None and outcome.time > report.since:
            return True
        runs = latest is not None and not latest.error and latest.state.motion == "running"
        return runs and report.phase is Phase.STOPPED
