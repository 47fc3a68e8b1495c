"""Filter of frames by drive, function, errors and text. Pure functions.

A request and everything up to the next request form an exchange. A filter shows or hides whole
exchanges, because a refusal without its request explains little.
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
