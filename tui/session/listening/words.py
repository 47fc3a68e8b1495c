"""Parameters and values in observed requests and replies. Pure functions."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from tui.bus.api import IdentificationObjects
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.shown import shown
from tui.drive.values import Value, from_words, word_count
from tui.wire.frames import BIT_READS, COIL_ON, SPACES, bits_of
from tui.wire.observed.pairing import ObservedExchange

COILS, HOLDING, INPUT = 1, 3, 4
WRITE_COIL, WRITE_WORD, WRITE_COILS, WRITE_WORDS, READ_AND_WRITE, WHO = 5, 6, 15, 16, 23, 43
FUNCTION_NAMES: Mapping[int, str] = {
    COILS: "read coils",
    2: "read inputs",
    HOLDING: "read",
    INPUT: "read input",
    WRITE_COIL: "write coil",
    WRITE_WORD: "write",
    7: "exception status",
    8: "diagnostics",
    WRITE_COILS: "write coils",
    WRITE_WORDS: "write",
    17: "report id",
    READ_AND_WRITE: "read and write",
    WHO: "identify",
}
_OBJECTS_FROM = 7
"""Offset of the objects in a reply to function 43, including the function byte."""


@dataclass(frozen=True, slots=True)
class WordSpan:
    """Adjacent words of a request, either read or written."""

    function: int
    """Function that reads the address space: 1 for coils, 2 for inputs, 4 for input registers,
    else 3."""
    address: int
    count: int
    written: tuple[int, ...] = ()
    """Words written, or coils as 0 and 1; empty for a read."""


@dataclass(frozen=True, slots=True)
class ObservedValue:
    """One parameter, or a word that no profile names, with its value."""

    code: str
    """The parameter's code; the decimal address if no code is known."""
    address: int
    raw: int
    value: Value
    written: bool
    parameter: Parameter | None = None


def spans_of(request: bytes) -> tuple[WordSpan, ...]:
    """Return the words that a request reads and writes; empty if it has none or is cut short."""
    try:
        return tuple(_spans(request))
    except (struct.error, IndexError):
        return ()


def _spans(request: bytes) -> Iterator[WordSpan]:
    function, body = request[0], request[1:]
    if function in SPACES:
        yield WordSpan(function, *struct.unpack_from(">HH", body))
    elif function == WRITE_COIL:
        address, word = struct.unpack_from(">HH", body)
        yield WordSpan(COILS, address, 1, (int(word == COIL_ON),))
    elif function == WRITE_COILS:
        address, count, size = struct.unpack_from(">HHB", body)
        if size == len(body) - 5 == (count + 7) // 8:
            yield WordSpan(COILS, address, count, bits_of(body[5:], count))
    elif function == WRITE_WORD:
        address, word = struct.unpack_from(">HH", body)
        yield WordSpan(HOLDING, address, 1, (word,))
    elif function == WRITE_WORDS:
        address, count = struct.unpack_from(">HH", body)
        yield WordSpan(HOLDING, address, count, struct.unpack_from(f">{count}H", body, 5))
    elif function == READ_AND_WRITE:
        address, count, target, written = struct.unpack_from(">HHHH", body)
        words = struct.unpack_from(f">{written}H", body, 9)
        yield WordSpan(HOLDING, target, written, words)
        yield WordSpan(HOLDING, address, count)


def words_read(exchange: ObservedExchange) -> tuple[int, ...]:
    """Return the words or bits of a good read reply; empty for any other exchange."""
    if exchange.answer != "ok" or exchange.function not in (*SPACES, READ_AND_WRITE):
        return ()
    if exchange.function in BIT_READS:
        return bits_of(exchange.reply[2:], int.from_bytes(exchange.request[3:5], "big"))
    count = exchange.reply[1] // 2
    return struct.unpack_from(f">{count}H", exchange.reply, 2)


def values_of(
    exchange: ObservedExchange, profile: Profile | None, raws: Mapping[str, int]
) -> list[ObservedValue]:
    """Return the values that a request wrote and its reply contains; `raws` are raw values by code.

    Refused values do not count, nor do those that a drive did not confirm, except of a broadcast.
    """
    if exchange.answer not in ("ok", "broadcast"):
        return []
    found: list[ObservedValue] = []
    read = words_read(exchange)
    for span in spans_of(exchange.request):
        words = span.written or read
        if len(words) == span.count:
            found += _cut(span, words, profile, raws)
    return found


def names_of_words(span: WordSpan, profile: Profile | None) -> list[str]:
    """Return the parameters of adjacent words; addresses for unknown ones."""
    return [code for code, _, _, _ in _parts(span, profile)]


def _cut(
    span: WordSpan, words: Sequence[int], profile: Profile | None, raws: Mapping[str, int]
) -> Iterator[ObservedValue]:
    for code, at, parameter, wide in _parts(span, profile):
        word, address, written = words[at], span.address + at, bool(span.written)
        if parameter is None or profile is None or at + wide > span.count:
            value = Value(word, None, "", f"16#{word:04X}")
            yield ObservedValue(code, address, word, value, written, parameter)
            continue
        raw = from_words(parameter, list(words[at : at + wide]))
        value = shown(profile, parameter, raw, raws)
        yield ObservedValue(code, address, raw, value, written, parameter)


def _parts(
    span: WordSpan, profile: Profile | None
) -> Iterator[tuple[str, int, Parameter | None, int]]:
    """Yield code, offset, parameter and width in words of each part of a span."""
    at = 0
    while at < span.count:
        address = span.address + at
        parameter = profile.at(address, span.function) if profile is not None else None
        wide = word_count(parameter) if parameter is not None else 1
        yield (parameter.code if parameter is not None else str(address)), at, parameter, wide
        at += wide


def identity_objects(exchange: ObservedExchange) -> IdentificationObjects | None:
    """Return the identity in an exchange of function 43; None if there is none."""
    if exchange.answer != "ok" or exchange.function != WHO or len(exchange.reply) < _OBJECTS_FROM:
        return None
    objects: dict[int, bytes] = {}
    reply, at = exchange.reply, _OBJECTS_FROM
    for _ in range(reply[_OBJECTS_FROM - 1]):
        if at + 2 > len(reply):
            break
        number, length = reply[at], reply[at + 1]
        content = reply[at + 2 : at + 2 + length]
        if objects.setdefault(number, content) != content:
            return None  # two different contents are ambiguous
        at += 2 + length
    return IdentificationObjects(reply[3], objects)
