"""Raw values and the register words that hold them, both ways."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from decimal import ROUND_HALF_UP, Decimal

from .errors import ValueRefused, ValueUndetermined
from .plain import plain
from .profile.schema import Parameter

TWO_WORDS = frozenset({"uint32", "int32", "float32"})
"""Types of two registers."""
NOT_A_NUMBER = -(1 << 31)
"""Raw value of a float without a number, or outside the counts of its resolution."""


def is_signed_type(parameter: Parameter) -> bool:
    """Return True if the parameter's type has negative values."""
    return not parameter.type.startswith(("uint", "ascii"))


def _float_counts(parameter: Parameter, raw: int) -> int:
    """Return the counts of the parameter's resolution in the bits of a float."""
    (number,) = struct.unpack(">f", raw.to_bytes(4, "big"))
    if not math.isfinite(number):
        return NOT_A_NUMBER
    counts = int((Decimal(number) / Decimal(parameter.scale)).to_integral_value(ROUND_HALF_UP))
    return counts if abs(counts) < -NOT_A_NUMBER else NOT_A_NUMBER


def _float_bits(parameter: Parameter, raw: int) -> int:
    """Return the bits of the float for counts of the parameter's resolution."""
    packed = struct.pack(">f", float(raw * Decimal(parameter.scale)))
    return int.from_bytes(packed, "big")


def word_count(parameter: Parameter) -> int:
    """Return the number of registers, coils or inputs of the parameter.

    A value has 1 or 2 registers, a text or a group of coils up to 32.
    """
    if parameter.type == "ascii" or parameter.is_bits:
        return parameter.words
    return 2 if parameter.type in TWO_WORDS else 1


def from_words(parameter: Parameter, words: Sequence[int]) -> int:
    """Return the raw value in the parameter's registers, by its sign, word order and bits.

    Of a text, it is the bytes of the registers as one number; of coils, their bits.
    """
    if parameter.is_bits:
        return sum((bit & 1) << place for place, bit in enumerate(words[: parameter.words]))
    if parameter.type == "ascii":
        return int.from_bytes(struct.pack(f">{len(words)}H", *words), "big")
    if word_count(parameter) == 2:
        low, high = words if parameter.low_word_first else reversed(words)
        raw, width = (high << 16) | low, 32
        if parameter.type == "float32":
            return _float_counts(parameter, raw)
    else:
        raw, width = words[0] >> parameter.shift & parameter.mask, 16
    if parameter.type.startswith("int") and raw >= 1 << (width - 1):
        raw -= 1 << width
    return raw


def characters_of(parameter: Parameter, raw: int) -> str:
    """Return the text in the registers of a parameter up to its first null, without spaces after
    it; a byte that is not ASCII becomes `\ufffd`."""
    data = raw.to_bytes(2 * parameter.words, "big")
    if parameter.low_byte_first:
        data = _swapped(data)
    return plain(data.partition(b"\0")[0].decode("ascii", "replace").rstrip())


def _swapped(data: bytes) -> bytes:
    return b"".join(bytes((low, high)) for high, low in zip(data[::2], data[1::2], strict=True))


def raw_of_characters(parameter: Parameter, text: str) -> int:
    """Return the raw value of a text, cut to the parameter's registers and filled with nulls."""
    data = text.encode("ascii", "replace")[: 2 * parameter.words].ljust(2 * parameter.words, b"\0")
    if parameter.low_byte_first:
        data = _swapped(data)
    return int.from_bytes(data, "big")


def is_field(parameter: Parameter) -> bool:
    """Return True if the parameter is only a part of the bits of its register."""
    return parameter.shift != 0 or parameter.mask != 0xFFFF


def to_words(parameter: Parameter, raw: int, held: int | None = None) -> tuple[int, ...]:
    """Return the register words for a raw value; raises ValueRefused if it does not fit.

    `held` is the present word of the drive. It is required for a field of a register, because the
    other bits must be kept.
    """
    low, high = type_range(parameter)
    if not low <= raw <= high:
        raise ValueRefused(f"{parameter.code}: {raw} does not fit {parameter.type}.")
    if parameter.is_bits:
        return tuple(raw >> place & 1 for place in range(parameter.words))
    if parameter.type == "ascii":
        return struct.unpack(f">{parameter.words}H", raw.to_bytes(2 * parameter.words, "big"))
    if word_count(parameter) == 1:
        own = parameter.mask << parameter.shift
        if held is None:
            if is_field(parameter):
                raise ValueUndetermined(
                    f"{parameter.code} is a part of a word, and the other bits were not read."
                )
            held = 0
        return (held & ~own & 0xFFFF | raw << parameter.shift & own,)
    if parameter.type == "float32":
        counts, raw = raw, _float_bits(parameter, raw)
        if _float_counts(parameter, raw) != counts:
            raise ValueRefused(f"{parameter.code}: a float of 32 bits cannot hold it exactly.")
    pair = (raw & 0xFFFF, (raw >> 16) & 0xFFFF)
    return pair if parameter.low_word_first else (pair[1], pair[0])


def type_bits(parameter: Parameter) -> int:
    """Return all bits of the parameter's registers or coils, set."""
    return (1 << bit_count(parameter)) - 1


def bit_count(parameter: Parameter) -> int:
    """Return the number of bits of the parameter's registers, or of its coils."""
    return word_count(parameter) * (1 if parameter.is_bits else 16)


def is_word(parameter: Parameter) -> bool:
    """Return True if the parameter is one register, or a part of one."""
    return word_count(parameter) == 1 and not parameter.is_bits


def unsigned(word: int) -> int:
    """Return a command word as its bits; a negative one has 16."""
    return word & 0xFFFF if word < 0 else word


def raw_of_word(parameter: Parameter, word: int) -> int:
    """Return the raw value of a command word: of a register, a pair of them or coils."""
    return from_words(parameter, [word & 0xFFFF]) if is_word(parameter) else word


def registers_of_word(parameter: Parameter, word: int) -> tuple[int, ...]:
    """Return the registers that a command word is written to, in the order of the drive."""
    return to_words(parameter, raw_of_word(parameter, word))


def type_range(parameter: Parameter) -> tuple[int, int]:
    """Return the lowest and highest raw value that the parameter's type can hold."""
    width = bit_count(parameter)
    if is_field(parameter):
        return 0, parameter.mask
    if parameter.type == "float32":
        return NOT_A_NUMBER + 1, -NOT_A_NUMBER - 1
    if parameter.type.startswith("int"):
        return -(1 << (width - 1)), (1 << (width - 1)) - 1
    return 0, (1 << width) - 1


def hexadecimal(parameter: Parameter, raw: int) -> str:
    """Return the word or words of a raw value in hexadecimal: 16#0237, 16#00010237."""
    digits = (bit_count(parameter) + 3) // 4
    return f"16#{raw & (1 << 4 * digits) - 1:0{digits}X}"
