"""What a person may give as a reference: a number with Hz or rpm, between the drive's limits."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from tui.drive.errors import ValueRefused
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.taught_profile import reference_of
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
    codes = [parameter.code for parameter in found if parameter is not None]
    return [*codes, *(limit.code for code in codes if (limit := taught_limit(profile, code)))]


def taught_limit(profile: Profile, code: str) -> Parameter | None:
    """The word with the highest reference that a taught one takes; None where it is in no unit.

    It counts once it was taught too, in the unit of the reference.
    """
    way = reference_of(profile, code) if code in profile.taught else None
    if way is None or way.most not in profile.taught:
        return None
    same = profile.taught[way.most].unit == profile.taught[code].unit
    return profile[way.most] if same else None


def no_place(profile: Profile, unit: str) -> str:
    """Why a drive takes no reference in a unit from here, with the way out of that."""
    other = "Hz" if unit == "rpm" else "rpm"
    taken = profile.quantity("command_frequency" if unit == "rpm" else "command_speed")
    if taken is not None and taken.code in profile.taught:
        return f"{taken.code} was taught in {other}: write the reference like 900{other}."
    text = f"Where {profile.name} takes a reference in {unit} is in no manual at hand"
    ways = [one.parameter for one in profile.data.teachable_references]
    if not ways:
        return f"{text}; give it at the drive."
    code = ways[0]
    if code not in profile.taught:
        return (
            f"{text}. Give it at the drive, or teach {code}: L in the panel, or drivepanel teach."
        )
    return (
        f"{text}. {code} was taught; R in the panel, or drivepanel teach {code} --reference, makes"
        " it the reference."
    )


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
        raise ValueRefused(no_place(profile, "rpm" if speed else "Hz"))
    if number < 0:
        raise ValueRefused("A reference is not negative; run reverse instead.")
    hertz = _hertz_of(profile, number, readings) if speed else number
    if hertz is not None:
        _check_limits(profile, hertz, readings)
    if (limit := taught_limit(profile, parameter.code)) is not None:
        _check_taught_limit(number, limit, readings)
    conversion = encode(parameter, str(number), profile.names(parameter), Decimal(parameter.scale))
    shown = conversion.raw * Decimal(parameter.scale)
    taught = profile.taught.get(parameter.code)
    if taught is not None and taught.number(conversion.raw) != shown:
        raise ValueRefused(
            f"{number:f} is past what is known of {parameter.code}: its sign is open."
        )
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


def _check_taught_limit(number: Decimal, limit: Parameter, readings: Mapping[str, Reading]) -> None:
    """A highest reference that cannot be read holds nothing back: the drive has it anyway."""
    reading = readings.get(limit.code)
    value = reading.value if reading is not None else None
    if value is None or value.number is None or not value.taught:
        return
    if number > abs(value.number):
        raise ValueRefused(
            f"{number:f} {value.unit} is above {limit.code} = {abs(value.number):f} {value.unit}."
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
