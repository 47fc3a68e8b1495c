"""Detection of swapped bytes in a drive's words, from its profile. Pure functions."""

from __future__ import annotations

from .profile.profile import Profile, is_verified
from .profile.schema import Parameter, Quantity
from .values import from_words, is_enumeration, is_field, raw_range
from .words import is_word

USUAL_SETTINGS: tuple[Quantity, ...] = (
    "line_address",
    "high_speed",
    "max_frequency",
    "rated_frequency",
)
"""Roles of settings with a narrow range in every family, which are rarely 0."""

ENOUGH = 5
"""Number of settings to read to detect the byte order."""


def swapped_word(word: int) -> int:
    """Return a word with its two bytes swapped."""
    return (word >> 8 | word << 8) & 0xFFFF


def only_swapped(profile: Profile, parameter: Parameter, raw: int) -> bool | None:
    """Return True if a raw value is valid only with its bytes swapped, False if only unchanged.

    None if both are valid, or neither, or if no manual states the valid values.
    """
    if not _has_limits(profile, parameter):
        return None
    word = raw & 0xFFFF
    if profile.data.reading.unknown_word in (word, swapped_word(word)):
        return None  # the drive's word for "no value"
    came = _makes_sense(profile, parameter, word)
    return None if came == _makes_sense(profile, parameter, swapped_word(word)) else not came


def telling_codes(profile: Profile) -> tuple[str, ...]:
    """Return settings whose values show the byte order; those of the line come first."""
    roles: dict[str, str] = {}
    for setting in profile.data.link.settings:
        roles.setdefault(setting.role, setting.parameter)  # the first port; others may be missing
    first = (profile.get(code) for code in roles.values())
    more = (profile.quantity(quantity) for quantity in USUAL_SETTINGS)
    found = [
        parameter.code
        for parameter in (*first, *more)
        if parameter is not None and _has_limits(profile, parameter)
    ]
    return tuple(dict.fromkeys(found))[:ENOUGH]


def _has_limits(profile: Profile, parameter: Parameter) -> bool:
    """Return True if a manual states the valid values of this whole word."""
    if not is_word(parameter) or is_field(parameter) or parameter.bits:
        return False
    if not is_verified(parameter) or parameter.access == "w":
        return False
    if is_enumeration(parameter):
        return bool(profile.names(parameter))
    grounds = parameter.limit_grounds
    if grounds is not None and grounds.confidence in ("analogy", "unverified"):
        return False
    return parameter.min is not None and parameter.max is not None


def _makes_sense(profile: Profile, parameter: Parameter, word: int) -> bool:
    raw, names = from_words(parameter, [word]), profile.names(parameter)
    if is_enumeration(parameter):
        return raw in names
    low, high = raw_range(parameter)
    return low <= raw <= high or raw in names
