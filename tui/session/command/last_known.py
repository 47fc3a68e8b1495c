"""Stop words by the last known state of a drive, before anything is read."""

from __future__ import annotations

from tui.drive.channel import command_channel
from tui.drive.orders import OrderRefused, chart_in_force, choose, nearest_stop, stop_in_any
from tui.drive.profile.schema import Chart, Order, OrderId
from tui.safety import SEEN_RUNNING

from ..drive import DriveSession

ENABLED = frozenset({"running", "stopping"})

COMMANDED_BY = "its command source is {source}, not Modbus. Stop it there or at the machine."
COMMANDED_BY_WORD = (
    "its command source is {source} ({code}), not Modbus. Stop it there or at the machine."
)
COMMANDED_LOCALLY = (
    "its terminals or keypad run the motor, not Modbus. Stop it there or at the machine."
)


def last_known_stop(session: DriveSession, order: OrderId) -> tuple[Chart, Order]:
    """Return the words that stop a drive by its last known state. Raises OrderRefused.

    If its motor was just seen running, they are those of its chart. Otherwise they stop it in any
    chart: a word that ramps a motor down in one chart may start one at rest in another.
    """
    profile = session.profile
    if session.state(SEEN_RUNNING).motion in ENABLED:
        raws = session.image.trusted
        if (chart := chart_in_force(profile, raws)) is not None:
            try:
                return chart, choose(chart, nearest_stop(chart, order), raws)
            except OrderRefused:
                pass
    if len(profile.data.charts) == 1:
        # no other chart can be active, so a word without conditions needs no reading
        chart = profile.data.charts[0]
        try:
            return chart, choose(chart, nearest_stop(chart, order), {})
        except OrderRefused:
            pass
    return stop_in_any(profile, {})


def is_likely_to_run(session: DriveSession) -> bool:
    """Return True if the motor was just seen running, or this program has commanded it."""
    return session.commanded or session.state(SEEN_RUNNING).motion in ENABLED


def run_by_others(session: DriveSession) -> str:
    """Describe the source that runs the motor, and where to stop it; empty if it is the line.

    It is the last known one. A drive that obeys its terminals may still obey a stop of the line.
    """
    state = session.state(SEEN_RUNNING)
    if state.motion not in ENABLED:
        return ""
    found = command_channel(session.profile, session.image.trusted)
    if found is not None and found.by_line is False and found.text:
        if found.parameter is None:
            return COMMANDED_BY.format(source=found.text)
        return COMMANDED_BY_WORD.format(source=found.text, code=found.parameter.code)
    return COMMANDED_LOCALLY if state.local else ""
