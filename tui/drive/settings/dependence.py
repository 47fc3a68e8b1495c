"""Edits that must not be written because one they depend on was not; pure functions."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from ..profile.profile import Profile
from ..shown import number_of
from .edits import Edit, Edits
from .limits import limit_pairs, multiple_limits, number_in, passed_side
from .multiple import value_of


def builds_on(
    profile: Profile,
    edit: Edit,
    missed: Collection[str],
    edits: Edits,
    raws: Mapping[str, int],
) -> str:
    """The missed edit that this one builds on, by its code; empty where there is none.

    `missed` are codes of edits that the drive did not take, `edits` all that were to be written,
    `raws` what the drive holds now. An edit builds on what gives it its scale, on what changes
    other settings as it is written, and on a limit that it would pass as long as that stays.
    """
    follows = profile[edit.code].scale_by
    if follows is not None and follows.parameter in missed:
        return follows.parameter
    for code in missed:
        if profile[code].resets_others:
            return code
    # of what was refused it may not be known what the drive holds now: what it held before
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
