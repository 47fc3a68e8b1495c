"""The line that runs a motor or gives it a reference: what is typed, and what Enter will do."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from typing import Literal

from rich.text import Text

from tui.drive.errors import ValueRefused
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.session.command.reference import LIMITS, parse_reference
from tui.session.reading import Reading
from tui.widgets.drawing import short
from tui.widgets.palette import ALARM, FAINT, KEY, PLAIN, STOP_KEY, STRONG

Purpose = Literal["forward", "reverse", "reference"]

SETTLED = 0.3
"""Seconds after which Enter counts: an earlier one was not meant for this line."""
STEPS: Mapping[str, Decimal] = {
    "up": Decimal(1),
    "down": Decimal(-1),
    "pageup": Decimal(5),
    "pagedown": Decimal(-5),
}
"""By key, the step of a reference in Hz, or in tens of rpm."""
DIGITS_MOST = 7
GIVEN: tuple[tuple[Quantity, str], ...] = (("command_frequency", "Hz"), ("command_speed", "rpm"))
"""Where a reference is given, and in which unit; the first that a family has."""
RUN_HEADINGS: Mapping[Purpose, str] = {
    "forward": "RUN FORWARD",
    "reverse": "RUN REVERSE",
    "reference": "REFERENCE",
}


@dataclass(frozen=True, slots=True)
class RunLine:
    """What stands in the line."""

    purpose: Purpose
    text: str
    """The reference as typed, without unit; empty where the drive takes none from here."""
    unit: str
    """Hz or rpm; empty where the drive takes no reference from here."""
    opened: float
    """When it was drawn first, on the monotonic clock."""
    stamp: int
    """The drive's count of stops when the line was asked for: a later stop voids it."""
    fresh: bool = True
    """Whether it is the proposal yet, which the first digit replaces."""
    fault: str = ""
    """What is wrong with it, once Enter was pressed."""

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
        step = STEPS[key] * (1 if self.unit == "Hz" else 10)
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
        """What is given to the drive; None where it takes none from here."""
        return f"{self.text}{self.unit}" if self.unit else None

    def counts(self, now: float) -> bool:
        """Whether Enter was meant for this line: it stood there long enough to be read."""
        return now - self.opened >= SETTLED

    def checked(self, profile: Profile, readings: Mapping[str, Reading]) -> RunLine:
        """With what is wrong with the reference, if anything is."""
        if not self.unit:
            return self
        try:
            parse_reference(profile, self.reference or "", readings)
        except ValueRefused as refused:
            return replace(self, fault=str(refused))
        return replace(self, fault="")


def proposed(
    profile: Profile, purpose: Purpose, wanted: str, raws: Mapping[str, Decimal]
) -> tuple[str, str]:
    """Text and unit that a line begins with: the last reference given, else the drive's own.

    `raws` are engineering values by code. Both empty where the drive takes none from here.
    """
    for quantity, unit in GIVEN:
        parameter = profile.quantity(quantity)
        if parameter is None:
            continue
        if wanted.endswith(unit):
            return wanted.removesuffix(unit).strip(), unit
        held = raws.get(parameter.code)
        return (f"{abs(held):f}" if held is not None else "0"), unit
    return "", ""


def limits(
    profile: Profile, readings: Mapping[str, Reading]
) -> tuple[Decimal | None, Decimal | None, str]:
    """The lowest and the highest reference in Hz, as far as known, and the code of the highest."""
    low = _number(profile, LIMITS[0], readings)
    for quantity in LIMITS[1:]:
        if high := _number(profile, quantity, readings):
            parameter = profile.quantity(quantity)
            return low, high, parameter.code if parameter else ""
    return low, None, ""


def _number(
    profile: Profile, quantity: Quantity, readings: Mapping[str, Reading]
) -> Decimal | None:
    parameter = profile.quantity(quantity)
    reading = readings.get(parameter.code) if parameter else None
    return reading.value.number if reading is not None and reading.value is not None else None


def run_lines(
    line: RunLine, profile: Profile, readings: Mapping[str, Reading], now: float, width: int
) -> list[Text]:
    """The line and its keys, as long as it is open."""
    first = Text(" ", no_wrap=True)
    first.append(RUN_HEADINGS[line.purpose], STRONG)
    if line.unit:
        first.append(" at ", STRONG)
        first.append(f" {line.text:>{DIGITS_MOST}} ", "bold white on #101214")
        first.append(f" {line.unit}  ", PLAIN)
        first.append(_around(line, profile, readings), FAINT)
    else:
        first.append("  the reference is given at the drive", FAINT)
    first.truncate(width, overflow="ellipsis")
    if line.fault:
        return [first, Text(f" {short(line.fault, width - 1)}", ALARM)]
    does = "gives it" if line.purpose == "reference" else "runs"
    second = Text(" ", no_wrap=True)
    second.append("Enter", KEY if line.counts(now) else FAINT)
    second.append(f" {does}   ", FAINT)
    if line.unit:
        second.append("↑ ↓", KEY)
        second.append(f" {1 if line.unit == 'Hz' else 10} {line.unit}   ", FAINT)
    second.append("Esc", KEY)
    second.append(" no   ", FAINT)
    second.append("Space", STOP_KEY)
    second.append(" stops", FAINT)
    return [first, second]


def _around(line: RunLine, profile: Profile, readings: Mapping[str, Reading]) -> str:
    """The limits and the ramp, as far as they are known."""
    parts = []
    low, high, code = limits(profile, readings)
    if line.unit == "Hz" and high is not None:
        parts.append(f"{low or Decimal(0):f} .. {code} {high:f}")
    ramp = _number(profile, "acceleration", readings)
    if ramp is not None:
        parts.append(f"ramp {ramp:f} s")
        rated = _number(profile, "rated_frequency", readings)
        if rated and line.unit == "Hz" and line.purpose != "reference":
            with suppress(InvalidOperation):
                parts.append(f"there in {Decimal(line.text or 0) / rated * ramp:.1f} s")
    return " · ".join(parts)
