"""Learning of the scale of a raw word from the drive's own display. Pure.

A look is a raw word with the number that the display showed at the same moment. If exactly one of a
fixed list of scales agrees with every look, that scale is learned.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from enum import StrEnum

from tui.drive.sentences import all_of, any_of

from .errors import ValueRefused

LOOKS_KEPT = 8
"""Most looks kept for one word; a further one replaces the last."""
SIGN_FROM = 0x8000
"""Lowest word that is negative if the word has a sign."""
WORDS = 0x10000
POWERS_OF_TEN = tuple(Decimal(text) for text in ("1", "0.1", "0.01", "0.001", "10", "100"))
USUAL_SCALES = tuple(
    Decimal(f"{Decimal(digits).scaleb(places):f}")
    for places in (0, -1, -2, -3, 1)
    for digits in ("2", "5", "2.5", "6", "3", "1.5", "1.2")
)
"""Steps of 2, 5 and 2.5, and rpm of 1 or 0.1 Hz with 1 to 5 pole pairs."""
SCALES = (*POWERS_OF_TEN, *USUAL_SCALES)
"""Possible values of one count, most likely first."""
UNITS = ("Hz", "rpm", "A", "V", "kW", "W", "%", "s", "ms", "°C", "Nm", "h", "kWh")
"""Usual units of drives, as Drive Panel writes them."""
_ALIASES = {
    "1/min": "rpm", "min-1": "rpm", "tr/min": "rpm", "tr/mn": "rpm", "r/min": "rpm", "°c": "°C",
    "m3/h": "m³/h", "m3/s": "m³/s",
}  # fmt: skip
_TYPED = re.compile(r"([+-]?)(\d{1,7}(?:[.,]\d{1,4})?)\s*(1/min|[^\s\d+\-.,][^\s]{0,7})?")
_UNIT = re.compile(r"[A-Za-zµΩ°%][A-Za-zµΩ°%²³/·]{0,7}")


@dataclass(frozen=True, slots=True)
class DisplayLook:
    """A raw word with the number that the drive's display showed for it."""

    word: int
    """As on the wire, 0 to 65535."""
    shown: Decimal
    """With the decimals of the display."""
    unit: str = ""

    @property
    def text(self) -> str:
        """Word and number as text."""
        return f"raw {self.word} at {self.shown:f} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class TaughtScale:
    """Value of one count of a word, learned from readings of the drive's display."""

    scale: Decimal
    unit: str
    signed: bool | None
    """True if words from 32768 on are negative; None while no look shows it."""

    def number(self, raw: int) -> Decimal | None:
        """Return the value of a raw word; None if its sign is not known."""
        word = raw % WORDS
        if word < SIGN_FROM:
            return word * self.scale
        if self.signed is None:
            return None
        return (word - WORDS if self.signed else word) * self.scale

    @property
    def text(self) -> str:
        """Value of one count as text."""
        return f"1 count is {self.scale:f} {self.unit}".rstrip()


class LessonKind(StrEnum):
    """Result of a reading, by kind."""

    FIRST = "first"
    SAME = "same"
    UNSURE = "unsure"
    TAUGHT = "taught"
    AGREES = "agrees"
    DISAGREES = "disagrees"
    ENDED = "ended"


@dataclass(frozen=True, slots=True)
class Lesson:
    """Result of one more look, with the looks kept and the scale learned."""

    kind: LessonKind
    looks: tuple[DisplayLook, ...]
    text: str
    """The result, and what to do next."""
    scale: TaughtScale | None = None

    @property
    def went_wrong(self) -> bool:
        """True if the looks contradict each other."""
        return self.kind in (LessonKind.DISAGREES, LessonKind.ENDED)


def parse_display(text: str, unit: str = "") -> tuple[Decimal, str]:
    """Parse number and unit as typed: `50.3`, `50,3 Hz`, `-12A`. Raises ValueRefused if invalid."""
    typed = text.strip().replace("\N{MINUS SIGN}", "-")
    match = _TYPED.fullmatch(typed)
    if match is None:
        raise ValueRefused(f"{text!r} is not a displayed value. Write it like 50.3 or -12 A.")
    beside = match[3] or ""
    if beside and unit and unit_named(beside) != unit_named(unit):
        raise ValueRefused(f"Two units: {beside} and {unit}. Type one of them.")
    number = Decimal(match[1] + match[2].replace(",", "."))
    return number, unit_named(beside or unit)


def unit_named(text: str) -> str:
    """Return a unit in its usual spelling; raises ValueRefused if it is not a unit."""
    typed = text.strip()
    folded = typed.casefold()
    if not typed:
        return ""
    if folded in _ALIASES:
        return _ALIASES[folded]
    if (known := next((unit for unit in UNITS if unit.casefold() == folded), None)) is not None:
        return known
    if folded == "raw" or not _UNIT.fullmatch(typed):
        usual = ", ".join(UNITS[:6])
        raise ValueRefused(f"{typed!r} is not a unit. Usual units are {usual}.")
    return typed


def scales_that_fit(looks: Sequence[DisplayLook]) -> list[TaughtScale]:
    """Return every possible scale that agrees with all looks, with its sign."""
    if not looks or (unit := _unit_of(looks)) is None:
        return []
    reported = any(look.word >= SIGN_FROM for look in looks)
    signs: tuple[bool | None, ...] = (False, True) if reported else (None,)
    tried = (TaughtScale(scale, unit, signed) for scale in SCALES for signed in signs)
    return [
        taught_scale for taught_scale in tried if all(_agrees(look, taught_scale) for look in looks)
    ]


def taught_by(looks: Sequence[DisplayLook]) -> TaughtScale | None:
    """Return the scale that alone fits looks at two or more words; None if there is none."""
    if len({look.word for look in looks}) < 2:
        return None
    found = scales_that_fit(looks)
    return found[0] if len(found) == 1 else None


_FIRST_LOOK = "{code}: {look}. Enter another value of the display."
_SAME_LOOK = "{code}: {look} again. Enter another value of the display."


def learn(code: str, before: Sequence[DisplayLook], look: DisplayLook) -> Lesson:
    """Evaluate one more reading of a parameter."""
    known, looks = taught_by(before), _with(before, look)
    if not scales_that_fit(looks):
        return _contradiction(code, tuple(before), look, known)
    scale = taught_by(looks)
    if scale is not None:
        kind = LessonKind.TAUGHT if known is None else LessonKind.AGREES
        seen = ", ".join(item.text for item in looks)
        text = f"{code}: {scale.text} ({seen}). {_sign_text(scale)}"
        return Lesson(kind, looks, text, scale)
    if len({item.word for item in looks}) < 2:
        kind = LessonKind.SAME if before else LessonKind.FIRST
        text = _SAME_LOOK if before else _FIRST_LOOK
        text = text.format(code=code, look=look.text)
        return Lesson(kind, looks, text)
    fits = any_of(
        [*dict.fromkeys(f"{taught_scale.scale:f}" for taught_scale in scales_that_fit(looks))]
    )
    text = f"{code}: 1 count is {fits}. Enter a larger value of the display ({look.text})."
    return Lesson(LessonKind.UNSURE, looks, text)


def _contradiction(
    code: str, before: tuple[DisplayLook, ...], look: DisplayLook, known: TaughtScale | None
) -> Lesson:
    """Return the result for a look that no scale agrees with: it begins a new series."""
    alone = scales_that_fit([look])
    kept = (look,) if alone else ()
    if not alone:
        why = f"No usual scale gives {look.shown:f} for raw {look.word}."
    else:
        why = f"No usual scale fits {all_of([item.text for item in (*before[-2:], look)])}."
    check = "Check that the display shows this parameter, and that its value is steady."
    if known is not None:
        text = f"{code} is shown raw again. {why} Before: {known.text}. {check}"
        return Lesson(LessonKind.ENDED, kept, text)
    text = f"{code}: no scale was learned. {why} {check}"
    return Lesson(LessonKind.DISAGREES, kept, text)


def _with(before: Sequence[DisplayLook], look: DisplayLook) -> tuple[DisplayLook, ...]:
    """Return the looks with one more; a repeated one adds only a unit.

    If there are too many, those that do not change the result are dropped first.
    """
    same = [item for item in before if (item.word, item.shown) == (look.word, look.shown)]
    if same and look.unit in ("", same[0].unit):
        return tuple(before)
    if same and not same[0].unit:
        return tuple(replace(item, unit=look.unit) if item is same[0] else item for item in before)
    looks = (*before, look)
    if len(looks) <= LOOKS_KEPT:
        return looks
    fewer = (looks[:at] + looks[at + 1 :] for at in range(len(looks)))
    return next((some for some in fewer if taught_by(some) == taught_by(looks)), looks[1:])


def _agrees(look: DisplayLook, scale: TaughtScale) -> bool:
    """Return True if a display may show this: it may truncate, round or lag by one digit step."""
    number = scale.number(look.word)
    step = Decimal(1).scaleb(min(0, int(look.shown.as_tuple().exponent)))
    return number is not None and abs(number - look.shown) <= step


def _unit_of(looks: Iterable[DisplayLook]) -> str | None:
    """Return the unit of all looks; None if two differ."""
    units = {look.unit for look in looks if look.unit}
    return None if len(units) > 1 else next(iter(units), "")


def _sign_text(scale: TaughtScale) -> str:
    if scale.signed is None:
        return (
            "The sign is unknown: from raw 32768 on, it is shown raw until you enter such a value"
            " of the display."
        )
    return "It has a sign." if scale.signed else "It has no sign."
