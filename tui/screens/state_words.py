"""Words for the state of a drive, the same in the status bar, on Line and in questions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tui.session.command.stop_report import StopReport, as_seen

if TYPE_CHECKING:
    from tui.session.drive import DriveSession
    from tui.session.drive_state import DriveState
    from tui.session.shown import Shown

STOP_WORDS = {"sending": "STOP WAITS", "stopping": "STOPPING"}
"""Texts of a stop in progress: its frame waits for the line, or was sent."""
STOP_SHOWN = 10.0
"""Seconds for which a failed stop replaces the state, even if the state is known."""
DIRECTION_WORDS = {"forward": "FORWARD", "reverse": "REVERSE"}


def state_cell(
    session: DriveSession,
    state: DriveState | None,
    report: StopReport | None,
    now: float,
    readings: Mapping[str, Shown],
) -> tuple[str, str]:
    """Kind and words of the state; a stop in progress takes precedence."""
    if report is not None:
        report = as_seen(report, session.profile, state, readings)
        if report.phase.value in STOP_WORDS:
            return "stop", STOP_WORDS[report.phase.value]
        shown = report.phase.value == "unheeded" or now - report.since < STOP_SHOWN
        if report.phase.value in ("unheeded", "failed") and shown:
            return "stop failed", "NOT STOPPED"
    return ("", "reading") if state is None else state_words(session, state, readings)


def state_words(
    session: DriveSession, state: DriveState, readings: Mapping[str, Shown]
) -> tuple[str, str]:
    """Kind and words of a state, from the values read with it."""
    if state.kind == "running":
        return state.kind, DIRECTION_WORDS.get(state.direction or "", "RUNNING")
    if state.kind == "fault":
        return state.kind, f"FAULT {state.fault.code}" if state.fault else "FAULT"
    if stands_by(session, state):
        return "ready", "STANDBY"
    if state.kind == "stopping" and _is_at_zero(session, readings):
        return "stopped", "STOPPED"  # some drives keep the quick stop state at standstill
    return state.kind, state.headline.upper() or "UNKNOWN"


def _is_at_zero(session: DriveSession, readings: Mapping[str, Shown]) -> bool:
    parameter = session.profile.quantity("output_frequency")
    reading = readings.get(parameter.code) if parameter else None
    return reading is not None and reading.current_number == 0


def stands_by(session: DriveSession, state: DriveState) -> bool:
    """Return True if the motor is at standstill and the next command of this panel runs it."""
    if state.kind not in ("blocked", "ready", "stopped"):
        return False
    from tui.drive.command_blocked import blocked_reason  # imported late: speeds up the start
    from tui.drive.orders import chart_in_force

    profile, raws = session.profile, session.image.raws
    chart = chart_in_force(profile, raws)
    return chart is not None and blocked_reason(profile, chart, "forward", raws) is None


def value_cell(
    session: DriveSession, readings: Mapping[str, Shown], quantity: str
) -> tuple[str, str]:
    """Text and unit of a quantity; empty if it was not read."""
    parameter = session.profile.quantity(quantity)  # type: ignore[arg-type]
    reading = readings.get(parameter.code) if parameter else None
    if parameter is None or reading is None:
        return "", ""
    from tui.drive.values import NOT_AVAILABLE  # the first picture needs none of it

    # the row, or the bar, shows one age for all its values
    return reading.drawn(
        reading.time,
        current=lambda value: (value.text, value.unit),
        old=lambda value, age: (value.text, value.unit),
        missing=(NOT_AVAILABLE, parameter.unit),
    )
