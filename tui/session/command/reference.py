"""References as a person types them: a number, in a unit that leads to the drive's own.

It is converted as every other value is, and compared with the limits in their units. What a drive
reads back is compared with the request, by the way back.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_UP, Decimal

from tui.drive.errors import UnitRefused, ValueRefused
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity, ScaleWhen
from tui.drive.shown import depends_on, number_of, raw_of_text
from tui.drive.taught_profile import reference_of
from tui.drive.units import factor_between, spelled

from ..reading import reading_of
from ..shown import Shown

_TYPED = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*(1/min|[^\s\d.,+\-/][^\d.,+\-]*)?")
LIMITS: tuple[Quantity, ...] = ("low_speed", "high_speed", "max_frequency")
REFERENCES: tuple[Quantity, ...] = ("command_frequency", "command_speed")
"""The words that take a reference; the first that a drive has takes a number without a unit."""
EXAMPLES: Mapping[str, str] = {"Hz": "30Hz", "rpm": "900rpm", "%": "40%"}
"""By unit, a reference as it is typed."""
DECIMALS_CONVERTED = 3
"""Decimals of a converted number in a sentence."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A reference that the drive can hold: where it goes, as what, and how it reads."""

    parameter: Parameter
    raw: int
    text: str
    """The value that the drive is to hold, in its own unit."""
    rounded: bool
    requested: str
    """The number and the unit that were requested."""
    number: Decimal
    """The same in the unit of the drive, not rounded."""
    unit: str
    step: Decimal
    """The worth of one count in that unit."""

    @property
    def is_converted(self) -> bool:
        """True if it was requested in another unit than that of the drive."""
        return factor_between(self.requested.rpartition(" ")[2], self.unit) is None


def reference_parameters(profile: Profile) -> list[Parameter]:
    """The words that take a drive's reference, that of a number without a unit first."""
    found = (profile.quantity(quantity) for quantity in REFERENCES)
    return [parameter for parameter in found if parameter is not None]


def step_in(unit: str) -> int:
    """The size of a step in a unit, for one of 1 Hz."""
    return 10 if factor_between(unit, "rpm") is not None else 1


def reference_codes(profile: Profile) -> list[str]:
    """Codes of the words that a reference is converted by and checked against, and of itself."""
    wanted: tuple[Quantity, ...] = (*LIMITS, *MOTOR_DATA, *REFERENCES)
    found = (profile.quantity(quantity) for quantity in wanted)
    codes = [parameter.code for parameter in found if parameter is not None]
    codes += scale_codes(profile)
    for parameter in reference_parameters(profile):
        codes += [*depends_on(parameter), *([parameter.rating] if parameter.rating else [])]
        limit = taught_limit(profile, parameter.code)
        codes += [limit.code] if limit is not None else []
    return list(dict.fromkeys(codes))


def _scale_conditions(profile: Profile) -> list[ScaleWhen]:
    return [way.scale_when for way in profile.data.references if way.scale_when is not None]


def scale_codes(profile: Profile) -> list[str]:
    """Codes of the words on which it depends in which scale references count."""
    return list(dict.fromkeys(when.parameter for when in _scale_conditions(profile)))


def other_scale(profile: Profile, raws: Mapping[str, int]) -> str:
    """Why references surely count in another scale now, with what to do; empty if they do not."""
    for when in _scale_conditions(profile):
        if when.holds(raws) is False:
            return when.otherwise
    return ""


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
    text = f"Where {profile.name} takes a reference in {unit} is in no manual at hand"
    ways = [reference.parameter for reference in profile.data.teachable_references]
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


def parse_reference(profile: Profile, text: str, readings: Mapping[str, Shown]) -> Reference:
    """The reference that a person typed, within the drive's limits as far as these are known.

    Raises what `convert_reference` raises, and ValueRefused for one outside the limits.
    """
    found = convert_reference(profile, text, readings)
    _check_limits(ReferenceUnits(profile, readings), found)
    if (limit := taught_limit(profile, found.parameter.code)) is not None:
        _check_taught_limit(found.number, limit, readings)
    return found


def convert_reference(profile: Profile, text: str, readings: Mapping[str, Shown]) -> Reference:
    """The reference that a person typed, as a raw value; the drive's own unit without one.

    Another unit is converted by what the drive holds: pairs of poles, what 100 % is. Raises
    UnitRefused if no conversion exists from one to the other, ValueRefused for a text that is not a
    reference, has no place on this drive, or follows a scale that was not read or has changed.
    """
    match = _TYPED.fullmatch(text.strip())
    if match is None:
        raise ValueRefused(f"{text!r} is not a reference. Write it like 30, 30.5Hz or 900rpm.")
    typed, unit = Decimal(match[1].replace(",", ".")), spelled((match[2] or "").strip())
    known = ReferenceUnits(profile, readings)
    if not reference_parameters(profile):
        raise ValueRefused(no_place(profile, unit or "Hz"))
    if typed < 0:
        raise ValueRefused("A reference is not negative; run reverse instead.")
    parameter, number = _placed(known, text, typed, unit)
    raws, absent = known.raws, known.absent
    if refusal := other_scale(profile, raws):
        raise ValueRefused(refusal)
    conversion = raw_of_text(profile, parameter, f"{number:f}", raws, absent)
    held = number_of(profile, parameter, conversion.raw, raws, absent)
    scale = profile.scale(parameter, raws, absent)
    assert held is not None, "it was converted: its scale is known"
    assert scale is not None
    own = known.unit(parameter)
    return Reference(
        parameter,
        conversion.raw,
        f"{held:f} {own}".rstrip(),
        conversion.rounded,
        f"{typed:f} {unit or own}".rstrip(),
        number,
        own,
        scale,
    )


def read_back_differs(profile: Profile, wanted: Reference, readings: Mapping[str, Shown]) -> str:
    """The difference between the value read back and the one requested; empty if there is none.

    The request is converted once more, what the drive holds is read as a value of its own:
    a scale, a unit or a rating that changed since shows. Raises what `convert_reference` raises.
    """
    code = wanted.parameter.code
    now, reading = convert_reference(profile, wanted.requested, readings), readings.get(code)
    value = reading_of(reading).value if reading is not None else None
    if value is None or value.number is None:
        return f"{code} could not be read back{f': {reading.error}' if reading else ''}"
    same = now.parameter.code == code and value.unit == now.unit
    if same and abs(value.number - now.number) <= min(now.step, wanted.step):
        return ""
    held = value.display
    if same and wanted.is_converted:
        known, unit = ReferenceUnits(profile, readings), wanted.requested.rpartition(" ")[2]
        number = known.converted(value.number, value.unit, unit, known.whole(wanted.parameter))
        held += f" ({_tidy(number)} {unit})" if number is not None else ""
    return f"{code} holds {held}, {wanted.requested} was requested"


def reference_limits(
    profile: Profile, readings: Mapping[str, Shown], parameter: Parameter
) -> tuple[Decimal | None, Decimal | None, str]:
    """Lowest and highest reference in its own unit, as far as known; the code of the highest."""
    known = ReferenceUnits(profile, readings)
    low, high, code = None, None, ""
    for quantity in LIMITS:
        limit = known.quantity(quantity)
        if limit is None:
            continue
        number = known.converted(*limit, known.unit(parameter), known.whole(parameter))
        if quantity == "low_speed":
            low = None if number is None else _shortened(number, ROUND_CEILING)
        elif number and (high is None or number < high):
            high, code = _shortened(number, ROUND_FLOOR), _code(profile, quantity)
    return low, high, code


def within_limits(
    profile: Profile, number: Decimal, readings: Mapping[str, Shown], parameter: Parameter
) -> Decimal:
    """A stepped reference in its own unit, at most to the limits that are known."""
    low, high, _ = reference_limits(profile, readings, parameter)
    if high is not None:
        number = min(number, high)
    return max(number, low or Decimal(0))


def _placed(
    known: ReferenceUnits, text: str, typed: Decimal, unit: str
) -> tuple[Parameter, Decimal]:
    """The word that takes a reference in this unit, and the number there; raises UnitRefused."""
    places = reference_parameters(known.profile)
    if not unit:
        return places[0], typed
    for place in places:
        if (factor := factor_between(unit, known.unit(place))) is not None:
            return place, typed * factor
    for place in places:
        number = known.converted(typed, unit, known.unit(place), known.whole(place))
        if number is not None:
            return place, number
    own = known.unit(places[0])
    raise UnitRefused(
        f"{text!r} cannot be converted: {places[0].code} takes its reference in"
        f" {' or '.join(_accepted(known))}. Type it like {EXAMPLES.get(own, f'5{own}')}."
    )


def _accepted(known: ReferenceUnits) -> list[str]:
    """The units in which a reference can be given now, the drive's own first."""
    places = reference_parameters(known.profile)
    own = [known.unit(place) or "counts" for place in places]
    more = [
        unit
        for unit in ("Hz", "rpm", "%")
        for place in places
        if known.converted(Decimal(1), unit, known.unit(place), known.whole(place)) is not None
    ]
    return list(dict.fromkeys((*own, *more)))


def _check_limits(known: ReferenceUnits, wanted: Reference) -> None:
    whole = known.whole(wanted.parameter)
    for quantity in (*LIMITS[1:], LIMITS[0]):
        limit = known.quantity(quantity)
        if limit is None or not limit[0]:
            continue
        most, unit = limit
        number = known.converted(wanted.number, wanted.unit, unit, whole)
        if number is None:
            continue
        code, given = _code(known.profile, quantity), f"{_tidy(number)} {unit}"
        if quantity != "low_speed" and number > most:
            raise ValueRefused(f"{given} is above {code} = {most:f} {unit}.")
        if quantity == "low_speed" and number < most:
            raise ValueRefused(
                f"{given} is below {code} = {most:f} {unit}: the drive would run at that."
            )


def _check_taught_limit(number: Decimal, limit: Parameter, readings: Mapping[str, Shown]) -> None:
    """A highest reference that cannot be read holds nothing back: the drive has it anyway."""
    reading = readings.get(limit.code)
    value = reading_of(reading).value if reading is not None else None
    if value is None or value.number is None or not value.taught:
        return
    if number > abs(value.number):
        raise ValueRefused(
            f"{number:f} {value.unit} is above {limit.code} = {abs(value.number):f} {value.unit}."
        )


def _tidy(number: Decimal) -> str:
    """A number for a sentence: no more decimals than it needs, and at most a few."""
    return f"{_shortened(number, ROUND_HALF_UP):f}"


def _shortened(number: Decimal, rounding: str) -> Decimal:
    """A converted number with at most a few decimals; one with few anyway stays."""
    if -int(number.as_tuple().exponent) <= DECIMALS_CONVERTED:
        return number
    short = number.quantize(Decimal(1).scaleb(-DECIMALS_CONVERTED), rounding).normalize()
    return short if int(short.as_tuple().exponent) <= 0 else short.quantize(Decimal(1))


def _code(profile: Profile, quantity: Quantity) -> str:
    parameter = profile.quantity(quantity)
    return parameter.code if parameter else quantity


MOTOR_DATA: tuple[Quantity, ...] = ("rated_frequency", "rated_speed")
"""The plate that gives the pole pairs of the motor."""
NEARLY_ONE_MORE = Decimal("0.05")
"""By how much a plate may round a speed up: 1501 rpm at 50 Hz means two pole pairs."""


@dataclass(frozen=True, slots=True)
class ReferenceUnits:
    """Conversions by what was read of one drive."""

    profile: Profile
    readings: Mapping[str, Shown]

    @property
    def raws(self) -> dict[str, int]:
        """Raw values by code."""
        return {
            code: reading.raw for code, reading in self.readings.items() if reading.raw is not None
        }

    @property
    def absent(self) -> set[str]:
        """Codes of words that the drive lacks."""
        return {code for code, reading in self.readings.items() if reading.absent}

    def unit(self, parameter: Parameter) -> str:
        """The unit of a word; `raw` if it follows another word that was not read."""
        return self.profile.unit(parameter, self.raws)

    def quantity(self, quantity: Quantity) -> tuple[Decimal, str] | None:
        """Number and unit of a quantity; None if it was not read, or its scale is not known."""
        return self._number(self.profile.quantity(quantity))

    def whole(self, parameter: Parameter) -> Parameter | None:
        """The parameter that holds 100 % of this one in a physical unit."""
        return self.profile.get(parameter.rating) if parameter.rating else None

    def converted(
        self, number: Decimal, unit: str, other: str, whole: Parameter | None = None
    ) -> Decimal | None:
        """A number in another unit; None if nothing known leads from one to the other.

        `whole` is the parameter that holds 100 %.
        """
        if (factor := factor_between(unit, other)) is not None:
            return number * factor
        hundred = self._number(whole)
        if hundred is not None and hundred[0] and factor_between(unit, "%"):
            return self.converted(number * hundred[0] / 100, hundred[1], other)
        if hundred is not None and hundred[0] and factor_between(other, "%"):
            part = self.converted(number, unit, hundred[1])
            return None if part is None else part * 100 / hundred[0]
        return self._between_speeds(number, unit, other)

    def _between_speeds(self, number: Decimal, unit: str, other: str) -> Decimal | None:
        """Hz to rpm and back, at synchronous speed."""
        pairs = self._pole_pairs()
        if pairs is None:
            return None
        for text, two, times, by in (("Hz", "rpm", 60, pairs), ("rpm", "Hz", pairs, 60)):
            before, after = factor_between(unit, text), factor_between(two, other)
            if before is not None and after is not None:
                return number * before * times / by * after
        return None

    def _pole_pairs(self) -> Decimal | None:
        frequency, speed = (self.quantity(literal_type) for literal_type in MOTOR_DATA)
        if not frequency or not speed or frequency[0] <= 0 or speed[0] <= 0:
            return None
        hertz, rpm = factor_between(frequency[1], "Hz"), factor_between(speed[1], "rpm")
        if hertz is None or rpm is None:
            return None
        pairs = 60 * frequency[0] * hertz / (speed[0] * rpm)
        return max(Decimal(1), Decimal(int(pairs + NEARLY_ONE_MORE)))

    def _number(self, parameter: Parameter | None) -> tuple[Decimal, str] | None:
        reading = self.readings.get(parameter.code) if parameter is not None else None
        value = reading_of(reading).value if reading is not None else None
        if value is None or value.number is None or value.unit == "raw":
            return None
        return value.number, value.unit
