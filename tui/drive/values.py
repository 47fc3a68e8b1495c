"""Raw words and engineering values, both ways, without floats; names of raw values.

A typed value is rounded half away from zero to a value that the drive can hold. A conversion
reports if it was rounded, and if that changed the value.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal, InvalidOperation

from .errors import ValueRefused, ValueUndetermined
from .profile.schema import Bit, Parameter
from .units import factor_between
from .words import (
    NOT_A_NUMBER,
    characters_of,
    from_words,
    hexadecimal,
    is_field,
    is_signed_type,
    to_words,
    type_range,
    word_count,
)

LONGEST_NUMBER = 30
"""Most digits before or after the decimal point of a typed number."""
NOT_AVAILABLE = "-----"
EMPTY_TEXT = "(empty)"
"""Text of registers without characters."""
HALF_A_STEP = Decimal("0.5")
SPARE_DECIMALS = 1
"""Decimals that a scale may have beyond those that its counts need, and keeps: 0.25, 1.5."""
_WITH_UNIT = re.compile(r"(.*\d[.,]?)\s*([^\d\s.,].*)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Value:
    """A decoded raw value: number and unit, or a name, or the bits that are set."""

    raw: int
    number: Decimal | None
    unit: str
    text: str
    """Text for a person, without the unit."""
    taught: bool = False
    """True if its scale was learned; no document states it."""
    unsure: bool = False
    """True if no document states the meaning of such a high raw value; its text ends with `?`."""

    @property
    def display(self) -> str:
        """Text and unit."""
        return f"{self.text} {self.unit}" if self.unit else self.text


@dataclass(frozen=True, slots=True)
class Conversion:
    """A raw value made from a typed one, and if it was rounded."""

    raw: int
    rounded: bool
    lossy: bool = False
    """True if rounding changed the value: it became 0, or one of two equally near values."""


def raw_range(parameter: Parameter) -> tuple[int, int]:
    """Return the lowest and highest raw value that the profile allows, within the type."""
    low, high = type_range(parameter)
    return (
        low if parameter.min is None else parameter.min,
        high if parameter.max is None else parameter.max,
    )


def engineering(raw: int, scale: Decimal, offset: str = "0") -> Decimal:
    """Return the engineering value of a raw value, with `decimals_of(scale)` decimals.

    An offset with more decimals keeps them.
    """
    number, decimals = raw * scale, decimals_of(scale)
    if -int(scale.as_tuple().exponent) > decimals:
        number = number.quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_UP)
    # also at 0, where a negative scale gives -0
    return number if raw and offset == "0" else number + Decimal(offset)


def decimals_of(scale: Decimal) -> int:
    """Return the number of decimals to show for a value of this scale.

    Those of the scale itself (0.1, 0.25). A longer scale (60/32767) gets as many as distinguish two
    adjacent counts, so that a shown value always leads back to its raw value.
    """
    own, needed = max(0, -int(scale.as_tuple().exponent)), max(0, -scale.adjusted())
    return own if own <= needed + SPARE_DECIMALS else needed


USUAL_FULL_SCALE = Decimal(100)
"""Assumed value of a full scale for the width of its decimals: 50 Hz, 100 %, 1500 rpm."""


def possible_decimals(parameter: Parameter) -> int:
    """Return the most decimals that any scale of a parameter has."""
    if parameter.full_scale is not None:
        return decimals_of(USUAL_FULL_SCALE / parameter.full_scale.counts)
    by = parameter.scale_by
    # an offset with more decimals than the scale keeps them
    scales = [parameter.scale, *(by.scales.values() if by is not None else ())]
    scales += [parameter.offset] if "." in parameter.offset else []
    return max(decimals_of(Decimal(scale)) for scale in scales)


def decode(
    parameter: Parameter, raw: int, names: Mapping[int, str], scale: Decimal | None
) -> Value:
    """Decode a raw value.

    The result is its name if it has one, hexadecimal for bit words, else the number with the
    decimals of its scale. Without a scale, it is the raw value itself with unit `raw`.
    """
    if parameter.type == "ascii":
        return Value(raw, None, "", characters_of(parameter, raw) or EMPTY_TEXT)
    if parameter.bits:
        return Value(raw, None, "", hexadecimal(parameter, raw))
    if raw == NOT_A_NUMBER and parameter.type == "float32":
        return Value(raw, None, "", "not a number")
    if (name := names.get(raw)) is not None:
        return Value(raw, None, "", name)
    if is_enumeration(parameter):
        return Value(raw, None, "", f"unknown ({raw})")
    if scale is None:
        return Value(raw, Decimal(raw), "raw", str(raw))
    number = engineering(raw, scale, parameter.offset)
    unsure = parameter.sure_up_to is not None and raw > parameter.sure_up_to
    return Value(raw, number, parameter.unit, f"{number:f}{'?' * unsure}", unsure=unsure)


def is_enumeration(parameter: Parameter) -> bool:
    """Return True if the raw values are names rather than a number."""
    named = bool(parameter.enumeration or parameter.values)
    return (
        named
        and not parameter.unit
        and parameter.scale == "1"
        and parameter.full_scale is None
        and not _is_number(parameter)
    )


def _is_number(parameter: Parameter) -> bool:
    """Return True for a number, even with named special values: its range exceeds the names."""
    if parameter.enumeration or parameter.min is None or parameter.max is None:
        return False
    return parameter.max - parameter.min + 1 > 4 * len(parameter.values)


def set_bits(bits: Sequence[Bit], word: int) -> list[Bit]:
    """Return the named bits that are 1 in a word."""
    return [bit for bit in bits if word >> bit.bit & 1]


def without_named_bits(word: int) -> str:
    """Return the text of a word of whose named bits none is 1."""
    return "no named bit set" if word else "no bit set"


def encode(
    parameter: Parameter, text: str, names: Mapping[int, str], scale: Decimal | None
) -> Conversion:
    """Encode what a person typed: a name, a number with or without unit, or a word.

    Raises ValueRefused when the text is none of these, the scale is not known, the raw
    value is out of the profile's range or sets a reserved bit.
    """
    typed = text.strip()
    if parameter.sure_up_to is not None:
        typed = typed.replace("?", "")  # the mark of such a value, as it is shown
    raw = raw_of_name(typed, names)
    rounded = lossy = False
    if raw is None and typed.lower().startswith(("16#", "0x")):
        raw = _hexadecimal(parameter, typed)
    if raw is None:
        if scale is None:
            source = parameter.scale_source
            text = _SCALE_NOT_READ if source else _OTHER_SCALE_NOT_READ
            text = _NO_FULL_SCALE if parameter.full_scale is not None else text
            raise ValueUndetermined(text.format(code=parameter.code, source=source))
        number = _number(parameter, typed, names)
        counts = (number - Decimal(parameter.offset)) / scale
        raw = int(counts.to_integral_value(ROUND_HALF_UP))
        # the decimals of a long scale are cut where it is shown: what is shown can be typed
        rounded = counts != raw and number != engineering(raw, scale, parameter.offset)
        lossy = rounded and (raw == 0 or abs(counts - raw) >= HALF_A_STEP)
    check_raw(parameter, raw, names, scale)
    return Conversion(raw, rounded, lossy)


_SCALE_NOT_READ = "{code} cannot be written: its scale depends on {source}, which was not read."
_NO_FULL_SCALE = (
    "{code} cannot be written: its full scale is the value of {source}, which is 0 or was not read."
)
_OTHER_SCALE_NOT_READ = (
    "{code} cannot be written: its scale depends on another parameter, which was not read."
)
_OUT_OF_RANGE = "{code}: {value} is out of range, {low} to {high}."
_OUT_OF_DOUBTED_RANGE = (
    "{code}: {value} is out of range, {low} to {high}; no document of this family states these"
    " limits."
)


def check_raw(
    parameter: Parameter, raw: int, names: Mapping[int, str], scale: Decimal | None
) -> None:
    """Raise ValueRefused unless the profile lets the parameter hold this raw value."""
    low, high = raw_range(parameter)
    if not low <= raw <= high and raw not in names:
        ends = (high, low) if scale is not None and scale < 0 else (low, high)
        text = _OUT_OF_DOUBTED_RANGE if _has_doubted_limits(parameter) else _OUT_OF_RANGE
        raise ValueRefused(
            text.format(
                code=parameter.code,
                value=_plain(parameter, raw, scale),
                low=_plain(parameter, ends[0], scale),
                high=_plain(parameter, ends[1], scale),
            )
        )
    to_words(parameter, raw, held=0)
    if is_enumeration(parameter) and raw not in names:
        raise ValueRefused(f"{parameter.code}: {raw} is not one of its values.")
    taken = [bit for bit in parameter.reserved if raw >> bit & 1]
    if taken:
        bits = ", ".join(str(bit) for bit in taken)
        raise ValueRefused(f"{parameter.code}: reserved bit {bits} must stay 0.")


def _plain(parameter: Parameter, raw: int, scale: Decimal | None) -> str:
    if scale is None:
        return f"raw {raw}"
    return f"{engineering(raw, scale, parameter.offset):f} {parameter.unit}".rstrip()


def _has_doubted_limits(parameter: Parameter) -> bool:
    """Return True if no document of the family states the limits."""
    grounds = parameter.limit_grounds
    return grounds is not None and grounds.confidence in ("analogy", "unverified")


def _hexadecimal(parameter: Parameter, typed: str) -> int:
    try:
        word = int(typed[3:] if typed.startswith("16#") else typed[2:], 16)
    except ValueError:
        raise ValueRefused(f"{parameter.code}: {typed!r} is not a hexadecimal word.") from None
    if not 0 <= word < 1 << (16 * word_count(parameter)):
        raise ValueRefused(f"{parameter.code}: {typed} does not fit {parameter.type}.")
    low, high = type_range(parameter)
    return word if word <= high else word - (high - low + 1)


def _number(parameter: Parameter, typed: str, names: Mapping[int, str]) -> Decimal:
    """Parse typed text in the parameter's unit: `3.5`, `3.5 s`, `3500ms`; raises ValueRefused."""
    bare, factor = typed, Decimal(1)
    if match := _WITH_UNIT.fullmatch(typed):
        bare, unit = match[1], match[2].strip()
        known = factor_between(unit, parameter.unit) if parameter.unit else None
        if known is None:
            bare = typed  # told below, or a number such as 1e3
        else:
            factor = known
    try:
        number = Decimal(bare.replace(",", ".").replace(" ", "").replace("_", ""))
    except InvalidOperation:
        number = Decimal("NaN")
    if not number.is_finite():
        choice = ", ".join(list(names.values())[:4])
        if choice:
            raise ValueRefused(f"{parameter.code}: {typed!r} is not one of {choice}.")
        unit = parameter.unit or "counts"
        raise ValueRefused(f"{parameter.code}: {typed!r} is not a number in {unit}.")
    if number and not -LONGEST_NUMBER <= number.adjusted() <= LONGEST_NUMBER:
        # its digits alone would fill the screen, or the memory
        raise ValueRefused(f"{parameter.code}: {typed[:40]!r} is out of range.")
    return factor * number


def percent_of(percent: Decimal, rating: Decimal) -> Decimal:
    """Convert a percentage to the unit of its rating, with its decimals, half away from zero."""
    return (percent * rating / 100).quantize(
        Decimal(1).scaleb(int(rating.as_tuple().exponent)), ROUND_HALF_UP
    )


__all__ = [
    "NOT_AVAILABLE",
    "NOT_A_NUMBER",
    "Conversion",
    "Value",
    "check_raw",
    "decimals_of",
    "decode",
    "encode",
    "engineering",
    "from_words",
    "hexadecimal",
    "is_enumeration",
    "is_field",
    "is_signed_type",
    "percent_of",
    "possible_decimals",
    "raw_range",
    "set_bits",
    "to_words",
    "type_range",
    "word_count",
]


FORMER_WORDS = {
    "analogue": "analog",
    "customised": "customized",
    "optimised": "optimized",
    "synchronisation": "synchronization",
    "travelling": "traveling",
    "stand-by": "standby",
    "lock-out": "lockout",
    "in force": "active",
    "run order": "run command",
    "dc bus kept up": "dc bus maintained",
    "speed kept": "speed maintained",
    "watch over the speed": "speed monitoring",
    "cut on the output side detected": "disconnection on the output side",
}
"""Words of value names in versions up to 0.2.1, and the words that replaced them, case-folded."""


def raw_of_name(typed: str, names: Mapping[int, str]) -> int | None:
    """Return the raw value with that name in any case; None if there is none."""
    folded = typed.casefold()
    found = next((raw for raw, name in names.items() if name.casefold() == folded), None)
    if found is not None:
        return found
    for former, present in FORMER_WORDS.items():
        folded = folded.replace(former, present)
    return next((raw for raw, name in names.items() if name.casefold() == folded), None)
