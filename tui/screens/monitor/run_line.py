"""The line that runs a motor or gives it a reference: what is typed, and what Enter will do."""

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
"""By key, the step of a reference: in its unit, rpm in tens."""
DIGITS_MOST = 7
AT_ZERO = "At 0 the motor would not turn: type a reference, then Enter."
GROUND_OF_LINE = Style(bgcolor=SURFACE)
BEFORE_RAMP: Mapping[str, Quantity] = {
    "command_frequency": "frequency_reference",
    "command_speed": "speed_reference",
}
"""By where a reference is given, where it shows before the ramp."""
RUN_HEADINGS: Mapping[Purpose, str] = {
    "forward": "RUN FORWARD",
    "reverse": "RUN REVERSE",
    "reference": "REFERENCE",
}


@dataclass(frozen=True, slots=True)
class RunLine:
    """Contents of the run line."""

    purpose: Purpose
    text: str
    """The reference as typed, without unit; empty where the drive takes none from here."""
    unit: str
    """That of the drive's reference; empty where the drive takes none from here."""
    opened: float
    """When it was drawn first, on the monotonic clock."""
    stamp: int
    """The drive's count of stops when the line was asked for: a later stop voids it."""
    fresh: bool = True
    """True if it is the proposal yet, which the first digit replaces."""
    fault: str = ""
    """Error in it, once Enter was pressed."""

    def typed(self, character: str) -> RunLine | None:
        """With one more character; None for one that a number has not."""
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
        """With a character less; the whole proposal goes at once."""
        return replace(self, text="" if self.fresh else self.text[:-1], fresh=False, fault="")

    def stepped(self, key: str, low: Decimal | None, high: Decimal | None) -> RunLine:
        """A step up or down, at most to the limits."""
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
        """Return True if Enter was meant for this line: it stood there long enough to be read."""
        return now - self.opened >= ENTER_COUNTS_AFTER

    @property
    def is_zero(self) -> bool:
        """True if its contents turn no motor."""
        try:
            return bool(self.unit) and Decimal(self.text or "0") == 0
        except InvalidOperation:
            return False

    def checked(self, profile: Profile, readings: Mapping[str, Shown]) -> RunLine:
        """With what is wrong with the reference, if anything is."""
        if not self.unit:
            return self
        if self.text and self.is_zero and self.purpose != "reference":
            return replace(self, fault=AT_ZERO)
        try:
            parse_reference(profile, self.reference or "", readings)
        except ValueRefused as refused:
            return replace(self, fault=str(refused))
        return replace(self, fault="")


def proposed(
    profile: Profile, wanted: str, raws: Mapping[str, int], absent: Collection[str] = ()
) -> tuple[str, str]:
    """Text and unit that a line begins with: the last reference given, else the drive's own.

    Where that was not read yet it is what the drive goes by now: 0 would stop the motor. Both
    empty where the drive takes none from here.
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
    """Lowest and highest reference in its unit, as far as known, and the code of the highest."""
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
    """The line, what must be known before Enter above it, and its keys below.

    `hindrance` says why a run command would have no effect now, and what opens the way; `output`
    is the frequency of the motor now, below 0 in reverse, None where it is not known.
    """
    reported = [Text(f" {part}", style) for part, style in _parts_of(line, hindrance, width - 2)]
    lines = [*(reported or [Text("")]), _first(line, profile, readings, output), _second(line, now)]
    for text in lines:
        text.no_wrap = True
        text.truncate(width, overflow="ellipsis")
        text.append(" " * (width - text.cell_len))
        text.stylize_before(GROUND_OF_LINE)
    return lines


def _parts_of(line: RunLine, hindrance: str, width: int) -> list[tuple[str, Style]]:
    """Return the error in the reference, why the command has no effect, or that it is 0."""
    if line.fault:
        message, style = line.fault, ALARM
    elif hindrance and line.purpose != "reference":
        message, style = f"No effect. {hindrance}", ALARM
    elif line.is_zero and line.purpose != "reference":
        message, style = "The reference is 0. Type a reference.", ATTENTION
    else:
        return []
    return [(part, style) for part in wrapped(message, width, 2)]


def _first(
    line: RunLine, profile: Profile, readings: Mapping[str, Shown], output: Decimal | None
) -> Text:
    """Return the effect of Enter, the typed reference, and its limits."""
    first = Text(" ")
    first.append(RUN_HEADINGS[line.purpose], STRONG)
    if not line.unit:
        return first.append("  the reference is set at the drive", FAINT)
    first.append(" at ", STRONG)
    first.append(f" {line.text:>{DIGITS_MOST}} ", "bold white on #101214")
    first.append(f" {line.unit}  ", PLAIN)
    return first.append(_around(line, profile, readings, output), FAINT)


def _second(line: RunLine, now: float) -> Text:
    """The keys of the line."""
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
) -> str:
    """The limits and the ramp, as far as they are known."""
    parts = []
    low, high, code = limits(profile, readings)
    if high is not None:
        parts.append(f"{low or Decimal(0):f} .. {code} {high:f}")
    ramp = _number(profile, "acceleration", readings)
    if ramp is not None:
        parts.append(f"ramp {ramp:f} s")
        reaches = line.unit == "Hz" and line.purpose != "reference" and not line.fault
        if reaches and not line.is_zero and output is not None:
            parts += _there_in(line, profile, readings, output)
    return " · ".join(parts)


def _there_in(
    line: RunLine, profile: Profile, readings: Mapping[str, Shown], output: Decimal
) -> list[str]:
    """Return the ramp time from the present output: a motor turning the other way slows down
    first."""
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
