"""A raw value as a person reads it, given the raw values that its scale and unit follow."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from decimal import Decimal

from .profile import Profile
from .schema import Parameter
from .values import Value, decode


def shown(
    profile: Profile,
    parameter: Parameter,
    raw: int,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> Value:
    """The reading of a raw value; `raws` are raw values by code, `absent` codes the drive lacks."""
    scale = profile.scale(parameter, raws, absent)
    value = decode(parameter, raw, profile.names(parameter), scale)
    if parameter.unit_by is not None and value.number is not None:
        value = replace(value, unit=profile.unit(parameter, raws))
    return value


def number_of(
    profile: Profile,
    parameter: Parameter,
    raw: int,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> Decimal | None:
    """The engineering value of a raw one, a named one too; None while its scale is not known."""
    scale = profile.scale(parameter, raws, absent)
    return None if scale is None else raw * scale


def scale_sources(profile: Profile) -> frozenset[str]:
    """Codes of the parameters that other parameters' scales follow."""
    return frozenset(p.scale_by.parameter for p in profile.parameters if p.scale_by is not None)
