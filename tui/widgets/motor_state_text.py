"""State of a motor in one line: for questions that are asked while it turns."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rich.text import Text

from tui.bus.api import LineStatus
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.drive.values import NOT_AVAILABLE
from tui.session.drive_state import DriveState
from tui.session.monitor.line_watch import GLANCE
from tui.session.monitor.look import Look
from tui.session.monitor.snapshot import Snapshot, stale_after
from tui.session.shown import Shown

from .palette import ALARM, FAINT, PLAIN, STALE, STATE_SIGNS, STATE_STYLES, STRONG, age_text

QUANTITIES_NOW: tuple[Quantity, ...] = ("output_frequency", "motor_current")
"""Quantities shown beside the state."""
NUMBER_WIDTH = 7
HEADLINE_WIDTH = 18
"""Columns of the state's words, so that the numbers after them do not move."""


StateWords = Callable[[DriveState, Mapping[str, Shown]], tuple[str, str]]
"""Returns the kind of a state and its words, from the state and the values read with it."""


def motor_state_text(
    profile: Profile,
    snapshot: Snapshot | None,
    period: float,
    look: Look | None,
    now: float,
    words: StateWords,
) -> Text:
    """State, frequency and current of the last cycle, or the state that the line watch read.

    `period` is the intended time of a cycle in seconds, `now` is monotonic. A state older than
    three cycles, or with an error, is shown as unknown, with its age.
    """
    if snapshot is None or (look is not None and look.time > snapshot.time):
        return _by_look(profile, look, now, words)
    age = max(0.0, now - snapshot.read_at)
    cycle = max(period, 1 / snapshot.rate if snapshot.rate else period)
    heard = not snapshot.error and snapshot.line.status is LineStatus.CONNECTED
    if not heard or age > stale_after(cycle) or snapshot.state.kind == "unknown":
        return _not_known(words(snapshot.state, snapshot.readings)[1], age)
    return _known(profile, *words(snapshot.state, snapshot.readings), snapshot.readings, now)


def _known(
    profile: Profile, kind: str, headline: str, readings: Mapping[str, Shown], now: float
) -> Text:
    """Return a state, and the values that were read with it."""
    text = _state(kind, headline)
    for quantity in QUANTITIES_NOW:
        parameter = profile.quantity(quantity)
        reading = readings.get(parameter.code) if parameter else None
        if parameter is None or reading is None:
            continue
        none = (NOT_AVAILABLE, parameter.unit, STALE)
        number, unit, style = reading.drawn(
            now,
            current=lambda value: (value.text, value.unit, STRONG),
            old=lambda value, age: (value.text, value.unit, STALE),
            missing=none,
        )
        text.append(f"{number:>{NUMBER_WIDTH}}", style)
        text.append(f" {unit or 'raw'} ", FAINT)
    text.rstrip()
    return text


def _by_look(profile: Profile, look: Look | None, now: float, words: StateWords) -> Text:
    """Return the state from the line watch, with the values that it read."""
    read = look.before if look is not None and look.error else look
    if look is None or read is None or read.state is None:
        return _not_known("", None)
    age = max(0.0, now - read.time)
    if look.error or age > stale_after(GLANCE) or read.state.kind == "unknown":
        return _not_known(words(read.state, read.readings)[1], age)
    return _known(profile, *words(read.state, read.readings), read.readings, now)


def _state(kind: str, headline: str) -> Text:
    style = PLAIN if kind == "fault" else STATE_STYLES.get(kind, PLAIN)
    sign = STATE_SIGNS.get(kind, "□")
    text = Text(no_wrap=True)
    text.append(f"{sign} {headline:<{HEADLINE_WIDTH}}", STATE_STYLES.get(kind, style))
    return text


def _not_known(was: str, age: float | None) -> Text:
    text = Text(no_wrap=True).append("? state unknown", ALARM)
    if was and age is not None:
        text.append(f"   {age_text(age)} ago: {was}", STALE)
    return text
