"""What the drive does, in words: state, faults, alarms, the line; pure functions."""

from __future__ import annotations

from rich.style import Style
from rich.text import Text

from tui.bus.api import LineStatus
from tui.drive.profile.schema import Quantity
from tui.drive.values import NOT_AVAILABLE
from tui.session.command.stop_report import Phase, StopReport
from tui.session.drive_state import DriveState, channel_text
from tui.session.monitor.timeout import TOLD_SHARE
from tui.session.reading import Quality
from tui.widgets.drawing import armed_text, cut, pair, rule
from tui.widgets.drive_signs import STATE_SIGNS, STATE_STYLES, age_text
from tui.widgets.outcome import outcome_lines
from tui.widgets.palette import (
    ALARM,
    ATTENTION,
    FAINT,
    FAULT,
    FAULT_BLOCK,
    LINE,
    PLAIN,
    STALE,
    STRONG,
)

from .view import View

FLASH = 0.5
"""Seconds for which a trip that nobody has seen is bright, and then dark."""
HELD = 0.9
"""Share of the wished rate from which on it counts as held."""


def header(view: View, width: int) -> list[Text]:
    """Which drive, on which line, how busy it is, and the time."""
    name = view.identity.name if view.identity else ""
    reference = view.identity.reference if view.identity else ""
    who = " ".join(part for part in (reference or view.profile.name, name) if part)
    left = f" {who} · device {view.device} · {view.line_label}"
    right = f"load {view.load * 100:3.0f} %  {view.clock} "
    text = Text(no_wrap=True)
    text.append(cut(left, max(0, width - len(right) - 1)), STRONG)
    text.append(" " + right, FAINT)
    return [text]


def state_lines(view: View, width: int) -> list[Text]:
    """What the motor does, in words, and who tells it to."""
    lines = [rule("State", width)]
    snapshot = view.snapshot
    if snapshot is None:
        lines.append(Text(" waiting for the first values", ALARM))
        lines += [Text("")] * 3
        return lines
    state = snapshot.state
    if view.lost:
        lines.append(Text(cut(" ? NOT KNOWN NOW", width), ALARM))
        lines.append(Text(cut(f"   was: {view.was or state.headline}", width), FAINT))
    else:
        style = STATE_STYLES.get(state.kind, STRONG)
        if view.unseen and state.kind == "fault" and int(view.now / FLASH) % 2:
            style = FAULT
        sign = STATE_SIGNS.get(state.kind, "□")
        lines.append(Text(cut(f" {sign} {_headline(state)} ", width), style))
        lines.append(Text(cut(f"   {_detail(state)}", width), PLAIN))
    told = "" if view.lost else state.channel
    command = _who("Command", told, PLAIN, width) if told else None
    lines.append(command or _channel(view, "Command", "command_channel", width))
    lines.append(_channel(view, "Reference", "reference_channel", width))
    return lines


def _headline(state: DriveState) -> str:
    """The headline in capitals; a fault's code as the drive's keypad writes it."""
    words = state.headline.upper()
    return words.replace(state.fault.code.upper(), state.fault.code) if state.fault else words


def _detail(state: DriveState) -> str:
    """What the headline does not say: at reference or not, and the chart's own name."""
    if state.kind == "fault" and state.fault is not None:
        return state.fault.name
    parts = []
    if state.reached is not None and state.kind == "running":
        parts.append("at reference" if state.reached else "on the ramp")
    if not parts and state.name.casefold() not in state.headline.casefold():
        parts.append(state.name)
    return ", ".join(parts)


def _who(label: str, who: str, style: Style, width: int) -> Text:
    """Who gives the command or the reference."""
    room = max(1, width - WHO_AT)
    return pair(f"   {label}", cut(who, min(len(who), room)), style, WHO_AT)


WHO_AT = 13


def _channel(view: View, label: str, quantity: Quantity, width: int) -> Text:
    parameter = view.profile.quantity(quantity)
    if parameter is None:
        return Text("")
    reading = view.reading(parameter.code)
    text = channel_text(parameter, reading)
    if reading is not None and reading.quality is not Quality.GOOD:
        return _who(label, f"was {text}", FAINT, width)
    return _who(label, text or NOT_AVAILABLE, PLAIN if text else FAINT, width)


def message_lines(view: View, width: int) -> list[Text]:
    """Two lines: a fault before all, then what a stop or an order has come to, then the rest."""
    lines, stop, outcome = _messages(view, width - 2), view.stop, view.control.outcome
    fault = view.snapshot is not None and view.snapshot.state.kind == "fault" and not view.lost
    said = [_stop_line(stop, width - 2)] if stop is not None else []
    if outcome is not None and (stop is None or outcome.time > stop.time):
        said = [*outcome_lines(outcome, width - 2), *said]
    first = [lines[0]] if fault and (stop is None or stop.phase is not Phase.FAILED) else []
    lines = [*first, *said, *lines[len(first) :]][:2]
    return [Text(" ") + line if line.plain else line for line in lines]


STOP_STYLES = {
    Phase.SENDING: ATTENTION,
    Phase.STOPPING: ATTENTION,
    Phase.STOPPED: STRONG,
    Phase.FAILED: FAULT_BLOCK,
}


def _stop_line(report: StopReport, width: int) -> Text:
    words = {Phase.FAILED: report.text, Phase.STOPPED: "STOPPED by the stop key"}
    text = words.get(report.phase, f"STOP: {report.text}")
    return Text(cut(text, width), STOP_STYLES[report.phase])


def _messages(view: View, width: int) -> list[Text]:
    if view.line.status is not LineStatus.CONNECTED:
        return _line_trouble(view, width)
    snapshot = view.snapshot
    if snapshot is None:
        return [Text("connecting to the drive", FAINT), Text("")]
    if view.trouble:
        return [
            Text(cut("NO VALUES: what is shown is old" + _countdown(view), width), ALARM),
            Text(cut(view.trouble, width), STALE),
        ]
    state = snapshot.state
    if state.fault is not None:
        fault = state.fault
        cause = fault.cause or "The profile gives no cause; see the drive's manual."
        remedy = f" Do: {fault.remedy}" if fault.remedy else ""
        more = "   5: what happened before" if view.unseen else ""
        return [
            Text(cut(f"FAULT {fault.code} ({fault.raw}) {fault.name}{more}", width), FAULT),
            Text(cut(cause + remedy, width), PLAIN),
        ]
    if _is_hungry(view):
        return [
            _alarm_line(view, state, width),
            Text(cut(f"NOT HEARD{_countdown(view)}", width), ALARM),
        ]
    alarm, control = _alarm_line(view, state, width), view.control
    for said, style in (
        (control.offer, ATTENTION),
        (control.lost, ALARM),
        (control.why_disarmed, ATTENTION),
        (control.no_effect and f"Orders from here have no effect: {control.no_effect}", FAINT),
    ):
        if said:
            return [alarm, Text(cut(said, width), style)]
    return [alarm, _last_fault(view, width)]


def _alarm_line(view: View, state: DriveState, width: int) -> Text:
    if state.kind == "fault":
        return Text(cut("FAULT, code not read", width), FAULT)
    if state.alarms:
        names = ", ".join(bit.name for bit in state.alarms)
        return Text(cut(f"ALARM {names}", width), ALARM)
    if state.alarm:
        return Text(cut("ALARM shown by the status word", width), ALARM)
    return Text("no fault · no alarm", FAINT)


def _last_fault(view: View, width: int) -> Text:
    faults = view.profile.data.faults
    reading = view.reading(faults.parameter) if faults.parameter else None
    if reading is None or reading.raw in (None, faults.none):
        return Text("")
    known = view.profile.fault(reading.raw or 0)
    name = f"{known.code} {known.name}" if known else f"code {reading.raw}"
    return Text(cut(f"last fault: {name}", width), FAINT)


def _line_trouble(view: View, width: int) -> list[Text]:
    line = view.line
    since = age_text(max(0.0, view.now - line.since))
    if line.status is LineStatus.CONNECTING:
        head = Text(cut(f"CONNECTING for {since}", width), ALARM)
    else:
        again = ""
        if line.next_try is not None:
            again = f", trying again in {max(0.0, line.next_try - view.now):.0f} s"
        word = "LINE LOST" if line.status is LineStatus.LOST else "LINE CLOSED"
        head = Text(cut(f"{word} for {since}{again}{_countdown(view)}", width), ALARM)
    return [head, Text(cut(line.reason, width), STALE)]


def _is_hungry(view: View) -> bool:
    """Whether the drive was not asked for a good part of its time-out."""
    left = view.time_left
    return (
        left is not None and view.watch is not None and left < (1 - TOLD_SHARE) * view.watch.timeout
    )


def _countdown(view: View) -> str:
    """What a drive that is not asked does, and when; nothing where it does nothing."""
    left = view.time_left
    if left is None or view.watch is None:
        return ""
    does = view.watch.reaction.name.lower() if view.watch.reaction else "its own reaction"
    when = f"drive acts in {left:.0f} s" if left > 0 else "drive has acted by now"
    return f" · {when}: {does}"


def panel_lines(view: View, width: int) -> list[Text]:
    """What the panel itself does: monitoring, how fast, how well the line answers."""
    text = Text(no_wrap=True)
    text.append_text(armed_text(view.control.armed_for, lost=view.lost))
    rate = view.snapshot.rate if view.snapshot and not view.lost else 0.0
    wished = 1 / view.period
    counts = view.counters
    bad = counts.timeouts + counts.checksum + counts.wrong
    held = rate > HELD * wished or not rate
    text.append(f"  {rate:4.1f} of {wished:.1f} cycles/s", FAINT if held else ALARM)
    if view.snapshot is not None and view.snapshot.block:
        text.append(f" by {view.snapshot.block.lower()}", FAINT)
    if view.watch is not None and view.watch.active:
        text.append(f"  watch {view.watch.timeout:g} s", FAINT)
        if _is_hungry(view):
            text.append(f", {max(0.0, view.time_left or 0.0):.0f} s left", ALARM)
    if view.read_only:
        text.append("  read-only", FAINT)
    said = (f"  {counts.requests} requests, {bad} failed", f"  {bad} failed", "")
    text.append(next(one for one in said if not one or text.cell_len + len(one) <= width), FAINT)
    text.truncate(width)
    return [text]


def history_lines(view: View, width: int, height: int) -> list[Text]:
    """The drive's fault history, the newest first."""
    lines = [rule("Fault history", width)]
    for number, code in enumerate(view.profile.data.faults.history, start=1):
        reading = view.reading(code)
        text = Text(no_wrap=True)
        text.append(f" {number} ", LINE)
        text.append(cut(code, 6), FAINT)
        if reading is None or reading.raw is None:
            text.append(NOT_AVAILABLE, FAINT)
        else:
            fault = view.profile.fault(reading.raw)
            name = f"{fault.code} {fault.name}" if fault else f"code {reading.raw}"
            text.append(cut(name, max(0, width - 9)), PLAIN)
        lines.append(text)
    if len(lines) == 1:
        lines.append(Text(" not known on this drive", FAINT))
    return lines[:height]


def line_lines(view: View, width: int, height: int) -> list[Text]:
    """The counters of the line."""
    c = view.counters
    rows = (
        ("Requests", str(c.requests)),
        ("Replies", str(c.replies)),
        ("No answer", str(c.timeouts)),
        ("Damaged", str(c.checksum)),
        ("Wrong", str(c.wrong)),
        ("Refused", str(c.exceptions)),
        ("Thrown away", str(c.stale)),
        ("Bytes out, in", f"{c.bytes_out} {c.bytes_in}"),
    )
    lines = [rule("Line", width)]
    return (lines + [pair(f" {label}", value, PLAIN, 16) for label, value in rows])[:height]
