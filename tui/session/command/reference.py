"""References as a person types them: a number with a unit that can be converted to the drive's.

A reference is converted like every other value, and compared with the limits in their units. The
value read back is converted in the other direction, and compared with the request.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_UP, Decimal

from tui.drive.errors import ValueRefused, ValueUndetermined
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity, ScaleWhen
from tui.drive.sentences import any_of
from tui.drive.shown import depends_on, number_of, raw_of_text
from tui.drive.taught_profile import reference_of
from tui.drive.units import factor_between, spelled
from tui.drive.values import check_raw

from ..reading import reading_of
from ..shown import Shown
from .reference_units import MOTOR_DATA, ReferenceUnits

_TYPED = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*(1/min|[^\s\d.,+\-/][^\d.,+\-]*)?")
LIMITS: tuple[Quantity, ...] = ("low_speed", "high_speed", "max_frequency")
REFERENCES: tuple[Quantity, ...] = ("command_frequency", "command_speed")
"""Quantities of reference words; a number without a unit goes to the first that a drive has."""
EXAMPLES: Mapping[str, str] = {"Hz": "30Hz", "rpm": "900rpm", "%": "40%"}
"""By unit, a reference as it is typed."""
DECIMALS_CONVERTED = 3
"""Decimals of a converted number in a sentence."""


@dataclass(frozen=True, slots=True)
class Reference:
    """A reference that the drive can hold."""

    parameter: Parameter
    raw: int
    text: str
    """The value of `raw` in the drive's unit."""
    rounded: bool
    requested: str
    """The typed number and unit."""
    number: Decimal
    """The typed number in the drive's unit, not rounded."""
    unit: str
    """The drive's unit."""
    step: Decimal
    """One count in the drive's unit."""
    is_negative: bool = False
    """True if the drive gets it negated, to run in reverse: then `raw` is negative."""

    @property
    def is_converted(self) -> bool:
        """True if it was typed in another unit than the drive's."""
        return factor_between(self.requested.rpartition(" ")[2], self.unit) is None


def reference_parameters(profile: Profile) -> list[Parameter]:
    """Return the reference words of a drive; a number without a unit goes to the first."""
    found = (profile.quantity(quantity) for quantity in REFERENCES)
    return [parameter for parameter in found if parameter is not None]


def is_signed(profile: Profile, code: str) -> bool:
    """Return True if the sign of a reference word gives the direction of rotation."""
    ways = profile.data.references
    return any(way.parameter == code and way.reverse == "negative" for way in ways)


def with_sign(profile: Profile, reference: Reference, *, reverse: bool) -> Reference:
    """Return a reference with the sign for a direction, if its word has one.

    Raises ValueRefused if the word cannot hold the negative value.
    """
    parameter = reference.parameter
    if not is_signed(profile, parameter.code) or reference.is_negative is reverse:
        return reference
    raw = -reference.raw
    check_raw(parameter, raw, profile.names(parameter), reference.step)
    return replace(reference, raw=raw, is_negative=reverse)


def step_in(unit: str) -> int:
    """Return the size of a step in a unit that corresponds to 1 Hz."""
    return 10 if factor_between(unit, "rpm") is not None else 1


def reference_codes(profile: Profile) -> list[str]:
    """Return the codes of the references and of all words that their conversion and limits use.

    A reference that can only be written is not among them.
    """
    wanted: tuple[Quantity, ...] = (*LIMITS, *MOTOR_DATA, *REFERENCES)
    found = (profile.quantity(quantity) for quantity in wanted)
    codes = [p.code for p in found if p is not None and p.access != "w"]
    codes += scale_codes(profile)
    for parameter in reference_parameters(profile):
        codes += [*depends_on(parameter), *([parameter.rating] if parameter.rating else [])]
        limit = taught_limit(profile, parameter.code)
        codes += [limit.code] if limit is not None else []
    return list(dict.fromkeys(codes))


def _scale_conditions(profile: Profile) -> list[ScaleWhen]:
    return [way.scale_when for way in profile.data.references if way.scale_when is not None]


def scale_codes(profile: Profile) -> list[str]:
    """Return the codes of the words that select the scale of references."""
    return list(dict.fromkeys(when.parameter for when in _scale_conditions(profile)))


def other_scale(profile: Profile, raws: Mapping[str, int]) -> str:
    """Return why references have another scale now, and what to do; empty if not known to."""
    for when in _scale_conditions(profile):
        if when.holds(raws) is False:
            return when.otherwise
    return ""


def taught_limit(profile: Profile, code: str) -> Parameter | None:
    """Return the word with the highest value of a learned reference; None if there is none.

    Its own scale must be learned too, in the unit of the reference.
    """
    way = reference_of(profile, code) if code in profile.taught else None
    if way is None or way.most not in profile.taught:
        return None
    same = profile.taught[way.most].unit == profile.taught[code].unit
    return profile[way.most] if same else None


def no_place(profile: Profile, unit: str) -> str:
    """Return why a drive takes no reference in a unit, and what to do."""
    text = f"No available manual says where {profile.name} takes a reference in {unit}."
    ways = [reference.parameter for reference in profile.data.teachable_references]
    if not ways:
        return f"{text} Give it at the drive."
    code = ways[0]
    if code not in profile.taught:
        return f"{text} Give it at the drive, or teach {code}: L in the panel, or drivepanel teach."
    return (
        f"{text} {code} was taught; R in the panel, or drivepanel teach {code} --reference, makes"
        " it the reference."
    )


def parse_reference(profile: Profile, text: str, readings: Mapping[str, Shown]) -> Reference:
    """Convert a typed reference and check it against the limits that are known.

    Raises as `convert_reference`, and ValueRefused if it is outside the limits.
    """
    found = convert_reference(profile, text, readings)
    _check_limits(ReferenceUnits(profile, readings), found)
    if (limit := taught_limit(profile, found.parameter.code)) is not None:
        _check_taught_limit(found.number, limit, readings)
    return found


def convert_reference(profile: Profile, text: str, readings: Mapping[str, Shown]) -> Reference:
    """Convert a typed reference to a raw value; a number without a unit is in the drive's unit.

    The motor data of the drive (pole pairs, the value of 100 %) convert between units. Raises
    ValueRefused if the text is not a reference, or its unit cannot be converted. Raises
    ValueUndetermined if the drive has no word for it, or its scale was not read or has changed.
    """
    match = _TYPED.fullmatch(text.strip())
    if match is None:
        raise ValueRefused(f"{text!r} is not a reference. Write it like 30, 30.5Hz or 900rpm.")
    typed, unit = Decimal(match[1].replace(",", ".")), spelled((match[2] or "").strip())
    known = ReferenceUnits(profile, readings)
    if not reference_parameters(profile):
        raise ValueUndetermined(no_place(profile, unit or "Hz"))
    if typed < 0:
        raise ValueRefused("A reference cannot be negative. Run reverse instead.")
    parameter, number = _placed(known, text, typed, unit)
    raws, absent = known.raws, known.absent
    if refusal := other_scale(profile, raws):
        raise ValueUndetermined(refusal)
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
    """Describe the difference between the value read back and the requested one; empty if none.

    The request is converted once more, with what was just read. So a scale, a unit or a rating
    that has changed since shows as a difference. Raises as `convert_reference`.
    """
    code = wanted.parameter.code
    now, reading = convert_reference(profile, wanted.requested, readings), readings.get(code)
    value = reading_of(reading).value if reading is not None else None
    if value is None or value.number is None:
        why = reading.error if reading else ""
        return f"{code} could not be read back: {why}" if why else f"{code} could not be read back"
    same = now.parameter.code == code and value.unit == now.unit
    expected = -now.number if wanted.is_negative else now.number
    if same and abs(value.number - expected) <= min(now.step, wanted.step):
        return ""
    if same and wanted.is_converted:
        known, unit = ReferenceUnits(profile, readings), wanted.requested.rpartition(" ")[2]
        number = known.converted(value.number, value.unit, unit, known.whole(wanted.parameter))
        if number is not None:
            return (
                f"{code} holds {value.display} ({_tidy(number)} {unit}), {wanted.requested} was"
                " requested"
            )
    return f"{code} holds {value.display}, {wanted.requested} was requested"


def reference_limits(
    profile: Profile, readings: Mapping[str, Shown], parameter: Parameter
) -> tuple[Decimal | None, Decimal | None, str]:
    """Return the lowest and highest reference in the drive's unit, and the code of the highest.

    A limit that is not known is None.
    """
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
    """Return a number in the drive's unit, limited to the known limits; 0 at least."""
    low, high, _ = reference_limits(profile, readings, parameter)
    if high is not None:
        number = min(number, high)
    return max(number, low or Decimal(0))


def _placed(
    known: ReferenceUnits, text: str, typed: Decimal, unit: str
) -> tuple[Parameter, Decimal]:
    """Return the word that takes a reference in this unit, and the number in the word's unit.

    Raises ValueRefused.
    """
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
    raise ValueRefused(
        f"{text!r} cannot be converted: {places[0].code} takes its reference in"
        f" {any_of(_accepted(known))}. Type it like {EXAMPLES.get(own, f'5{own}')}."
    )


def _accepted(known: ReferenceUnits) -> list[str]:
    """Return the units in which a reference can be given now, the drive's own first."""
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
                f"{given} is below {code} = {most:f} {unit}: the drive would run at {code}."
            )


def _check_taught_limit(number: Decimal, limit: Parameter, readings: Mapping[str, Shown]) -> None:
    """Raise ValueRefused above the limit; one that cannot be read is left to the drive."""
    reading = readings.get(limit.code)
    value = reading_of(reading).value if reading is not None else None
    if value is None or value.number is None or not value.taught:
        return
    if number > abs(value.number):
        raise ValueRefused(
            f"{number:f} {value.unit} is above {limit.code} = {abs(value.number):f} {value.unit}."
        )


def _tidy(number: Decimal) -> str:
    """Format a number for a sentence, with DECIMALS_CONVERTED decimals at most."""
    return f"{_shortened(number, ROUND_HALF_UP):f}"


def _shortened(number: Decimal, rounding: str) -> Decimal:
    """Round a number to DECIMALS_CONVERTED decimals; keep one that has no more."""
    if -int(number.as_tuple().exponent) <= DECIMALS_CONVERTED:
        return number
    short = number.quantize(Decimal(1).scaleb(-DECIMALS_CONVERTED), rounding).normalize()
    return short if int(short.as_tuple().exponent) <= 0 else short.quantize(Decimal(1))


def _code(profile: Profile, quantity: Quantity) -> str:
    parameter = profile.quantity(quantity)
    return parameter.code if parameter else quantity
