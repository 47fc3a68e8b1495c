"""Run line, which runs a motor or sets its reference: its contents, checks and rows."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from typing import Literal

from rich.style import Style
from rich.text import Text

from tui.drive.errors import ValueRefused
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.drive.shown import number_of
from tui.safety import ENTER_COUNTS_AFTER
from tui.session.command.reference import (
    parse_reference,
    reference_limits,
    reference_parameters,
    step_in,
)
from tui.session.shown import Shown
from tui.widgets.drawing import wrapped
from tui.widgets.palette import (
    ALARM,
    ATTENTION,
    FAINT,
    KEY,
    PLAIN,
    STOP_KEY,
    STRONG,
    SURFACE,
)

Purpose = Literal["forward", "reverse", "reference"]

STEPS: Mapping[str, Decimal] = {
    "up": Decimal(1),
    "down": Decimal(-1),
    "pageup": Decimal(5),
    "pagedown": Decimal(-5),
}
"""Steps of a reference by key: in its unit, or in tens of rpm."""
DIGITS_MOST = 7
NOTHING_TYPED = "Type a reference, then Enter."
AT_ZERO = f"The reference is 0. {NOTHING_TYPED}"
GROUND_OF_LINE = Style(bgcolor=SURFACE)
BEFORE_RAMP: Mapping[str, Quantity] = {
    "command_frequency": "frequency_reference",
    "command_speed": "speed_reference",
}
"""Quantity of the reference before the ramp, by the quantity that sets it."""
RUN_HEADINGS: Mapping[Purpose, str] = {
    "forward": "RUN FORWARD",
    "reverse": "RUN REVERSE",
    "reference": "REFERENCE",
}


@dataclass(frozen=True, slots=True)
class RunLine:
    """Contents of the run line at one moment."""

    purpose: Purpose
    text: str
    """Reference as typed, without unit; empty if this panel cannot set it."""
    unit: str
    """Unit of the drive's reference; empty if this panel cannot set it."""
    opened: float
    """Monotonic time in seconds at which the line was opened."""
    stamp: int
    """The drive's count of stops when the line was opened; a later stop cancels the line."""
    fresh: bool = True
    """True if the next digit replaces the text, which is a proposal or the result of a step."""
    fault: str = ""
    """Error in the reference, found when Enter was pressed; empty if there is none."""

    def typed(self, character: str) -> RunLine | None:
        """Return the line with one more character; None if it cannot take that character."""
        if not self.unit:
            return None
        if character.isdecimal() and character.isascii():
            text = character if self.fresh else self.text + character
        elif character in ".,":
            before = "0" if self.fresh or not self.text else self.text
            text = before if "." in before else f"{before}."
        else:
            return None
        return replace(self, text=text[:DIGITS_MOST], fresh=False, fault="")

    def erased(self) -> RunLine:
        """Return the line without its last character, or without the whole proposal."""
        return replace(self, text="" if self.fresh else self.text[:-1], fresh=False, fault="")

    def stepped(self, key: str, low: Decimal | None, high: Decimal | None) -> RunLine:
        """Return the line one step higher or lower, within the limits and never below 0."""
        step = STEPS[key] * step_in(self.unit)
        try:
            number = Decimal(self.text or "0") + step
        except InvalidOperation:
            return self
        number = max(low or Decimal(0), number)
        if high is not None:
            number = min(high, number)
        return replace(self, text=f"{number:f}", fresh=True, fault="")

    @property
    def reference(self) -> str | None:
        """Reference for the drive; None if it takes none from this panel."""
        return f"{self.text}{self.unit}" if self.unit else None

    def counts(self, now: float) -> bool:
        """Return True if Enter counts: the line was visible long enough to be read."""
        return now - self.opened >= ENTER_COUNTS_AFTER

    @property
    def is_zero(self) -> bool:
        """True if a reference of 0 is typed; with a low limit above 0 the motor runs at that."""
        try:
            return bool(self.unit) and Decimal(self.text) == 0
        except InvalidOperation:
            return False

    def checked(self, profile: Profile, readings: Mapping[str, Shown]) -> RunLine:
        """Return the line with the error in its reference, if there is one."""
        if not self.unit:
            return self
        if not self.text:
            return replace(self, fault=NOTHING_TYPED)
        try:
            parse_reference(profile, self.reference or "", readings)
        except ValueRefused as refused:
            return replace(self, fault=str(refused))
        return replace(self, fault=AT_ZERO if self.is_zero and self.purpose != "reference" else "")


def proposed(
    profile: Profile, wanted: str, raws: Mapping[str, int], absent: Collection[str] = ()
) -> tuple[str, str]:
    """Return text and unit of a new line: the last reference given, else the drive's own.

    If that was not read, it is the reference before the ramp: 0 would stop the motor. Both are
    empty if this panel cannot set a reference.
    """
    parameter = next(iter(reference_parameters(profile)), None)
    if parameter is None:
        return "", ""
    unit = profile.unit(parameter, raws)
    if wanted.endswith(f" {unit}"):
        return wanted.removesuffix(unit).strip(), unit
    now = profile.quantity(BEFORE_RAMP.get(parameter.quantity or "", "frequency_reference"))
    for item in (parameter, now):
        if item is None or item.code not in raws or profile.unit(item, raws) != unit:
            continue
        held = number_of(profile, item, raws[item.code], raws, absent)
        if held is not None:
            return f"{abs(held):f}", unit
    return "0", unit


def limits(
    profile: Profile, readings: Mapping[str, Shown]
) -> tuple[Decimal | None, Decimal | None, str]:
    """Return the lowest and highest reference in its unit, and the code of the highest.

    A limit that is not known is None.
    """
    parameter = next(iter(reference_parameters(profile)), None)
    return (None, None, "") if parameter is None else reference_limits(profile, readings, parameter)


def _number(profile: Profile, quantity: Quantity, readings: Mapping[str, Shown]) -> Decimal | None:
    parameter = profile.quantity(quantity)
    reading = readings.get(parameter.code) if parameter else None
    if reading is None:
        return None
    return reading.drawn(
        reading.time,
        current=lambda value: value.number,
        old=lambda value, age: None,
        missing=None,
    )


def run_lines(
    line: RunLine,
    profile: Profile,
    readings: Mapping[str, Shown],
    now: float,
    width: int,
    hindrance: str = "",
    output: Decimal | None = None,
) -> list[Text]:
    """Return the run line, with notices above it and its keys below.

    `hindrance` is the reason why a run command would have no effect now, with the remedy. `output`
    is the motor's frequency in Hz, negative in reverse; None if it is not known.
    """
    reported = [Text(f" {part}", style) for part, style in _parts_of(line, hindrance, width - 2)]
    first = _first(line, profile, readings, output, width)
    lines = [*(reported or [Text("")]), first, _second(line, now)]
    for text in lines:
        text.no_wrap = True
        text.truncate(width, overflow="ellipsis")
        text.append(" " * (width - text.cell_len))
        text.stylize_before(GROUND_OF_LINE)
    return lines


def _parts_of(line: RunLine, hindrance: str, width: int) -> list[tuple[str, Style]]:
    """Return the notice above the line in at most two rows, with its style.

    It is the error in the reference, else a command without effect, else a reference of 0 or none.
    """
    if line.fault:
        message, style = line.fault, ALARM
    elif hindrance and line.purpose != "reference":
        message, style = f"No effect. {hindrance}", ALARM
    elif line.is_zero and line.purpose != "reference":
        message, style = AT_ZERO, ATTENTION
    elif line.unit and not line.text:
        message, style = NOTHING_TYPED, ATTENTION
    else:
        return []
    return [(part, style) for part in wrapped(message, width, 2)]


def _first(
    line: RunLine,
    profile: Profile,
    readings: Mapping[str, Shown],
    output: Decimal | None,
    width: int,
) -> Text:
    """Return the effect of Enter, the typed reference, and what fits of its limits and ramp."""
    first = Text(" ")
    first.append(RUN_HEADINGS[line.purpose], STRONG)
    if not line.unit:
        return first.append("  the reference is set at the drive", FAINT)
    first.append(" at ", STRONG)
    first.append(f" {line.text:>{DIGITS_MOST}} ", "bold white on #101214")
    first.append(f" {line.unit}  ", PLAIN)
    for number, part in enumerate(_around(line, profile, readings, output)):
        text = f" · {part}" if number else part
        if first.cell_len + len(text) > width:
            break
        first.append(text, FAINT)
    return first


def _second(line: RunLine, now: float) -> Text:
    """Return the keys of the line; Enter is dim until it counts."""
    second = Text(" ")
    second.append("Enter", KEY if line.counts(now) else FAINT)
    second.append(" set   " if line.purpose == "reference" else " run   ", FAINT)
    if line.unit:
        second.append("↑ ↓", KEY)
        second.append(f" {step_in(line.unit)} {line.unit}   ", FAINT)
    second.append("Esc", KEY)
    second.append(" cancel   ", FAINT)
    second.append("Space", STOP_KEY)
    return second.append(" stop", FAINT)


def _around(
    line: RunLine, profile: Profile, readings: Mapping[str, Shown], output: Decimal | None
) -> list[str]:
    """Return the known limits, ramp time and time to the reference."""
    parts = []
    low, high, code = limits(profile, readings)
    if high is not None:
        parts.append(f"{low or Decimal(0):f} .. {code} {high:f}")
    ramp = _number(profile, "acceleration", readings)
    if ramp is not None:
        parts.append(f"ramp {ramp:f} s")
        reaches = line.unit == "Hz" and line.purpose != "reference" and not line.fault
        if reaches and line.text and not line.is_zero and output is not None:
            parts += _there_in(line, profile, readings, output)
    return parts


def _there_in(
    line: RunLine, profile: Profile, readings: Mapping[str, Shown], output: Decimal
) -> list[str]:
    """Return the time in seconds from the present output to the reference; empty if unknown.

    A motor that turns the other way slows down first.
    """
    rated, up, down = (
        _number(profile, quantity, readings)
        for quantity in ("rated_frequency", "acceleration", "deceleration")
    )
    try:
        wanted = Decimal(line.text or 0) * (-1 if line.purpose == "reverse" else 1)
    except InvalidOperation:
        return []
    same = output * wanted >= 0
    faster = max(Decimal(0), abs(wanted) - abs(output)) if same else abs(wanted)
    slower = max(Decimal(0), abs(output) - abs(wanted)) if same else abs(output)
    if not rated or up is None or (slower and down is None):
        return []
    return [f"reached in {(faster * up + slower * (down or 0)) / rated:.1f} s"]
