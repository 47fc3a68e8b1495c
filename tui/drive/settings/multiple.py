"""Value of a limit or a factory setting that is a multiple of another parameter."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from decimal import ROUND_FLOOR, Decimal

from ..profile.profile import Profile
from ..profile.schema import Multiple, Parameter
from ..shown import number_of
from ..values import engineering


def counts_of(
    profile: Profile,
    parameter: Parameter,
    of: Multiple,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> int | None:
    """Return the multiple as a raw value, truncated to a whole count; None if not known.

    With a table instead of a multiple, it is the value of the present entry.
    """
    raw, scale = raws.get(of.parameter), profile.scale(parameter, raws, absent)
    if raw is None or scale is None:
        return None
    if of.raws:
        return of.raws.get(str(raw))
    number = number_of(profile, profile[of.parameter], raw, raws, absent)
    # a rated current of 0 is not a valid rating
    if number is None or (number == 0 and Decimal(of.plus) == 0):
        return None
    counts = (Decimal(of.times) * number + Decimal(of.plus) - Decimal(parameter.offset)) / scale
    return int(counts.to_integral_value(ROUND_FLOOR))


def value_of(
    profile: Profile,
    parameter: Parameter,
    of: Multiple,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> Decimal | None:
    """Return the multiple in the parameter's unit, truncated to a count; None if not known."""
    counts = counts_of(profile, parameter, of, raws, absent)
    scale = profile.scale(parameter, raws, absent)
    return None if counts is None or scale is None else engineering(counts, scale, parameter.offset)


def formula_of(of: Multiple) -> str:
    """Return the formula: `1.5 x INV`, `100 - tA1`."""
    if of.raws:
        return f"the limit by {of.parameter}"
    times, plus = Decimal(of.times), Decimal(of.plus)
    product = of.parameter if abs(times) == 1 else f"{abs(times):f} x {of.parameter}"
    if times < 0:
        return f"{plus:f} - {product}"
    return f"{product} + {plus:f}" if plus else product
