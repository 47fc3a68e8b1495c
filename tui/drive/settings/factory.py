"""Factory setting of a parameter on the present drive, and detection of changes from it.

Some depend on another parameter (50 or 60 Hz), some on the drive's rated current, and some are
known only in words. Uncertain settings count as unchanged.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from ..profile.profile import UNVERIFIED, Profile
from ..profile.schema import Parameter
from ..shown import shown
from ..values import Value
from .limits import counts_of
from .writable import is_setting


def factory_raw(
    profile: Profile, parameter: Parameter, raws: Mapping[str, int], absent: Collection[str] = ()
) -> int | None:
    """Return the raw factory setting, from the drive's values; None if they do not determine it.

    A raw value counts with the factory scale: see `factory_value`.
    """
    by, of = parameter.factory_by, parameter.factory_of
    if by is not None:
        if by.parameter in absent:
            return parameter.factory
        return by.raws.get(str(raws.get(by.parameter)))
    if of is not None:
        return counts_of(profile, parameter, of, raws, absent)
    return parameter.factory


def factory_value(
    profile: Profile, parameter: Parameter, raws: Mapping[str, int], absent: Collection[str] = ()
) -> Value | None:
    """Decode the factory setting with the scale that the drive had when it left the factory.

    A ramp that left the factory with 30 counts of 0.1 s is 3.0 s, independent of the present scale.
    """
    raw = factory_raw(profile, parameter, raws, absent)
    if raw is None:
        return None
    return shown(profile, parameter, raw, _first_scales(profile, parameter, raws, absent), absent)


def factory_sources(parameter: Parameter) -> tuple[str, ...]:
    """Return the codes that must be read to determine the factory setting."""
    by, of = parameter.factory_by, parameter.factory_of
    return tuple(factory_by.parameter for factory_by in (by, of) if factory_by is not None)


def factory_is_sure(parameter: Parameter) -> bool:
    """Return True if a document of this family states the factory setting."""
    grounds = parameter.factory_grounds
    known = parameter.confidence if grounds is None else grounds.confidence
    return known not in UNVERIFIED


def not_factory(
    profile: Profile,
    parameter: Parameter,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> bool:
    """Return True if a setting is known to differ from its factory setting.

    Settings that the drive itself changes by auto-tuning do not count as changed.
    """
    held = raws.get(parameter.code)
    factory = factory_raw(profile, parameter, raws, absent)
    if held is None or factory is None or parameter.set_by_drive:
        return False
    return _differs(profile, parameter, (held, factory), raws, absent) and is_setting(
        profile, parameter
    )


def _differs(
    profile: Profile,
    parameter: Parameter,
    pair: tuple[int, int],
    raws: Mapping[str, int],
    absent: Collection[str],
) -> bool:
    """Return True if the held value means something else than the factory setting; both are raw
    values."""
    held, factory = pair
    if parameter.factory_of is not None:
        # the drive may round its own product differently
        return abs(held - factory) > 1
    if not parameter.scale_source:
        return held != factory
    first = _first_scales(profile, parameter, raws, absent)
    was = shown(profile, parameter, factory, first, absent)
    now = shown(profile, parameter, held, raws, absent)
    # without a scale the values cannot be compared
    return was.unit == now.unit and was.number != now.number


def _first_scales(
    profile: Profile, parameter: Parameter, raws: Mapping[str, int], absent: Collection[str]
) -> Mapping[str, int]:
    """Return the raw values, with the factory settings of the parameter's scale sources."""
    follows = parameter.scale_source
    source = profile[follows] if follows else None
    if source is None or source.factory is None or source.code in absent:
        return raws
    return {**raws, source.code: source.factory}
