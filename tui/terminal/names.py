"""Textual 8.2's names of keys, from the characters that a terminal sends.

Textual's own tables are used unless terminals contradict each other, so that names agree with
Textual.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Final

from textual._ansi_sequences import ANSI_SEQUENCES_KEYS, IGNORE_SEQUENCE
from textual._keyboard_protocol import FUNCTIONAL_KEYS
from textual.keys import Keys, _character_to_key

STOP_KEYS: Final = frozenset({"space", "f12", "f9"})
"""Keys that stop a motor."""

UNSHIFTED_DIGITS: Final = dict(zip("&é\"'(è_çà", "123457890", strict=True))
"""Digits by the character that their key sends without Shift on a French keyboard (AZERTY).

Its 6 sends a minus, which is a sign in a number and a key of some screens.
"""

Named = tuple[str, str | None]
"""A key as Textual names it, and the character it types, if any."""

SPACE: Final = ("space", " ")
SPACE_ALONE: Final = ("space", None)
"""Space after an ESC that may have been the key Escape: a stop, never text."""

VT100_PLUS: Final = {f"\x1bO{final}": f"f{n}" for n, final in enumerate("TUVWXYZ[", 5)}
"""PuTTY's VT100+ mode from F5 on; F1 to F4 are those of an xterm."""

SCO: Final = {
    "\x1b[M": "f1",
    "\x1b[N": "f2",
    **{f"\x1b[{final}": f"f{n}" for n, final in enumerate("TUVWX", 8)},
}
"""PuTTY's SCO mode and the old BSD and SCO consoles, except ambiguous sequences.

ESC [ U was Page Down on a Mach console; a stop there is the lesser evil.
"""

FOCUS_REPORTS: Final = ("\x1b[I", "\x1b[O")
"""Reports that the terminal's window got or lost the focus; in SCO mode, PgUp and F3."""

AMBIGUOUS: Final = frozenset({*FOCUS_REPORTS, "\x1b[P", "\x1b[Q", "\x1b[R", "\x1b[S"})
"""SCO's F4 to F7 are F1 to F4 in the kitty protocol, and one is Pause on a Linux console."""

_MODIFIED = re.compile(
    r"\x1b\[(\d{0,7})((?::\d{0,7}){0,2})"  # the key, and what it is with Shift
    r"(?:;(\d{0,4})(?::(\d?))?)?"  # modifiers, and whether it was pressed or let go
    r"(?:;([\d:]{0,16}))?([~A-HPQRSu])",
    re.ASCII,
)
_MODIFIERS = {1: "shift", 2: "alt", 4: "ctrl", 8: "super", 16: "hyper", 32: "meta"}
_SHIFT, _CTRL = 1, 4
_LOCKS = 64 | 128
_RELEASED = 3
_OTHER_KEYS = 27
"""xterm's modifyOtherKeys: ESC [ 27 ; modifiers ; character ~"""


def unshifted_digit(character: str) -> str:
    """Return the digit of a key that sends another character without Shift, else the character."""
    return UNSHIFTED_DIGITS.get(character, character)


def character_name(character: str) -> Named | None:
    """The key that sends this character; None if no key sends it."""
    value = ANSI_SEQUENCES_KEYS.get(character)
    if isinstance(value, tuple) and character < "\x80":
        return value[0].value, character
    if not character.isprintable():
        return None
    return _character_to_key(character), character


def with_alt(character: str) -> Named:
    """The key of ESC and a character read together; never the character alone."""
    value = ANSI_SEQUENCES_KEYS.get(f"\x1b{character}")
    if isinstance(value, tuple):
        return value[0].value, None
    if isinstance(value, str):
        return _character_to_key(value), value
    plain = character_name(character)
    key = plain[0] if plain else "unknown"
    return f"alt+{key}", None


@lru_cache(maxsize=512)
def sequence_name(sequence: str, *, kitty: bool = False) -> Named | None:
    """The key of a complete sequence; None if it is not a key or not known.

    With the `kitty` protocol, ESC [ P to ESC [ S are F1 to F4.
    """
    if sequence in AMBIGUOUS and not (kitty and sequence not in FOCUS_REPORTS):
        return None
    if name := VT100_PLUS.get(sequence) or SCO.get(sequence):
        return name, None
    value = ANSI_SEQUENCES_KEYS.get(sequence)
    if value is IGNORE_SEQUENCE:
        return None
    if ";" in sequence:
        return _modified(sequence)
    if isinstance(value, str):
        return _character_to_key(value), value
    if isinstance(value, tuple) and len(value) == 1:
        return value[0].value, "\r" if value[0] is Keys.Enter else None
    return _modified(sequence)


def _modified(sequence: str) -> Named | None:
    """A key with its modifiers as numbers: those of an xterm, or of the kitty protocol."""
    if (match := _MODIFIED.fullmatch(sequence)) is None:
        return _only_listed(sequence)
    code, shifted, modifiers, event, text, final = match.groups(default="")
    if event and int(event) == _RELEASED:
        return None
    bits = (max(1, int(modifiers or 1)) - 1) & ~_LOCKS
    if final == "~" and code == str(_OTHER_KEYS) and text.isdecimal():
        return _typed(int(text), bits, "")
    if name := FUNCTIONAL_KEYS.get(f"{code or 1}{final}"):
        plain = {"enter": "\r", "tab": "\t", "backspace": "\x7f"}.get(name)
        return (name, plain) if not bits else (_chord(bits, name), None)
    if final == "u" and code and int(code) >= ord(" "):
        return _typed(int(code), bits, text or (shifted.split(":")[1:2] or [""])[0])
    return _only_listed(sequence)


def _only_listed(sequence: str) -> Named | None:
    """A sequence with modifiers that only Textual's table has."""
    value = ANSI_SEQUENCES_KEYS.get(sequence)
    return (value[-1].value, None) if isinstance(value, tuple) and len(value) == 1 else None


def _typed(code: int, bits: int, text: str) -> Named | None:
    """A character that was sent as a number, with modifiers."""
    if name := FUNCTIONAL_KEYS.get(f"{code}u"):
        return (_chord(bits, name), None) if bits else character_name(chr(code))
    try:
        character = chr(int(text)) if text.isdecimal() else chr(code)
    except (ValueError, OverflowError):
        return None
    if bits == _CTRL and character.isascii() and character.isalpha():
        return character_name(chr(ord(character) & 0x1F))
    if bits & ~_SHIFT:
        plain = character_name(character)
        return (_chord(bits, plain[0]), None) if plain else None
    if bits == _SHIFT and not text and character.isascii():
        character = character.upper()
    return character_name(character)


def _chord(bits: int, name: str) -> str:
    held = sorted(word for bit, word in _MODIFIERS.items() if bits & bit)
    return "+".join([*held, name])
