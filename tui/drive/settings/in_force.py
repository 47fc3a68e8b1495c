"""Present limits of a number: its own, and those that other parameters set."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from decimal import Decimal

from ..profile.profile import Profile
from ..profile.schema import Parameter
from ..shown import number_of
from ..values import engineering, is_enumeration, raw_range
from .edits import Edits
from .limits import edit_problems, limit_pairs, limits_are_sure, value_of


@dataclass(frozen=True, slots=True)
class LimitsInForce:
    """Present lowest and highest value in the parameter's unit; None if not known."""

    low: Decimal | None
    high: Decimal | None
    unit: str
    step: Decimal
    """Value of one count."""
    low_by: str = ""
    """Code of the parameter that sets the lowest value; empty if the limit is fixed."""
    high_by: str = ""
    sure: bool = True
    """False if no document of the family states them; then they are marked with `?`."""

    @property
    def text(self) -> str:
        """The range as text, with the parameters that set its ends."""
        if self.low is None and self.high is None:
            return ""
        # the mark comes first, so that it remains if the end is cut off
        unit = (f" {self.unit}" if self.unit else "") + ("" if self.sure else " ?")
        by_low, by_high = (f" ({by})" if by else "" for by in (self.low_by, self.high_by))
        if self.low is None:
            return f"up to {self.high:f}{unit}{by_high}"
        if self.high is None:
            return f"from {self.low:f}{unit}{by_low}"
        # a parameter that sets both ends is named once, at the end
        first = f"{self.low:f}" if by_low == by_high else f"{self.low:f}{by_low}"
        return f"{first} .. {self.high:f}{unit}{by_high}"


def limits_in_force(
    profile: Profile, parameter: Parameter, raws: Mapping[str, int], absent: Collection[str] = ()
) -> LimitsInForce | None:
    """Return the limits of a number for these raw values; None if it has no number or scale."""
    scale = profile.scale(parameter, raws, absent)
    if parameter.access == "r" or parameter.bits or is_enumeration(parameter) or scale is None:
        return None
    lowest, highest = raw_range(parameter)
    low = None if parameter.min is None else engineering(lowest, scale, parameter.offset)
    high = None if parameter.max is None else engineering(highest, scale, parameter.offset)
    if scale < 0:
        low, high = high, low
    low_by = high_by = ""
    for under, over in limit_pairs(profile):
        other = over if parameter.code == under else under
        if parameter.code not in (under, over) or other not in raws:
            continue
        value = number_of(profile, profile[other], raws[other], raws, absent)
        if value is None:
            continue
        if other == over and (high is None or value < high):
            high, high_by = value, over
        if other == under and (low is None or value > low):
            low, low_by = value, under
    least, most = (
        None if of is None else value_of(profile, parameter, of, raws, absent)
        for of in (parameter.min_of, parameter.max_of)
    )
    if parameter.max_of and most is not None and (high is None or most < high):
        high, high_by = most, parameter.max_of.parameter
    if parameter.min_of and least is not None and (low is None or least > low):
        low, low_by = least, parameter.min_of.parameter
    unit, sure = profile.unit(parameter, raws), limits_are_sure(parameter)
    return LimitsInForce(low, high, unit, abs(scale), low_by, high_by, sure)


def limit_passed(profile: Profile, before: Edits, after: Edits, raws: Mapping[str, int]) -> str:
    """Return a sentence with the limit that the last edit would exceed; empty if none."""
    known = edit_problems(profile, before, raws)
    reported = edit_problems(profile, after, raws)
    return next((text for code, text in reported.items() if known.get(code) != text), "")
