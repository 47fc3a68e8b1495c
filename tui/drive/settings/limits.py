"""Settings that limit each other, edits beyond a limit, and edits that depend on others."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from decimal import ROUND_FLOOR, Decimal
from functools import lru_cache

from ..profile.profile import UNVERIFIED, Profile
from ..profile.schema import Multiple, Parameter
from ..shown import number_of, shown
from ..values import engineering
from .edits import Edit, Edits
from .writable import is_order


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


# cached because every row of a table calls it, and a profile does not change
@lru_cache(maxsize=32)
def limit_pairs(profile: Profile) -> tuple[tuple[str, str], ...]:
    """Return pairs of codes; the first value must not exceed the second, in the same unit."""
    pairs: dict[tuple[str, str], None] = {}
    for parameter in profile.parameters:
        if parameter.min_from:
            pairs[parameter.min_from, parameter.code] = None
        if parameter.max_from:
            pairs[parameter.code, parameter.max_from] = None
    return tuple(pair for pair in pairs if _comparable(profile, *pair))


def _comparable(profile: Profile, low: str, high: str) -> bool:
    """Return True if both are settings with one unit; commands are checked when they are sent."""
    pair = profile[low], profile[high]
    return pair[0].unit == pair[1].unit and not any(
        is_order(profile, parameter) for parameter in pair
    )


@lru_cache(maxsize=32)
def multiple_limits(profile: Profile) -> tuple[tuple[Parameter, Multiple], ...]:
    """Return the parameters with a multiple of another as their limit: lowest, then highest."""
    return tuple(
        (parameter, of)
        for parameter in profile.parameters
        for of in (parameter.min_of, parameter.max_of)
        if of is not None
    )


def limit_sources(profile: Profile, codes: Iterable[str]) -> set[str]:
    """Return the codes needed to check these against their limits and those they limit."""
    wanted, found = set(codes), set[str]()
    for low, high in limit_pairs(profile):
        if {low, high} & wanted:
            found |= {low, high}
    for parameter, of in multiple_limits(profile):
        if {parameter.code, of.parameter} & wanted:
            found |= {parameter.code, of.parameter}
    return found - wanted


def limits_are_sure(parameter: Parameter) -> bool:
    """Return True if a document of this family states the limits."""
    grounds = parameter.limit_grounds
    known = parameter.confidence if grounds is None else grounds.confidence
    return known not in UNVERIFIED


def edit_problems(profile: Profile, edits: Edits, raws: Mapping[str, int]) -> dict[str, str]:
    """Return, by code, why an edit contradicts a limit after all edits."""
    after = edits.after(raws)
    found: dict[str, str] = {}
    for low, high in limit_pairs(profile):
        if low not in edits and high not in edits:
            continue
        least, most = (number_in(profile, code, after) for code in (low, high))
        if least is None or most is None or least <= most:
            continue
        code, other, side = (low, high, "above") if low in edits else (high, low, "below")
        texts = [shown(profile, profile[c], after[c], after).display for c in (code, other)]
        found[code] = (
            f"{code} = {texts[0]} would be {side} {other} = {texts[1]}. Change {other} as well, or"
            " use another value."
        )
    found.update(_past_multiples(profile, edits, after))
    return found


def _past_multiples(
    profile: Profile, edits: Edits, after: Mapping[str, int]
) -> Iterator[tuple[str, str]]:
    """Yield code and reason of each edit beyond a limit that is a multiple of another parameter."""
    for parameter, of in multiple_limits(profile):
        code = parameter.code
        if code not in edits and of.parameter not in edits:
            continue
        number, limit = number_in(profile, code, after), value_of(profile, parameter, of, after)
        if number is None or limit is None:
            continue
        if (side := passed_side(parameter, of, number, limit)) == "":
            continue
        held = shown(profile, parameter, after[code], after).display
        reported = f"{code} = {held} would be {side} {limit:f} {parameter.unit}".rstrip()
        text = _BEYOND if limits_are_sure(parameter) else _BEYOND_DOUBTED
        text = text.format(change=reported, formula=formula_of(of))
        yield code if code in edits else of.parameter, text


_BEYOND = "{change} ({formula})."
_BEYOND_DOUBTED = "{change} ({formula}; no document of this family states this limit)."


def passed_side(parameter: Parameter, of: Multiple, number: Decimal, limit: Decimal) -> str:
    """Return on which side a number exceeds a limit: `below`, `above`, or empty for neither."""
    if of is parameter.min_of and number < limit:
        return "below"
    return "above" if of is parameter.max_of and number > limit else ""


def number_in(profile: Profile, code: str, raws: Mapping[str, int]) -> Decimal | None:
    """Return a setting as a number for these raw values; None if they lack it."""
    raw = raws.get(code)
    return None if raw is None else number_of(profile, profile[code], raw, raws)


def builds_on(
    profile: Profile,
    edit: Edit,
    missed: Collection[str],
    edits: Edits,
    raws: Mapping[str, int],
) -> str:
    """Return the code of the failed edit that this one depends on; empty if there is none.

    `missed` are codes of edits that the drive did not accept, `edits` all edits to write, `raws`
    the drive's present values. An edit depends on the source of its scale, on a setting that
    changes others when it is written, and on a limit that it would exceed without that edit.
    """
    if (follows := profile[edit.code].scale_source) in missed:
        return follows
    for code in missed:
        if profile[code].resets_others:
            return code
    # the present value of a refused setting may be unknown: assume the one from before
    held = {e.code: e.old for e in edits if e.code in missed and e.old is not None}
    after = {**held, **raws, **{e.code: e.new for e in edits if e.code not in missed}}
    for low, high in limit_pairs(profile):
        other = high if edit.code == low else low
        if edit.code not in (low, high) or other not in missed:
            continue
        least, most = (
            number_of(profile, profile[code], after[code], after) if code in after else None
            for code in (low, high)
        )
        if least is not None and most is not None and least > most:
            return other
    for parameter, of in multiple_limits(profile):
        other = of.parameter if edit.code == parameter.code else parameter.code
        if edit.code not in (parameter.code, of.parameter) or other not in missed:
            continue
        number = number_in(profile, parameter.code, after)
        limit = value_of(profile, parameter, of, after)
        if number is None or limit is None:
            continue
        if passed_side(parameter, of, number, limit):
            return other
    return ""
