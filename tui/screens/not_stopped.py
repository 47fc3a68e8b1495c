"""Motors that a stop does not stop, as every screen shows them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from tui.session.command.stop_report import NOT_STOPPED

if TYPE_CHECKING:
    from tui.session.command.stop_report import StopReport
    from tui.session.drive import DriveSession

    from .app_port import Panel

FAILED_SHOWN = 60.0
"""Seconds for which a failed stop is shown over everything, unless its motor is at rest."""


def not_stopped_texts(app: Panel, now: float) -> tuple[str, ...]:
    """A text for each motor that a stop does not stop."""
    labels = {id(item.fleet): f"{item.opened.label}, " for item in app.panel_lines}
    found = []
    for fleet in app.fleets:
        line = labels.get(id(fleet), "") if len(labels) > 1 else ""
        for session in fleet.sessions:
            report = fleet.stopper.reports.get(session.device)
            if report is not None and is_not_stopped(report, session, now):
                why = report.text.removeprefix(NOT_STOPPED)
                found.append(f"NOT STOPPED, {line}drive {session.device}: {why}")
    text, since = app.unreached
    if text and now - since < FAILED_SHOWN:
        found.append(text)
    return tuple(found)


def is_not_stopped(report: StopReport, session: DriveSession, now: float) -> bool:
    """True if, as far as is known, the motor of a stop has not stopped yet."""
    if report.phase.value == "unheeded":
        return True
    if report.phase.value != "failed" or now - report.since > FAILED_SHOWN:
        return False
    outcome = session.work.outcome
    newer = outcome is not None and outcome.kind == "done" and outcome.time > report.since
    # by a guessed family no motor is seen at rest
    return not newer and (session.guessed or session.rest_seen <= report.since)


def repeats(message: str, texts: Iterable[str]) -> bool:
    """True if a message repeats what is shown of a stop over everything."""
    _, head, why = message.partition(NOT_STOPPED)
    return bool(head) and any(text.endswith(why) for text in texts)
