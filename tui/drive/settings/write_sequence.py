"""The order in which edits are written to a drive."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from ..profile.profile import Profile
from ..shown import scale_sources
from .edits import Edit, Edits
from .limits import limit_pairs, multiple_limits, number_in
from .writable import line_setting

LAST_OF_THOSE = 9
"""Highest rank of settings that change others when written."""


def ordered(profile: Profile, edits: Edits, raws: Mapping[str, int]) -> list[Edit]:
    """Return the edits in the order of writing.

    Settings that change others come first, then scale sources, then the rest in profile order.
    Limits are written before the values that they would block, and line settings come last.
    """
    places = {parameter.code: place for place, parameter in enumerate(profile.parameters)}
    sources = scale_sources(profile)
    waiting = sorted(
        edits, key=lambda edit: (_rank(profile, edit.code, sources), places[edit.code])
    )
    before = _before(profile, edits, raws)
    done: list[Edit] = []
    while waiting:
        left = {edit.code for edit in waiting}
        free = (edit for edit in waiting if not before.get(edit.code, set()) & left)
        # a cycle of limits arises only if the present values contradict each other
        chosen = next(free, waiting[0])
        waiting.remove(chosen)
        done.append(chosen)
    return done


def _rank(profile: Profile, code: str, sources: Collection[str]) -> int:
    if rank := profile[code].resets_others:
        return rank
    setting = line_setting(profile, code)
    if setting is not None:
        late = {"address": 3, "baud": 2, "format": 2, "parity": 2, "protocol": 2}
        return LAST_OF_THOSE + 1 + 2 + late.get(setting.role, 1)
    return LAST_OF_THOSE + 1 + (0 if code in sources else 1)


def _before(profile: Profile, edits: Edits, raws: Mapping[str, int]) -> dict[str, set[str]]:
    """Return, by code, the codes that must be written before it."""
    after = edits.after(raws)
    found: dict[str, set[str]] = {}
    for low, high in limit_pairs(profile):
        if low not in edits or high not in edits:
            continue
        old_high, new_low = (
            number_in(profile, high, raws),
            number_in(profile, low, after),
        )
        old_low, new_high = (
            number_in(profile, low, raws),
            number_in(profile, high, after),
        )
        down = old_low is not None and new_high is not None and new_high < old_low
        up = old_high is None or new_low is None or new_low > old_high
        if down and not up:
            found.setdefault(high, set()).add(low)
        else:
            found.setdefault(low, set()).add(high)
    for parameter, of in multiple_limits(profile):
        # if a sum limits two settings, the one that decreases comes first
        pair = (parameter.code, of.parameter)
        if of.times.startswith("-") and all(code in edits for code in pair):
            old, new = number_in(profile, pair[1], raws), number_in(profile, pair[1], after)
            grows = old is None or new is None or new > old
            first, then = pair if grows else pair[::-1]
            found.setdefault(then, set()).add(first)
    return found
