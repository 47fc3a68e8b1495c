"""Abilities of the terminal: characters beyond ASCII, colors, erasing in color.

The locale shows the characters, terminfo (or COLORTERM) the colors. The terminal itself is not
asked, as its answer could take long on a slow link.
"""

from __future__ import annotations

import codecs
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

from rich.color import ColorSystem

UTF_8: Final = "utf-8"
ASCII: Final = "ascii"
TRUE_COLORS = frozenset({"truecolor", "24bit"})
LEAST_COLORS: tuple[tuple[int, ColorSystem], ...] = (
    (256, ColorSystem.EIGHT_BIT),
    (8, ColorSystem.STANDARD),
)
NAMED_COLORS: tuple[tuple[str, ColorSystem], ...] = (
    ("256color", ColorSystem.EIGHT_BIT),
    ("direct", ColorSystem.TRUECOLOR),
    ("kitty", ColorSystem.TRUECOLOR),
    ("ghostty", ColorSystem.TRUECOLOR),
    ("alacritty", ColorSystem.TRUECOLOR),
    ("foot", ColorSystem.TRUECOLOR),
    ("putty", ColorSystem.STANDARD),
    ("xterm", ColorSystem.STANDARD),
)
"""Colors by a part of TERM, for terminals that terminfo does not know."""

WITHOUT_BRAILLE = ("linux", "cons25", "vt1", "vt2", "vt3", "vt4", "vt5", "pcansi", "sco")
"""Beginnings of TERM of consoles whose fonts have no braille."""

LOCALE = ("LC_ALL", "LC_CTYPE", "LANG")
"""Variables with the encoding; the first one that is set counts."""

BEGINNING = Path("/proc/self/environ")
"""The environment at the start of the program; Python changes LC_CTYPE if it is C or unset."""


class Abilities(NamedTuple):
    """Abilities of a terminal."""

    encoding: str = UTF_8
    """Python name of the character encoding; characters that it lacks become plain signs."""
    colors: ColorSystem | None = ColorSystem.TRUECOLOR
    """None if the terminal has no colors, or none are wanted."""
    erases: bool = False
    """True if it erases cells in the current color."""
    braille: bool = True
    """True if its font has the dots of braille; those of text consoles have none."""


EVERYTHING: Final = Abilities()


def abilities_of(
    environment: Mapping[str, str], *, written_as: str = UTF_8, ascii: bool | None = None
) -> Abilities:
    """Return the abilities of this environment's terminal.

    `written_as` is the encoding in which Python writes to it. `ascii` overrides the locale: True
    for plain signs, False for all characters.
    """
    term = environment.get("TERM", "")
    known, erases = _terminfo(term)
    encoding = encoding_of(environment, written_as)
    if ascii is not None:
        encoding = ASCII if ascii else UTF_8
    colors = _colors(environment, term, known)
    return Abilities(encoding, colors, erases, braille=not term.startswith(WITHOUT_BRAILLE))


def fewer_colors(abilities: Abilities) -> Abilities:
    """The same with sixteen colors at most: setting one of them takes half the bytes."""
    if abilities.colors in (None, ColorSystem.STANDARD):
        return abilities
    return abilities._replace(colors=ColorSystem.STANDARD)


def encoding_of(environment: Mapping[str, str], written_as: str = UTF_8) -> str:
    """The encoding of the locale, as Python names it.

    ASCII if it names none that is known, or if Python writes in another one.
    """
    if sys.platform == "win32":
        return UTF_8  # no such locale there, and its consoles have all characters
    reported = next((value for name in LOCALE if (value := environment.get(name))), "")
    name = reported.partition(".")[2].partition("@")[0] or reported
    try:
        "a".encode(name)
        encoding = codecs.lookup(name).name
        return encoding if encoding == codecs.lookup(written_as).name else ASCII
    except (LookupError, UnicodeError, ValueError):
        return ASCII


def given_environment(environment: Mapping[str, str]) -> Mapping[str, str]:
    """The environment, with the locale variables as at the start of the program."""
    try:
        lines = BEGINNING.read_bytes().split(b"\0")
    except OSError:
        return environment  # no such thing on this system
    given = dict(line.decode("utf-8", "replace").partition("=")[::2] for line in lines if line)
    kept = {name: value for name, value in environment.items() if name not in LOCALE}
    return kept | {name: given[name] for name in LOCALE if name in given}


def _colors(environment: Mapping[str, str], term: str, known: int | None) -> ColorSystem | None:
    if environment.get("NO_COLOR") or term in ("", "dumb", "unknown"):
        return None
    if environment.get("COLORTERM", "").lower() in TRUE_COLORS:
        return ColorSystem.TRUECOLOR
    if known is None:
        return next((system for part, system in NAMED_COLORS if part in term), None)
    return next((system for least, system in LEAST_COLORS if known >= least), None)


def _terminfo(term: str) -> tuple[int | None, bool]:
    """Return a terminal's number of colors (None if unknown), and True if it erases in color."""
    try:
        import curses
    except ImportError:  # as on Windows
        return None, False
    try:
        curses.setupterm(term or "unknown", 1)
    except curses.error:
        return None, False
    erases = curses.tigetstr("ech") == b"\x1b[%p1%dX"
    return curses.tigetnum("colors"), erases and curses.tigetflag("bce") > 0
