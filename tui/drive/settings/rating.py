"""Rating of drive and motor: the settings that depend on it, and a comparison of two drives."""

from __future__ import annotations

from ..profile.profile import Profile
from ..profile.schema import Parameter, Quantity
from .parameter_set import ParameterSet
from .restore_plan import Held

RATED: frozenset[Quantity] = frozenset(
    {
        "rated_frequency",
        "rated_voltage",
        "rated_current",
        "rated_speed",
        "motor_poles",
        "thermal_current",
        "switching_frequency",
    }
)
"""Quantities that depend on the rating of drive and motor."""


def rating_codes(profile: Profile) -> list[str]:
    """Return the codes of read-only words that show the drive's model or rating."""
    current = profile.quantity("drive_current")
    own = current.code if current is not None and current.access == "r" else ""
    return [code for code in (profile.data.identification.model_parameter, own) if code]


def same_rating(
    profile: Profile, held: Held, source: ParameterSet, *, across: bool = False
) -> bool | None:
    """Return True if set and drive have the same rating; None if one does not show its rating."""
    if across:
        return False
    reported = source.head.identity.get("reference", "")
    if reported and held.reference:
        return reported == held.reference
    codes = [c for c in rating_codes(profile) if c in held.raws and c in source.raws]
    return all(held.raws[c] == source.raws[c] for c in codes) if codes else None


def rated(parameter: Parameter) -> bool:
    """Return True if a setting depends on the rating of drive and motor, or on the model."""
    return parameter.rated or parameter.quantity in RATED or parameter.unit in ("A", "kW", "HP")
