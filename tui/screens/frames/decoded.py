"""Text of frames: drive, function, and parameters with their values."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from tui.bus.api import Frame
from tui.drive.profile.profile import Profile
from tui.drive.sentences import counted
from tui.drive.shown import shown
from tui.drive.values import from_words, word_count
from tui.session.listening.words import FUNCTION_NAMES
from tui.wire.frames import Pdu, pdu_of

READ, READ_INPUT, WRITE_ONE, WRITE_MANY, READ_WRITE = 3, 4, 6, 16, 23
EXCEPTION_BIT = 0x80
CODES_OF_FRAME = 3
"""Maximum parameters of a request that are named; further ones are counted."""

ProfileOf = Callable[[int], Profile | None]
RawsOf = Callable[[int], Mapping[str, int]]
GuessesOf = Callable[[int], Collection[str]]
GUESS = " (guess)"
"""Mark of a value that a simulated drive makes by a guess."""


def no_guesses(_: int) -> Collection[str]:
    """Return the guesses of a real drive: none."""
    return ()


@dataclass(frozen=True, slots=True)
class DecodedRequest:
    """Registers of a read request; needed for its reply, which carries no address."""

    device: int
    function: int
    address: int
    count: int


def decoded(
    frames: Sequence[Frame],
    profile_of: ProfileOf,
    raws_of: RawsOf,
    guesses_of: GuessesOf = no_guesses,
    *,
    tcp: bool,
) -> list[str]:
    """Return a text for each frame; empty if its bytes cannot be decoded.

    A reply to a read is decoded with the last request, which has the address. Values of a reply are
    marked if a simulated drive makes them by a guess.
    """
    requested: DecodedRequest | None = None
    found = []
    for frame in frames:
        pdu = pdu_of(frame.data, tcp=tcp)
        if pdu is None:
            found.append("")
            continue
        space = READ_INPUT if pdu.function == READ_INPUT else READ
        device = pdu.device
        guesses = guesses_of(device) if frame.direction == "in" else ()
        words = _Words(device, profile_of(device), raws_of(device), space, guesses)
        try:
            if frame.direction == "out":
                requested = _requested(pdu)
                found.append(_request(pdu, words))
            else:
                found.append(_reply(pdu, requested, words))
        except (struct.error, IndexError):
            found.append("")  # too short to decode: the list shows the bytes
    return found


def _requested(pdu: Pdu) -> DecodedRequest | None:
    if pdu.function not in (READ, READ_INPUT, READ_WRITE):
        return None
    address, count = struct.unpack_from(">HH", pdu.body)
    return DecodedRequest(pdu.device, pdu.function, address, count)


def _request(pdu: Pdu, words: _Words) -> str:
    who, name = pdu.device or "all", FUNCTION_NAMES.get(pdu.function, f"function {pdu.function}")
    head = f"{who} {name}"
    match pdu.function:
        case 3 | 4:
            address, count = struct.unpack_from(">HH", pdu.body)
            return f"{head} {words.names(address, count)}"
        case 6:
            address, raw = struct.unpack_from(">HH", pdu.body)
            return f"{head} {words.values(address, [raw], '←')}"
        case 16:
            address, count = struct.unpack_from(">HH", pdu.body)
            raws = struct.unpack_from(f">{count}H", pdu.body, 5)
            return f"{head} {words.values(address, raws, '←')}"
        case 23:
            address, count, target, written = struct.unpack_from(">HHHH", pdu.body)
            raws = struct.unpack_from(f">{written}H", pdu.body, 9)
            return f"{head} {words.names(address, count)}; {words.values(target, raws, '←')}"
    return head


def _reply(pdu: Pdu, requested: DecodedRequest | None, words: _Words) -> str:
    if pdu.function & EXCEPTION_BIT:
        function = pdu.function & ~EXCEPTION_BIT
        name = FUNCTION_NAMES.get(function, f"function {function}")
        return f"{pdu.device} refuses {name}: exception {pdu.body[0]}"
    if pdu.function in (READ, READ_INPUT, READ_WRITE):
        raws = struct.unpack_from(f">{pdu.body[0] // 2}H", pdu.body, 1)
        if requested is None or (requested.device, requested.function) != (
            pdu.device,
            pdu.function,
        ):
            return f"{pdu.device} {len(raws)} words"
        return f"{pdu.device} {words.values(requested.address, raws)}"
    if pdu.function == WRITE_ONE:
        return f"{pdu.device} wrote {words.values(*_one(pdu))}"
    if pdu.function == WRITE_MANY:
        address, count = struct.unpack_from(">HH", pdu.body)
        return f"{pdu.device} wrote {words.names(address, count)}"
    return f"{pdu.device} {FUNCTION_NAMES.get(pdu.function, f'function {pdu.function}')}"


def _one(pdu: Pdu) -> tuple[int, list[int]]:
    address, raw = struct.unpack_from(">HH", pdu.body)
    return address, [raw]


@dataclass(frozen=True, slots=True)
class _Words:
    """Decodes registers of one drive to parameters, as far as its profile defines them."""

    device: int
    profile: Profile | None
    raws: Mapping[str, int]
    function: int = READ
    guesses: Collection[str] = ()

    def names(self, address: int, count: int) -> str:
        """Return the codes of the parameters at these registers; the address if all are unknown."""
        found = [code for code, _, _ in self._cut(address, [0] * count)]
        named = [code for code in found if code]
        if not named:
            single, several = "{at} (16#{at:04x}), 1 word", "{at} (16#{at:04x}), {count} words"
            return counted(count, single, several, at=address)
        more = len(found) - CODES_OF_FRAME
        codes = " ".join(code or "?" for code in found[:CODES_OF_FRAME])
        return f"{codes} + {more} more" if more > 0 else codes

    def values(self, address: int, raws: Sequence[int], sign: str = "") -> str:
        """Return the parameters with their values; `sign` precedes each value."""
        parts = []
        for code, text, where in self._cut(address, raws):
            mark = GUESS if code in self.guesses else ""
            parts.append(f"{code or where} {sign + ' ' if sign else ''}{text}{mark}")
        return " · ".join(parts)

    def _cut(self, address: int, raws: Sequence[int]) -> Iterable[tuple[str, str, str]]:
        """Yield code and value of each parameter; address and raw value of an unknown register."""
        at = 0
        while at < len(raws):
            parameter = self.profile.at(address + at, self.function) if self.profile else None
            if parameter is None or self.profile is None:
                yield "", f"16#{raws[at]:04X}", str(address + at)
                at += 1
                continue
            wide = word_count(parameter)
            part = raws[at : at + wide]
            if len(part) < wide:
                yield parameter.code, f"16#{part[0]:04X}", ""
            else:
                raw = from_words(parameter, list(part))
                yield parameter.code, shown(self.profile, parameter, raw, self.raws).display, ""
            at += wide
