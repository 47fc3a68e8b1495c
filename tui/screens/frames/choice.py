"""Text of frames; their filter by drive, function, errors and text. Pure functions.

A request and everything up to the next request form an exchange. A filter shows or hides whole
exchanges, because a refusal without its request explains little.
"""

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
from tui.wire.frames import BIT_READS, COIL_ON, SPACES, Pdu, bits_of, pdu_of
from tui.wire.observed.pairing import BROADCAST_DEVICE

READ_COILS, READ_INPUTS, READ = 1, 2, 3
WRITE_COIL, WRITE_ONE, WRITE_COILS, WRITE_MANY = 5, 6, 15, 16
READ_WRITE = 23
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
        own = READ_COILS if pdu.function in (WRITE_COIL, WRITE_COILS) else READ
        space = pdu.function if pdu.function in SPACES else own
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
    if pdu.function not in (*SPACES, READ_WRITE):
        return None
    address, count = struct.unpack_from(">HH", pdu.body)
    return DecodedRequest(pdu.device, pdu.function, address, count)


def _request(pdu: Pdu, words: _Words) -> str:
    who, name = pdu.device or "all", FUNCTION_NAMES.get(pdu.function, f"function {pdu.function}")
    head = f"{who} {name}"
    match pdu.function:
        case 1 | 2 | 3 | 4:
            address, count = struct.unpack_from(">HH", pdu.body)
            return f"{head} {words.names(address, count)}"
        case 5 | 6:
            return f"{head} {words.values(*_one(pdu), '←')}"
        case 15:
            address, count = struct.unpack_from(">HH", pdu.body)
            return f"{head} {words.values(address, bits_of(pdu.body[5:], count), '←')}"
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
    if pdu.function in (*SPACES, READ_WRITE):
        known = requested is not None and (requested.device, requested.function) == (
            pdu.device,
            pdu.function,
        )
        if pdu.function in BIT_READS:
            count = requested.count if known and requested is not None else 8 * pdu.body[0]
            raws = bits_of(pdu.body[1:], count)
        else:
            raws = struct.unpack_from(f">{pdu.body[0] // 2}H", pdu.body, 1)
        if requested is None or not known:
            if pdu.function in BIT_READS:
                return f"{pdu.device} {counted(len(raws), '1 bit', '{count} bits')}"
            return f"{pdu.device} {counted(len(raws), '1 word', '{count} words')}"
        return (
            f"{pdu.device} {_kind_of_bits(pdu, len(raws))}{words.values(requested.address, raws)}"
        )
    if pdu.function in (WRITE_COIL, WRITE_ONE):
        return f"{pdu.device} wrote {_kind_of_bits(pdu)}{words.values(*_one(pdu))}"
    if pdu.function in (WRITE_COILS, WRITE_MANY):
        address, count = struct.unpack_from(">HH", pdu.body)
        return f"{pdu.device} wrote {words.names(address, count)}"
    return f"{pdu.device} {FUNCTION_NAMES.get(pdu.function, f'function {pdu.function}')}"


def _kind_of_bits(pdu: Pdu, count: int = 1) -> str:
    """Return what a frame names by address only, with a blank; empty for registers."""
    name = {WRITE_COIL: "coil", READ_COILS: "coil", READ_INPUTS: "input"}.get(pdu.function, "")
    return name and counted(count, f"{name} ", f"{name}s ")


def _one(pdu: Pdu) -> tuple[int, list[int]]:
    address, raw = struct.unpack_from(">HH", pdu.body)
    return address, [int(raw == COIL_ON) if pdu.function == WRITE_COIL else raw]


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
            single, several = "{at} (16#{at:04X}), 1 word", "{at} (16#{at:04X}), {count} words"
            if self.function in BIT_READS:
                single, several = "{at} (16#{at:04X}), 1 bit", "{at} (16#{at:04X}), {count} bits"
            return counted(count, single, several, at=address)
        more = len(found) - CODES_OF_FRAME
        codes = " ".join(code or "?" for code in found[:CODES_OF_FRAME])
        return f"{codes} + {more} more" if more > 0 else codes

    def values(self, address: int, raws: Sequence[int], sign: str = "") -> str:
        """Return the parameters with their values; `sign` precedes each value.

        Without one, = separates an address from its value.
        """
        parts = []
        for code, text, where in self._cut(address, raws):
            mark, between = GUESS if code in self.guesses else "", sign or ("" if code else "=")
            parts.append(" ".join(part for part in (code or where, between, text) if part) + mark)
        return " · ".join(parts)

    def _cut(self, address: int, raws: Sequence[int]) -> Iterable[tuple[str, str, str]]:
        """Yield code and value of each parameter; address and raw value of an unknown register."""
        at = 0
        while at < len(raws):
            parameter = self.profile.at(address + at, self.function) if self.profile else None
            if parameter is None or self.profile is None:
                bit = self.function in BIT_READS
                yield "", str(raws[at]) if bit else f"16#{raws[at]:04X}", str(address + at)
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


ERRORS = frozenset({"error", "errors"})
MOST_DIGITS = 9
"""Maximum digits of a number; int() raises ValueError for thousands of digits."""
TellFrames = Callable[[Sequence[Frame]], Sequence[str]]
"""Returns a text for each frame, in order; empty if a frame has none."""


@dataclass(frozen=True, slots=True)
class FrameChoice:
    """Parsed filter, for example `2 read error RFR`.

    All conditions must hold; of several drives or functions, one is enough.
    """

    devices: frozenset[int] = frozenset()
    functions: frozenset[int] = frozenset()
    errors: bool = False
    """True to choose only exchanges with an error: refusal, damage, noise, no reply."""
    words: tuple[str, ...] = ()
    """Words in lower case; each must occur in the text, note or bytes of a frame."""

    @property
    def is_all(self) -> bool:
        """True if every frame is chosen."""
        return self == FrameChoice()


def choice_of(text: str) -> FrameChoice:
    """Parse a filter; numbers are drives, `f16` and function names are functions.

    `error` or `errors` chooses errors; other words are searched as text.
    """
    devices, functions, words, errors = set[int](), set[int](), [], False
    for word in text.casefold().split():
        if _is_number(word):
            devices.add(int(word))
        elif word in ERRORS:
            errors = True
        elif word[0] == "f" and _is_number(word[1:]):
            functions.add(int(word[1:]))
        elif named := {code for code, name in FUNCTION_NAMES.items() if word in name.split()}:
            functions |= named
        else:
            words.append(word)
    return FrameChoice(frozenset(devices), frozenset(functions), errors, tuple(words))


def _is_number(word: str) -> bool:
    """Return True for a number; one with over `MOST_DIGITS` digits is searched as text."""
    return word.isascii() and word.isdigit() and len(word) <= MOST_DIGITS


def exchanges(frames: Sequence[Frame]) -> list[list[int]]:
    """Group places of frames by exchange; frames before the first request form a group too."""
    found: list[list[int]] = []
    for at, frame in enumerate(frames):
        if frame.direction == "out" or not found:
            found.append([])
        found[-1].append(at)
    return found


def chosen(
    frames: Sequence[Frame], wanted: FrameChoice, tell: TellFrames, *, tcp: bool
) -> list[int]:
    """Return the places of the chosen frames, in ascending order."""
    if wanted.is_all:
        return list(range(len(frames)))
    whole = exchanges(frames)
    found: list[int] = []
    for number, places in enumerate(whole):
        group = [frames[at] for at in places]
        last = number == len(whole) - 1
        if _fits(group, wanted, tcp=tcp, last=last) and _says(group, wanted, tell):
            found += places
    return found


def _fits(group: Sequence[Frame], wanted: FrameChoice, *, tcp: bool, last: bool) -> bool:
    """Return True if an exchange matches the drives, functions and errors of the filter."""
    parts = [pdu for frame in group if (pdu := pdu_of(frame.data, tcp=tcp)) is not None]
    if wanted.devices and not wanted.devices & {pdu.device for pdu in parts}:
        return False
    if wanted.functions and not wanted.functions & {p.function & ~EXCEPTION_BIT for p in parts}:
        return False
    return not wanted.errors or went_wrong(group, tcp=tcp, last=last)


def went_wrong(group: Sequence[Frame], *, tcp: bool, last: bool) -> bool:
    """Return True if an exchange was refused, disturbed or not answered.

    The `last` one may still be answered, and a broadcast never is.
    """
    for frame in group:
        pdu = pdu_of(frame.data, tcp=tcp)
        if frame.note not in ("", "echo") or pdu is None:
            return True
        if frame.direction == "in" and pdu.function & EXCEPTION_BIT:
            return True
    requested = pdu_of(group[0].data, tcp=tcp)
    unanswered = len(group) == 1 and group[0].direction == "out" and not last
    return unanswered and requested is not None and requested.device != BROADCAST_DEVICE


def _says(group: Sequence[Frame], wanted: FrameChoice, tell: TellFrames) -> bool:
    if not wanted.words:
        return True
    message = [
        f"{sentence} {frame.note} {frame.data.hex(' ')} {frame.data.hex()}".casefold()
        for sentence, frame in zip(tell(group), group, strict=True)
    ]
    return all(any(word in text for text in message) for word in wanted.words)
