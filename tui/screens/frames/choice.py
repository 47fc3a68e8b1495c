"""Which frames are shown: by drive, function, errors, and what they say. Pure.

A request and what followed it until the next one are an exchange, chosen or left as a whole: a
refusal without its request would show little.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tui.bus.api import Frame
from tui.session.listening.words import FUNCTION_NAMES
from tui.wire.frames import pdu_of
from tui.wire.observed.pairing import BROADCAST_DEVICE

from .decoded import EXCEPTION_BIT

ERRORS = frozenset({"error", "errors"})
MOST_DIGITS = 9
"""Of what is taken for a number; Python counts no number of thousands of them."""
TellFrames = Callable[[Sequence[Frame]], Sequence[str]]
"""Return the text of frames, a sentence each."""


@dataclass(frozen=True, slots=True)
class FrameChoice:
    """Typed filter: `2 read error RFR`. All of it must hold; of several drives one is enough."""

    devices: frozenset[int] = frozenset()
    functions: frozenset[int] = frozenset()
    errors: bool = False
    """True if only what went wrong is meant: refusals, damage, noise, silence."""
    words: tuple[str, ...] = ()
    """Words required in the sentence, the note or the bytes of one of its frames."""

    @property
    def is_all(self) -> bool:
        """True if every frame is chosen."""
        return self == FrameChoice()


def choice_of(text: str) -> FrameChoice:
    """Parse a filter: numbers are drives, `f16` and names of functions are functions."""
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
    """Return True if it is a number; more digits than any has are searched for unchanged."""
    return word.isascii() and word.isdigit() and len(word) <= MOST_DIGITS


def exchanges(frames: Sequence[Frame]) -> list[list[int]]:
    """Places of frames that belong together; what comes before the first request is one too."""
    found: list[list[int]] = []
    for at, frame in enumerate(frames):
        if frame.direction == "out" or not found:
            found.append([])
        found[-1].append(at)
    return found


def chosen(
    frames: Sequence[Frame], wanted: FrameChoice, tell: TellFrames, *, tcp: bool
) -> list[int]:
    """Places of the frames that are chosen, in their order."""
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
    """Return True if drive, function and errors are those that are wanted."""
    parts = [pdu for frame in group if (pdu := pdu_of(frame.data, tcp=tcp)) is not None]
    if wanted.devices and not wanted.devices & {pdu.device for pdu in parts}:
        return False
    if wanted.functions and not wanted.functions & {p.function & ~EXCEPTION_BIT for p in parts}:
        return False
    return not wanted.errors or went_wrong(group, tcp=tcp, last=last)


def went_wrong(group: Sequence[Frame], *, tcp: bool, last: bool) -> bool:
    """Return True if an exchange was refused, disturbed or not answered; the `last` may still
    be."""
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
