"""Settings that limit each other, and edits that would put one beyond its limit."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from functools import lru_cache

from ..profile.profile import Profile
from ..shown import number_of, shown
from .edits import Edits


# a profile stays as it was loaded, and every row of a table asks
@lru_cache(maxsize=32)
def limit_pairs(profile: Profile) -> tuple[tuple[str, str], ...]:
    """Pairs of codes of which the first must never be above the second, in the same unit."""
    pairs: dict[tuple[str, str], None] = {}
    for parameter in profile.parameters:
        if parameter.min_from:
            pairs[parameter.min_from, parameter.code] = None
        if parameter.max_from:
            pairs[parameter.code, parameter.max_from] = None
    return tuple(pair for pair in pairs if profile[pair[0]].unit == profile[pair[1]].unit)


def edit_problems(profile: Profile, edits: Edits, raws: Mapping[str, int]) -> dict[str, str]:
    """By code, why an edit cannot be applied with the values after all of them."""
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
            f"{code} = {texts[0]} would be {side} {other} = {texts[1]}: change {other} too,"
            " or another value."
        )
    return found


def number_in(profile: Profile, code: str, raws: Mapping[str, int]) -> Decimal | None:
    """What a setting comes to with these raw values; None where they do not have it."""
    raw = raws.get(code)
    return None if raw is None else number_of(profile, profile[code], raw, raws)
