"""Initial words of a simulated drive with factory settings, set up for its motor and model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import ROUND_HALF_UP, Decimal

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Model, Parameter, Quantity
from tui.drive.settings.limits import counts_of
from tui.drive.values import is_enumeration, raw_range, type_range
from tui.drive.words import raw_of_characters

from .motor import RatingPlate, rating_of

REFERENCE_OBJECT = 1


def model_words(profile: Profile, identity: Mapping[int, bytes]) -> dict[str, int]:
    """Raw values by code of the model parameter and the class parameter, as far as known."""
    identification = profile.data.identification
    reference = identity.get(REFERENCE_OBJECT, b"").decode("ascii", "replace")
    model = _model(identification.models, reference)
    words: dict[str, int] = {}
    if model is None:
        return words
    if identification.model_parameter:
        words[identification.model_parameter] = model.code
    if identification.class_parameter and identification.class_bit is not None:
        words[identification.class_parameter] = int(model.class_b) << identification.class_bit
    return words


def _model(models: list[Model], reference: str) -> Model | None:
    """The model with this reference, or, where models have none, with its power."""
    named = next((m for m in models if m.reference == reference), None)
    if named is not None or not reference:
        return named
    power = rating_of(reference).power
    unnamed = (m for m in models if not m.reference and m.power_kw)
    return next((m for m in unnamed if _has_power(m, power)), None)


def _has_power(model: Model, power: float) -> bool:
    """Return True if a model has this power: 0.37/0.4 kW by 50 Hz and 60 Hz motors."""
    return any(math.isclose(float(part), power) for part in model.power_kw.split("/"))


def first_values(
    profile: Profile, rating: RatingPlate, line_first: Mapping[str, int]
) -> dict[str, int]:
    """Return a raw value for every parameter: commissioned, factory, from the rating, or the
    lowest.

    `line_first` are raw values by code, in any case, of a drive set up for its line.
    """
    chosen = {code.casefold(): raw for code, raw in line_first.items()}
    for row in profile.data.identification.registers:
        text = raw_of_characters(profile[row.parameter], row.begins[0]) if row.begins else 0
        chosen.setdefault(row.parameter.casefold(), text or row.values[0])
    plate = _plate(rating)
    values: dict[str, int] = {}
    for parameter in profile.parameters:
        raw = chosen.get(parameter.code.casefold())
        if raw is None:
            raw = parameter.factory
        if raw is None and parameter.quantity in plate:
            raw = to_raw(profile, parameter, plate[parameter.quantity])
        if raw is None and parameter.type == "ascii":
            raw = raw_of_characters(parameter, parameter.code)
        values[parameter.code] = _lowest(profile, parameter) if raw is None else raw
    for parameter in profile.parameters:
        full = parameter.full_scale
        if full and parameter.factory is None and parameter.code.casefold() not in chosen:
            # the scale is known now
            value = plate.get(parameter.quantity)
            scale = values[full.parameter] * Decimal(profile[full.parameter].scale) / full.counts
            if value is not None and scale:
                values[parameter.code] = to_raw(profile, parameter, value, scale)
    for parameter in profile.parameters:
        # values that depend on the drive's rated current, once that is known
        if parameter.factory_of is not None and parameter.code.casefold() not in chosen:
            raw = counts_of(profile, parameter, parameter.factory_of, values)
            values[parameter.code] = values[parameter.code] if raw is None else raw
    return values


def _plate(rating: RatingPlate) -> dict[Quantity | None, float]:
    return {
        "rated_frequency": rating.frequency,
        "rated_voltage": rating.voltage,
        "rated_current": rating.current,
        "rated_speed": rating.speed,
        "motor_poles": rating.poles,
        "drive_current": rating.drive_current,
        "thermal_current": rating.current,
        "high_speed": rating.frequency,
        "max_frequency": 1.2 * rating.frequency,
        "low_speed": 0.0,
        "acceleration": 3.0,
        "deceleration": 3.0,
        "acceleration_2": 5.0,
        "deceleration_2": 5.0,
        "switching_frequency": 4.0,
        "preset_speed_1": 10.0,
        "preset_speed_2": 15.0,
        "preset_speed_3": 20.0,
        "preset_speed_4": 25.0,
        "preset_speed_5": 30.0,
        "preset_speed_6": 35.0,
        "preset_speed_7": 40.0,
        "ramp_increment": 1,
    }


def _lowest(profile: Profile, parameter: Parameter) -> int:
    """Return 0, or the nearest value that the parameter allows."""
    if parameter.access == "r":
        return 0
    names = profile.names(parameter)
    if names and is_enumeration(parameter):
        return 0 if 0 in names else min(names, key=abs)
    low, high = raw_range(parameter)
    return min(max(0, low), high)


def to_raw(
    profile: Profile, parameter: Parameter, value: float, scale: Decimal | None = None
) -> int:
    """Return the raw value nearest to an engineering value, within the type.

    The default is the parameter's own scale, as from the factory.
    """
    counts = (Decimal(repr(float(value))) - Decimal(parameter.offset)) / (
        scale or Decimal(parameter.scale)
    )
    low, high = type_range(parameter)
    return min(max(int(counts.to_integral_value(ROUND_HALF_UP)), low), high)
