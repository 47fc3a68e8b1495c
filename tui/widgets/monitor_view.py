"""What the Monitor screen says: pure functions from one snapshot to lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.style import Style
from rich.text import Text

from tui.bus.line import Counters, LineState, LineStatus
from tui.drive.profile import Profile, is_verified
from tui.drive.schema import Bit, MonitoringValue, Parameter, Quantity
from tui.drive.values import NOT_AVAILABLE, is_enumeration
from tui.session.drive_state import DriveState, channel_text
from tui.session.identify import DriveIdentity
from tui.session.monitor import SLOW_FACTOR, STALE_CYCLES, Snapshot, TrendPoint
from tui.session.readings import Quality, Reading

from .drawing import aligned, bar, cut, pair, rule, trend
from .palette import (
    ALARM,
    FAINT,
    FAULT,
    FAULT_BLOCK,
    LINE,
    PLAIN,
    RUNNING,
    STALE,
    STRONG,
)

LABELS: dict[Quantity, str] = {
    "output_frequency": "Output",
    "frequency_reference": "Reference",
    "ramp_output": "After ramp",
    "speed": "Speed",
    "motor_current": "Current",
    "motor_voltage": "Motor voltage",
    "mains_voltage": "Mains",
    "dc_bus": "DC bus",
    "torque": "Torque",
    "power": "Power",
    "input_power": "Input power",
    "drive_thermal": "Drive thermal",
    "motor_thermal": "Motor thermal",
    "motor_load": "Motor load",
    "drive_load": "Drive load",
    "energy": "Energy",
    "run_hours": "Run time",
    "power_on_hours": "Power-on time",
}
LABEL_WIDTH = 14
WHOLE, DECIMALS, UNIT_WIDTH = 6, 2, 5
NUMBER_WIDTH = WHOLE + DECIMALS + 1
TREND_SPAN = 60.0
STATE_STYLES: dict[str, Style] = {
    "running": RUNNING,
    "fault": FAULT_BLOCK,
    "unknown": ALARM,
    "stopping": PLAIN,
}
STATE_SIGNS = {"running": "▶", "fault": "■", "unknown": "?"}


@dataclass(frozen=True, slots=True)
class View:
    """All that the Monitor screen shows at one moment; times are monotonic, in seconds."""

    profile: Profile
    identity: DriveIdentity | None
    device: int
    line_label: str
    snapshot: Snapshot | None
    line: LineState
    counters: Counters
    load: float
    trend: tuple[TrendPoint, ...]
    period: float
    now: float
    clock: str
    read_only: bool = False
    was: str = ""
    """What the drive did when it was last known."""

    def reading(self, code: str) -> Reading | None:
        """A reading as good as it is now, not as it was when it came."""
        if self.snapshot is None or (reading := self.snapshot.readings.get(code)) is None:
            return None
        rate = self.snapshot.rate
        cycle = max(self.period, 1 / rate if rate else self.period)
        often = self.lost or not (self.slow(code) or self.rare(code))
        return reading.aged(self.now, STALE_CYCLES * cycle * (1 if often else SLOW_FACTOR))

    def slow(self, code: str) -> bool:
        """Whether the value is one of the slow ones of the monitoring set."""
        return any(v.parameter == code and v.rate == "slow" for v in self.values)

    def rare(self, code: str) -> bool:
        """Whether the value is one of those read seldom beside the monitoring set."""
        return code not in {value.parameter for value in self.values}

    @property
    def values(self) -> list[MonitoringValue]:
        """The monitoring set."""
        return self.profile.data.monitoring.values

    @property
    def lost(self) -> bool:
        """Whether nothing on the screen is known to be current."""
        return self.line.status is not LineStatus.CONNECTED or (
            self.snapshot is not None and bool(self.snapshot.error)
        )


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
        sign = STATE_SIGNS.get(state.kind, "□")
        lines.append(Text(cut(f" {sign} {_headline(state)} ", width), style))
        lines.append(Text(cut(f"   {_detail(state)}", width), PLAIN))
    told = "" if view.lost else state.channel
    command = pair("   Command", told, PLAIN, 14) if told else None
    lines.append(command or _channel(view, "Command", "command_channel"))
    lines.append(_channel(view, "Reference", "reference_channel"))
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


def _channel(view: View, label: str, quantity: Quantity) -> Text:
    parameter = view.profile.quantity(quantity)
    if parameter is None:
        return Text("")
    reading = view.reading(parameter.code)
    text = channel_text(parameter, reading)
    if reading is not None and reading.quality is not Quality.GOOD:
        return pair(f"   {label}", f"was {text}", FAINT, 14)
    return pair(f"   {label}", text or NOT_AVAILABLE, PLAIN if text else FAINT, 14)


def motor_lines(view: View, width: int, height: int) -> list[Text]:
    """The values of the monitoring set as numbers and bars, in the profile's order."""
    lines = [rule("Motor", width, "ends of the bars are the drive's" if width > 60 else "")]
    shown = [v for v in view.values if _is_measurement(view.profile, v)]
    barred = any(value.high for value in shown)
    label = LABEL_WIDTH if barred else max(LABEL_WIDTH, width - NUMBER_WIDTH - UNIT_WIDTH - 3)
    lines += [_measurement(view, value, width, min(label, 40)) for value in shown]
    return lines[:height]


def _is_measurement(profile: Profile, value: MonitoringValue) -> bool:
    parameter = profile[value.parameter]
    if parameter.quantity in LABELS:
        return True
    if parameter.bits or is_enumeration(parameter) or parameter.quantity is not None:
        return False
    return parameter.code != profile.data.faults.parameter and bool(
        parameter.unit or not is_verified(parameter)
    )


def _measurement(view: View, value: MonitoringValue, width: int, label_width: int) -> Text:
    parameter = view.profile[value.parameter]
    reading = view.reading(value.parameter)
    text = Text(no_wrap=True)
    mark = "" if is_verified(parameter) else " ?"
    label = LABELS.get(parameter.quantity) if parameter.quantity else None
    name = label or f"{parameter.code} {parameter.name}"
    short = cut(name, min(len(name), label_width - len(mark)))
    text.append(f" {short + mark:<{label_width}}", FAINT)
    _append_value(text, parameter, reading, view.now)
    rest = width - text.cell_len - 1
    if rest >= 8:
        text.append(" ")
        text.append_text(_bar(view, value, parameter, reading, rest))
    return text


def _append_value(text: Text, parameter: Parameter, reading: Reading | None, now: float) -> None:
    if reading is None or reading.raw is None:
        text.append(
            f"{NOT_AVAILABLE:>{NUMBER_WIDTH}} {cut(parameter.unit or 'raw', UNIT_WIDTH)}", FAINT
        )
        return
    shown, unit = reading.text, reading.unit or "raw"
    if reading.physical is not None:
        shown, unit = reading.physical.text, reading.physical.unit
    if reading.quality is Quality.GOOD:
        text.append(aligned(shown, WHOLE, DECIMALS), STRONG)
        text.append(f" {cut(unit, UNIT_WIDTH)}", FAINT)
    else:
        text.append(aligned(shown, WHOLE, DECIMALS), STALE)
        text.append(f" {cut(age_text(reading.age(now)), UNIT_WIDTH)}", STALE)


def age_text(seconds: float) -> str:
    """An age in at most five characters."""
    if seconds < 100:
        return f"{seconds:.0f}s"
    if seconds < 6000:
        return f"{seconds / 60:.0f}m"
    return f"{seconds / 3600:.0f}h"


def _bar(
    view: View,
    value: MonitoringValue,
    parameter: Parameter,
    reading: Reading | None,
    width: int,
) -> Text:
    high = end_of(view, value.high)
    low = end_of(view, value.low) or 0.0
    if high is None or high <= low:
        return Text("")
    fresh = reading is not None and reading.quality is Quality.GOOD
    number = reading.number if reading is not None and fresh else None
    mark = None
    if parameter.quantity == "output_frequency":
        reference = view.profile.quantity("frequency_reference")
        target = view.reading(reference.code) if reference else None
        if target and target.quality is Quality.GOOD and target.number is not None:
            mark = abs(target.number)
        number = abs(number) if number is not None else None
    ends = f" {high:g}"
    drawn = bar(number, low, high, max(4, width - 6), mark)
    drawn.append(cut(ends, 6), LINE)
    return drawn


def end_of(view: View, end: str) -> float | None:
    """The end of a bar: a number, or the value of a parameter of the drive."""
    if not end:
        return None
    try:
        return float(end)
    except ValueError:
        reading = view.snapshot.readings.get(end) if view.snapshot else None
        return reading.number if reading is not None else None


@dataclass(frozen=True, slots=True)
class WordPage:
    """Bits of a word that are shown together."""

    parameter: Parameter
    bits: tuple[Bit, ...]
    number: int
    of: int


def word_pages(words: Sequence[Parameter], room: int) -> list[WordPage]:
    """The words in pages of at most so many bits."""
    pages: list[WordPage] = []
    for parameter in words:
        bits = parameter.bits
        chunks = [tuple(bits[at : at + room]) for at in range(0, len(bits), max(1, room))]
        pages += [WordPage(parameter, c, n, len(chunks)) for n, c in enumerate(chunks, start=1)]
    return pages


def word_lines(view: View, page: WordPage, width: int) -> list[Text]:
    """Named bits of a word, each at its place, with the word itself."""
    parameter = page.parameter
    reading = view.reading(parameter.code)
    good = reading is not None and reading.raw is not None and reading.quality is Quality.GOOD
    raw = reading.raw if good and reading is not None else None
    heading = parameter.code + ("" if is_verified(parameter) else " ?")
    if page.of > 1:
        heading += f" {page.number}/{page.of}"
    shown = reading.text if reading is not None and raw is not None else NOT_AVAILABLE
    lines = [rule(heading, width, shown)]
    return lines + [_bit_line(bit, raw, width) for bit in page.bits]


def _bit_line(bit: Bit, raw: int | None, width: int) -> Text:
    text = Text(no_wrap=True)
    text.append(f" {bit.bit:>2} ", LINE)
    room = width - 7
    if raw is None:
        text.append(f"  {cut(bit.name, room)}", FAINT)
        return text
    on = bool(raw >> bit.bit & 1)
    text.append("●" if on else "·", ALARM if on and bit.alarm else STRONG if on else FAINT)
    text.append(f" {cut(_bit_words(bit, on, room), room)}", PLAIN if on else FAINT)
    return text


SHORTEST_NAME = 6
"""Characters of a bit's name that still tell which one it is."""
PLAIN_ANSWERS = frozenset({"", "yes", "no", "on", "off", "none", "normal", "0", "1"})


def _bit_words(bit: Bit, on: bool, room: int) -> str:
    """The name of a bit; what it says as well, where that is more than yes or no and fits."""
    said = bit.on if on else bit.off
    if said.lower() in PLAIN_ANSWERS:
        return bit.name
    if said.casefold() in bit.name.casefold():
        return bit.name
    both = f"{bit.name}: {said}"
    if len(both) <= room:
        return both
    left = room - len(said) - 3
    if " " in said or left < SHORTEST_NAME:
        return said[:1].upper() + said[1:]
    return f"{bit.name[:left].rstrip()}…: {said}"


def stacked_trends(view: View, width: int, height: int) -> list[Text]:
    """Frequency above current, the last minute of each; newest at the right."""
    upper = height // 2
    return [
        *_trend(view, 0, "output_frequency", "Frequency", width, upper),
        *_trend(view, 1, "motor_current", "Current", width, height - upper),
    ]


def trend_lines(view: View, width: int, height: int) -> list[Text]:
    """Frequency and current of the last minute, side by side; newest at the right."""
    half = (width - 2) // 2
    left = _trend(view, 0, "output_frequency", "Frequency", half, height)
    right = _trend(view, 1, "motor_current", "Current", width - 2 - half, height)
    joined: list[Text] = []
    for one, other in zip(left, right, strict=True):
        line = one.copy()
        line.append("  ")
        line.append_text(other)
        joined.append(line)
    return joined


def _trend(
    view: View, index: int, quantity: Quantity, title: str, width: int, height: int
) -> list[Text]:
    parameter = view.profile.quantity(quantity)
    if parameter is None:
        nothing = Text(cut(" not known", width), FAINT)
        return [rule(title, width), nothing, *[Text(" " * width)] * (height - 2)]
    high = _trend_high(view, parameter, index)
    columns = width - 1
    step = TREND_SPAN / columns
    rows = trend(_columns(view, index, columns, step), high or 1.0, columns, height - 1)
    span = f"0..{high:g} {parameter.unit}" if high else "no values yet"
    lines = [rule(title, width, span + (", 60 s" if width > 30 else ""))]
    return lines + [Text.assemble(("│", LINE), row) for row in rows]


def _trend_high(view: View, parameter: Parameter, index: int) -> float | None:
    """The top of a trend: the end of the value's bar, else a round number above the highest.

    None while neither is known.
    """
    for value in view.values:
        if value.parameter == parameter.code and (end := end_of(view, value.high)):
            return end
    seen = [abs(v) for p in view.trend if (v := p.values[index]) is not None]
    if not seen:
        return None
    return next((top for top in ROUND_TOPS if top >= max(seen)), max(seen))


ROUND_TOPS: Sequence[float] = (1, 2, 5, 10, 20, 50, 60, 100, 200, 500, 1000, 2000, 5000, 10000)


def _columns(view: View, index: int, count: int, step: float) -> list[float | None]:
    """The last value of each column; columns stand on whole steps, so they shift as one."""
    last = int(view.now / step)
    columns: list[float | None] = [None] * count
    for point in view.trend:
        at = count - 1 - (last - int(point.time / step))
        if 0 <= at < count and point.values[index] is not None:
            columns[at] = point.values[index]
    return _bridged(columns, step, view)


def _bridged(columns: list[float | None], step: float, view: View) -> list[float | None]:
    """Columns narrower than a cycle take the value before them, as far as three cycles."""
    reach = max(1, round(STALE_CYCLES * view.period / step))
    filled = list(columns)
    for at, value in enumerate(columns):
        if value is None:
            before = [v for v in columns[max(0, at - reach) : at] if v is not None]
            filled[at] = before[-1] if before else None
    return filled


def message_lines(view: View, width: int) -> list[Text]:
    """Two lines: what is wrong, or that nothing is."""
    return [Text(" ") + line if line.plain else line for line in _messages(view, width - 2)]


def _messages(view: View, width: int) -> list[Text]:
    if view.line.status is not LineStatus.CONNECTED:
        return _line_trouble(view, width)
    snapshot = view.snapshot
    if snapshot is None:
        return [Text("connecting to the drive", FAINT), Text("")]
    if snapshot.error:
        return [
            Text(cut("NO VALUES: what is shown is old", width), ALARM),
            Text(cut(snapshot.error, width), STALE),
        ]
    state = snapshot.state
    if state.fault is not None:
        fault = state.fault
        cause = fault.cause or "The profile gives no cause; see the drive's manual."
        remedy = f" Do: {fault.remedy}" if fault.remedy else ""
        return [
            Text(cut(f"FAULT {fault.code} ({fault.raw}) {fault.name}", width), FAULT),
            Text(cut(cause + remedy, width), PLAIN),
        ]
    return [_alarm_line(view, state, width), _last_fault(view, width)]


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
        head = Text(cut(f"{word} for {since}{again}", width), ALARM)
    return [head, Text(cut(line.reason, width), STALE)]


def status_lines(view: View, width: int) -> list[Text]:
    """What the panel itself does: monitoring, how fast, how well the line answers."""
    text = Text(no_wrap=True)
    text.append(" MONITORING", STRONG if not view.lost else ALARM)
    rate = view.snapshot.rate if view.snapshot else 0.0
    counts = view.counters
    bad = counts.timeouts + counts.checksum + counts.wrong
    text.append(f"  {rate:4.1f} of {1 / view.period:.1f} cycles/s", FAINT)
    text.append(f"  {counts.requests} requests, {bad} without a good answer", FAINT)
    if view.read_only:
        text.append("  read-only", FAINT)
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
