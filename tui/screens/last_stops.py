"""Stops of all motors that Drive Panel runs, ordered because the panel ends."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from tui.drive.sentences import counted, sentence
from tui.session.command.stop_report import AT_THE_MACHINE, NOT_STOPPED, StopReport

if TYPE_CHECKING:
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet

log = logging.getLogger(__name__)

STOPPED_WITHIN = 60.0
"""Seconds that the panel waits for the standstill of a motor."""
BY = "leaving the panel"
STANDSTILL_NOT_KNOWN = "it is not known whether the motor stopped. Check it at the machine."


class LineStops:
    """Stops of the motors of one line; ordering them raises nothing."""

    def __init__(self, fleet: Fleet, label: str = "") -> None:
        """`label` names the line, if several are open."""
        self.fleet = fleet
        self.label = label
        self.sessions: list[DriveSession] = []
        """Drives whose motors are to stop."""
        self.troubles: dict[int, str] = {}
        """Why no stop of a device was ordered."""
        self.followed = True
        """False if an error ended the wait for the standstill."""

    def order(self) -> None:
        """End all work on the line's drives, then order a stop of each motor started here."""
        for session in self.fleet.sessions:
            try:
                session.work.stop(BY)  # it sends no more frames, so no motor starts after the stop
            except Exception:
                log.exception("work on device %s was not ended", session.device)
        self.sessions = self._started_here()
        if not self.sessions or self._stopped(self.sessions):
            return
        for session in self.sessions:  # one by one: an error for one does not prevent the others
            self._stopped([session])

    def _started_here(self) -> list[DriveSession]:
        """Commanded drives, and those whose run frame may be on the way."""
        try:
            running = self.fleet.line_watch.under_command()
        except Exception:
            log.exception("which motors run is not known: every commanded one is stopped")
            running = self.fleet.commanded
        begun = [
            s for s in self.fleet.sessions if s.starts is not None and s.starts.holds(s.device)
        ]
        return [*running, *(session for session in begun if session not in running)]

    def _stopped(self, sessions: Sequence[DriveSession]) -> bool:
        """Order a stop of these drives; True if it was ordered."""
        try:
            self.fleet.stop(sessions, by=BY)
        except Exception as error:
            log.exception("no stop was ordered")
            self.troubles |= {item.device: f"{error}" for item in sessions}
            if len(sessions) == 1 and (console := self.fleet.console(sessions[0].device)):
                self.fleet.last_stop(error, console)
            return False
        for session in sessions:
            self.troubles.pop(session.device, None)
        return True

    def wait(self, seconds: float) -> bool:
        """Wait for the standstill of all; True if every motor was read at standstill."""
        ordered = [session for session in self.sessions if session.device not in self.troubles]
        try:
            summary = self.fleet.stopper.wait(ordered, seconds)
        except Exception:
            log.exception("the stops were not followed")
            self.followed = False
            return False
        ended = len(summary.reports) == len(ordered) and summary.ended
        return ended and not summary.failed and not self.troubles

    def lines(self) -> list[str]:
        """The result of each stop, for a person."""
        reports = self.fleet.stopper.reports
        return [
            f"{self.label}Device {device}: {self._result(device, reports.get(device))}"
            for device in (session.device for session in self.sessions)
        ]

    def _result(self, device: int, report: StopReport | None) -> str:
        if device in self.troubles or report is None:
            why = sentence(self.troubles.get(device, "no stop was sent"))
            return f"NOT STOPPED: {why} {AT_THE_MACHINE}"
        if report.phase.value in ("stopped", "failed"):
            return report.text if report.text.endswith(".") else f"{report.text}."
        if not self.followed:
            return STANDSTILL_NOT_KNOWN
        why = sentence(report.text.removeprefix(NOT_STOPPED))
        return f"NOT STOPPED after {STOPPED_WITHIN:.0f} s: {why} {AT_THE_MACHINE}"


class LastStops(NamedTuple):
    """The stops of all lines."""

    lines: Sequence[LineStops]

    @property
    def begun(self) -> str:
        """The motors that are being stopped, for a person."""
        devices = [
            f"{line.label}{session.device}" if line.label else str(session.device)
            for line in self.lines
            for session in line.sessions
        ]
        if not devices:
            return ""
        single, several = "Stopping device {devices}.", "Stopping devices {devices}."
        return counted(len(devices), single, several, devices=", ".join(devices))

    def follow(self) -> str:
        """Wait for the standstill of all, for at most `STOPPED_WITHIN`; return the results."""
        self.wait()
        return "\n".join(text for line in self.lines for text in line.lines())

    def wait(self) -> bool:
        """Wait at most `STOPPED_WITHIN` for all; True if all were read at standstill."""
        end = time.monotonic() + STOPPED_WITHIN
        stood = [line.wait(max(0.0, end - time.monotonic())) for line in self.lines]
        return all(stood)
