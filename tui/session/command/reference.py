"""What a person may give as a reference: a number with Hz or rpm, between the drive's limits."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from tui.drive.errors import ValueRefused
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.values import encode

from ..reading import Reading

_TYPED = re.compile(r"\s*([+-]?\d+(?:[.,]\d+)?)\s*(hz|rpm|1/min)?\s*", re.IGNORECASE)
LIMITS: tuple[Quantity, ...] = ("low_speed", "high_speed", "max_frequency")
SPEED_SOURCES: tuple[Quantity, ...] = ("rated_frequency", "rated_speed")


@dataclass(frozen=True, slots=True)
class Reference:
    """A reference that the drive can hold: where it goes, as what, and how it reads."""

    parameter: Parameter
    raw: int
    text: str
    rounded: bool


def reference_codes(profile: Profile) -> list[str]:
    """Codes of the words that a reference is checked against, and of the references."""
    wanted: tuple[Quantity, ...] = (*LIMITS, *SPEED_SOURCES, "command_frequency", "command_speed")
    found = (profile.quantity(quantity) for quantity in wanted)
    return [parameter.code for parameter in found if parameter is not None]


def parse_reference(profile: Profile, text: str, readings: Mapping[str, Reading]) -> Reference:
    """The reference that a person typed; Hz unless told otherwise.

    Raises ValueRefused for what is no reference, has no place on this drive, or lies outside
    the lowest and the highest speed, as far as these are known.
    """
    match = _TYPED.fullmatch(text)
    if match is None:
        raise ValueRefused(f"{text!r} is no reference. Write it like 30, 30.5Hz or 900rpm.")
    number = Decimal(match[1].replace(",", "."))
    speed = (match[2] or "hz").casefold() != "hz"
    parameter = profile.quantity("command_speed" if speed else "command_frequency")
    if parameter is None:
        raise ValueRefused(
            f"Where {profile.name} takes a reference in {'rpm' if speed else 'Hz'} is in no"
            " manual at hand; give it at the drive."
        )
    if number < 0:
        raise ValueRefused("A reference is not negative; run reverse instead.")
    hertz = _hertz_of(profile, number, readings) if speed else number
    if hertz is not None:
        _check_limits(profile, hertz, readings)
    conversion = encode(parameter, str(number), profile.names(parameter), Decimal(parameter.scale))
    shown = conversion.raw * Decimal(parameter.scale)
    return Reference(parameter, conversion.raw, f"{shown:f} {parameter.unit}", conversion.rounded)


def within_limits(profile: Profile, hertz: Decimal, readings: Mapping[str, Reading]) -> Decimal:
    """A stepped reference in Hz, at most to the limits that are known."""
    low, high, most = (_number(profile, quantity, readings) for quantity in LIMITS)
    for limit in (high, most):
        if limit:
            hertz = min(hertz, limit)
    return max(hertz, low or Decimal(0))


def _check_limits(profile: Profile, hertz: Decimal, readings: Mapping[str, Reading]) -> None:
    low, high, most = (_number(profile, quantity, readings) for quantity in LIMITS)
    upper: tuple[tuple[Quantity, Decimal | None], ...] = (
        ("high_speed", high),
        ("max_frequency", most),
    )
    for quantity, limit in upper:
        if limit and hertz > limit:
            raise ValueRefused(f"{hertz:f} Hz is above {_code(profile, quantity)} = {limit:f} Hz.")
    if low and hertz < low:
        raise ValueRefused(
            f"{hertz:f} Hz is below {_code(profile, 'low_speed')} = {low:f} Hz: the drive would"
            " run at that."
        )


def _hertz_of(profile: Profile, rpm: Decimal, readings: Mapping[str, Reading]) -> Decimal | None:
    """The frequency of a synchronous speed; None while the motor's poles are not known."""
    frequency, speed = (_number(profile, quantity, readings) for quantity in SPEED_SOURCES)
    if not frequency or not speed:
        return None
    pairs = max(1, int(60 * frequency / speed))
    return rpm * pairs / 60


def _number(
    profile: Profile, quantity: Quantity, readings: Mapping[str, Reading]
) -> Decimal | None:
    parameter = profile.quantity(quantity)
    reading = readings.get(parameter.code) if parameter else None
    return reading.value.number if reading is not None and reading.value is not None else None


def _code(profile: Profile, quantity: Quantity) -> str:
    parameter = profile.quantity(quantity)
    return parameter.code if parameter else quantity
