"""Conversion between raw values and text: the only one for screen, journal and command line.

It needs the raw values of the parameters that scale and unit depend on, and the codes that the
drive lacks. If the scale is unknown, the value is shown raw, never in a possibly wrong unit.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from decimal import Decimal
from functools import lru_cache

from msgspec import structs

from .errors import ValueUndetermined
from .profile.profile import Profile
from .profile.schema import Parameter
from .teaching import TaughtScale
from .values import NOT_A_NUMBER, Conversion, Value, decode, encode, engineering


def shown(
    profile: Profile,
    parameter: Parameter,
    raw: int,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> Value:
    """Decode a raw value; `raws` are raw values by code, `absent` codes that the drive lacks."""
    if (taught := profile.taught.get(parameter.code)) is not None:
        return _taught_value(raw, taught)
    scale = profile.scale(parameter, raws, absent)
    value = decode(parameter, raw, profile.names(parameter), scale)
    if parameter.unit_by is not None and value.number is not None:
        value = replace(value, unit=profile.unit(parameter, raws))
    return value


def raw_of_text(
    profile: Profile,
    parameter: Parameter,
    text: str,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> Conversion:
    """Encode typed text as a raw value; every write uses this, as every read uses `shown`.

    Raises ValueRefused as `encode` does, ValueUndetermined if the unit or the sign is unknown.
    """
    if parameter.unit_by is not None and (unit := profile.unit(parameter, raws)) != parameter.unit:
        if unit == "raw":
            follows = parameter.unit_by.parameter
            raise ValueUndetermined(
                f"{parameter.code} cannot be written: its unit depends on {follows}, which was not"
                " read."
            )
        parameter = structs.replace(parameter, unit=unit)
    scale = profile.scale(parameter, raws, absent)
    found = encode(parameter, text, profile.names(parameter), scale)
    taught = profile.taught.get(parameter.code)
    if taught is not None and taught.number(found.raw) is None:
        raise ValueUndetermined(
            f"{text} may be wrong for {parameter.code}: the sign of such values was not learned."
        )
    return found


def _taught_value(raw: int, taught: TaughtScale) -> Value:
    """Decode a word with a learned scale; the result is raw while the sign is not known."""
    number = taught.number(raw)
    if number is None:
        return Value(raw, Decimal(raw), "raw", str(raw))
    return Value(raw, number, taught.unit, f"{number:f}", taught=True)


def shown_text(
    profile: Profile,
    parameter: Parameter,
    raw: int | None,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> str:
    """Return a raw value as text with its unit; empty if there is no value."""
    return "" if raw is None else shown(profile, parameter, raw, raws, absent).display


def typed_text(
    profile: Profile,
    parameter: Parameter,
    raw: int,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> str:
    """Return a raw value as a person types it: hexadecimal for bit words, else a number."""
    if parameter.bits:
        return shown(profile, parameter, raw, raws, absent).text
    number = number_of(profile, parameter, raw, raws, absent)
    return str(raw) if number is None else f"{number:f}"


def depends_on(parameter: Parameter) -> tuple[str, ...]:
    """Return the codes that must be read, or known as missing, to show a value in its unit."""
    scale = parameter.scale_source
    unit = parameter.unit_by.parameter if parameter.unit_by else ""
    return tuple(code for code in (scale, unit) if code)


def number_of(
    profile: Profile,
    parameter: Parameter,
    raw: int,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> Decimal | None:
    """Return the engineering value of a raw value, even if named; None if the scale is unknown.

    A text has none.
    """
    if (taught := profile.taught.get(parameter.code)) is not None:
        return taught.number(raw)
    scale = None if parameter.type == "ascii" else profile.scale(parameter, raws, absent)
    if scale is None or (raw == NOT_A_NUMBER and parameter.type == "float32"):
        return None
    return engineering(raw, scale, parameter.offset)


@lru_cache(maxsize=32)  # asked for once a row of a table of settings
def scale_sources(profile: Profile) -> frozenset[str]:
    """Return the codes of the parameters that other parameters' scales depend on."""
    return frozenset(p.scale_source for p in profile.parameters if p.scale_source)
