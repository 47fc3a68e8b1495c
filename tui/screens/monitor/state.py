"""State block at the right, with the drive's state, commander and timeout; pure functions."""

from __future__ import annotations

import math

from rich.style import Style
from rich.text import Text

from tui.bus.api import DeviceCounters, LineStatus
from tui.drive.profile.schema import Quantity
from tui.drive.sentences import uncapitalized
from tui.drive.values import NOT_AVAILABLE
from tui.safety import WARNED_AT_SHARE
from tui.session.command.stop_report import NOT_STOPPED, NOT_STOPPING, Phase, StopReport
from tui.session.drive_state import DriveState, channel_text
from tui.session.monitor.line_health import LEAST_REPLIES, POOR
from tui.widgets.drawing import short, wrapped
from tui.widgets.palette import (
    ALARM,
    ATTENTION,
    FAINT,
    FAULT_BLOCK,
    KEY,
    PLAIN,
    RUNNING,
    STALE,
    STRONG,
    age_text,
)

from .view import View, directed

STATE_LABEL_CELLS = 8
MORE_ROWS = 3
"""Most rows of details on a state; the row of answers stays."""
STANDSTILL = 0.05
"""Frequency in Hz below which a value counts as 0."""
HEADS = {
    Phase.SENDING: ("STOP WAITS", ATTENTION),
    Phase.UNHEEDED: (" NOT STOPPED ", FAULT_BLOCK),
    Phase.STOPPING: ("STOPPING", ATTENTION),
    Phase.STOPPED: ("STOPPED", STRONG),
    Phase.FAILED: (" NOT STOPPED ", FAULT_BLOCK),
}
SWAPPED = "in each word: check the byte order of the gateway or converter"
KEY_TO_DIAGNOSE = "press N"
"""Shown if there is room for it."""


def state_lines(view: View, width: int) -> list[Text]:
    """Return five rows: state, command source, reference source, timeout and answers.

    Details on a state replace the rows after it. An active timeout shows the time since the last
    answer.
    """
    head, more = _head(view, width)
    rows = [
        _channel(view, "Command", "command_channel", width),
        _channel(view, "Reference", "reference_channel", width),
        _pair("Timeout", *_timeout(view, width), width),
        _answers(view, width),
    ]
    lines = [head, *more[:MORE_ROWS], *rows[len(more[:MORE_ROWS]) :]]
    for line in lines:
        line.no_wrap = True
        line.truncate(width)
    return lines


def _head(view: View, width: int) -> tuple[Text, list[Text]]:
    """Return the state in words, and its details in further rows."""
    snapshot = view.snapshot
    if view.stop is not None and view.stop.phase in NOT_STOPPING:
        return _stop(view.stop, width)
    if view.line.status is not LineStatus.CONNECTED and snapshot is not None:
        lost = "LINE LOST" if view.line.status is LineStatus.LOST else "LINE NOT OPEN"
        return _lost(view, lost, width)
    if snapshot is None:
        waits = "waiting for values" if view.line.status is LineStatus.CONNECTED else "connecting"
        return Text(waits, ALARM), []
    if snapshot.contact == "swapped":
        return Text("BYTES SWAPPED", ALARM), [
            Text(line, PLAIN) for line in wrapped(SWAPPED, width, MORE_ROWS)
        ]
    if view.lost:
        return _lost(view, "NO ANSWER", width)
    if view.stop is not None and snapshot.state.kind != "fault":
        return _stop(view.stop, width)
    return _present(view, snapshot.state, width)


def _stop(report: StopReport, width: int) -> tuple[Text, list[Text]]:
    words, style = HEADS[report.phase]
    text = report.text.removeprefix(NOT_STOPPED)
    if report.phase is Phase.STOPPED:
        words = "NO CURRENT" if report.may_coast else words
        text = "The motor may still coast." if report.may_coast else "by the stop key"
    most = MORE_ROWS if report.phase in NOT_STOPPING else 2
    return Text(words, style), [Text(line, PLAIN) for line in wrapped(text, width, most)]


def _lost(view: View, words: str, width: int) -> tuple[Text, list[Text]]:
    """Return an unknown state: for how long, the last known state, and the drive's reaction."""
    age = age_text(view.age or 0.0)
    was = view.was or (view.snapshot.state.headline if view.snapshot else "")
    known = f"STATE UNKNOWN for {age}"
    reported = f"{known}, {KEY_TO_DIAGNOSE}"
    lines = [Text(short(reported if len(reported) <= width else known, width), ALARM)]
    reaction = [Text(line, ALARM) for line in wrapped(countdown(view), width, MORE_ROWS - 1)]
    if len(lines) + len(reaction) < MORE_ROWS:
        lines.append(Text(short(f"was {was}" if was else "", width), FAINT))
    lines += reaction
    return Text(f" {words} ", FAULT_BLOCK), lines


def _present(view: View, state: DriveState, width: int) -> tuple[Text, list[Text]]:
    if state.kind == "fault":
        return _fault(view, state, width)
    if state.kind == "unknown":
        return Text("? unknown state", ALARM), []
    if state.kind == "running":
        return Text(_running(view, state), RUNNING), []
    if state.kind == "stopping" and _hertz(view, "output_frequency") == 0:
        return Text("stopped", STRONG), [Text(short(state.name, width), FAINT)]
    hindrance = view.control.hindrance
    if view.stands_by and hindrance is None:
        if view.replayed:
            return Text("standby", STRONG), []
        if why := "read-only: no commands" if view.read_only else view.control.barred:
            return Text("standby", STRONG), [Text(line, FAINT) for line in wrapped(why, width, 2)]
        armed = view.control.armed_for is not None
        return Text("press r to run" if armed else "press a, then r", STRONG), []
    if hindrance is None:
        return Text(state.headline, STRONG), []
    if hindrance.by_channel:
        return Text("not commanded", STRONG), []
    return Text("not ready", STRONG), [
        Text(line, PLAIN) for line in wrapped(hindrance.text, width, 2)
    ]


def _running(view: View, state: DriveState) -> str:
    """Return how a running motor follows its reference: reached, on the ramp, or reversing."""
    output, wanted = (_hertz(view, q) for q in ("output_frequency", "frequency_reference"))
    if state.reached and wanted is not None and abs(wanted) < STANDSTILL:
        return "enabled, at 0 Hz"
    if state.reached:
        return "at reference"
    if output is None or wanted is None:
        return "on the ramp" if state.reached is False else "running"
    if output * wanted < 0:
        return "reversing"
    if abs(abs(wanted) - abs(output)) < STANDSTILL:
        return "at reference"
    return "accelerating" if abs(wanted) > abs(output) else "decelerating"


def _hertz(view: View, quantity: Quantity) -> float | None:
    parameter = view.profile.quantity(quantity)
    reading = view.reading(parameter.code) if parameter else None
    return directed(view, parameter, reading.current_number if reading else None)


def _fault(view: View, state: DriveState, width: int) -> tuple[Text, list[Text]]:
    """Return the fault's code, name and time, and the key that shows its remedy."""
    fault = state.fault
    code = fault.code if fault else "code not read"
    lines = [Text(short(fault.name if fault else "", width), STRONG), Text(view.fault_at, FAINT)]
    advice = Text("press 5 for what to do", PLAIN)
    advice.highlight_words(["5"], KEY)
    lines.append(advice)
    return Text(f" FAULT {code} ", FAULT_BLOCK), lines


def _pair(label: str, text: str, style: Style, width: int) -> Text:
    """Return a row with a label at the left and its text at the right."""
    text = short(text, max(1, width - len(label) - 1))
    return Text(f"{label:<{width - len(text)}}", FAINT, no_wrap=True).append(text, style)


def _channel(view: View, label: str, quantity: Quantity, width: int) -> Text:
    """Return the row with the source of the command or the reference."""
    state = view.snapshot.state if view.snapshot and not view.lost else None
    reported = (
        ""
        if state is None
        else state.channel
        if quantity == "command_channel"
        else (state.reference)
    )
    if reported:
        return _pair(label, reported, PLAIN, width)
    parameter = view.profile.quantity(quantity)
    if parameter is None:
        return _pair(label, NOT_AVAILABLE, FAINT, width)
    reading = view.reading(parameter.code)
    none = (NOT_AVAILABLE, FAINT)
    if reading is None:
        return _pair(label, *none, width)
    drawn = reading.drawn(
        view.now,
        current=lambda value: (channel_text(parameter, value) or NOT_AVAILABLE, PLAIN),
        old=lambda value, age: (f"was {channel_text(parameter, value)}", FAINT),
        missing=none,
    )
    return _pair(label, *drawn, width)


def _timeout(view: View, width: int) -> tuple[str, Style]:
    """Return the drive's timeout with the age of its last answer, or with its state."""
    watch = view.watch
    if watch is None:
        return "none known", FAINT
    text = f"{watch.timeout:g} s"
    if watch.active:
        return _polled(view, text, watch.timeout, width - STATE_LABEL_CELLS)
    if not watch.acts:
        return "off", FAINT
    whole = f"{text}, starts when commanded"
    fits = width >= STATE_LABEL_CELLS + len(whole)
    return whole if fits else f"{text}, at run", FAINT


def _polled(view: View, text: str, timeout: float, cells: int) -> tuple[str, Style]:
    """Return a timeout with the age of the last answer in whole seconds, so it changes rarely.

    If `cells` are too few for the age, the text has the seconds until the timeout.
    """
    if view.heard is None:
        return text, PLAIN
    age = max(0.0, view.now - view.heard)
    hungry = age > WARNED_AT_SHARE * timeout
    style = STALE if hungry or view.lost else PLAIN
    polled = "<1 s" if age < 1 else f"{age:.0f} s" if age < 100 else age_text(age)
    whole = f"{text}, polled {polled} ago"
    if len(whole) <= cells:
        return whole, style
    left = math.floor(timeout - age)
    briefly = "polled now" if age < 1 else f"{left} s left" if left > 0 else "expired"
    return f"{text}, {briefly}", style


def _answers(view: View, width: int) -> Text:
    """Return the row with this drive's good answers to requests of the last 60 s.

    They are those to every program on the line. Requests that it did not answer count too.
    On a low-bandwidth link the row has their share, as the numbers change in each refresh.
    """
    drive = view.counters.devices.get(view.device, DeviceCounters()).minute
    share, requests = drive.whole_share, drive.replies + drive.silent
    text = f"{drive.good}/{requests} in 60 s"
    if view.lean and share is not None:
        text = f"{math.floor(100 * share)} % in 60 s"
    label = "Drive answers" if len(f"Drive answers {text:<15}") <= width else "Answers"
    if share is None:
        return _pair(label, NOT_AVAILABLE, FAINT, width)
    poor = share < POOR and (requests >= LEAST_REPLIES or view.lost)
    return _pair(label, text, ALARM if poor else PLAIN, width)


def countdown(view: View) -> str:
    """Return the reaction expected of the drive when polling stops, or the seconds left for it.

    Empty without an active timeout. No reply confirms a reaction, so it is never stated as a fact.
    """
    left = view.time_left
    if left is None or view.watch is None:
        return ""
    reaction = view.watch.reaction
    does = uncapitalized(reaction.name) if reaction else "its own reaction"
    if left > 0:
        return f"reacts in {left:.0f} s: {does}"
    if reaction is None:
        return "should have reacted"
    if reaction.motor_keeps_running:
        return f"MAY STILL RUN: {does}"
    return f"should have reacted: {does}"
