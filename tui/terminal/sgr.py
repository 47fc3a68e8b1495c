"""Sequences for colors and attributes, and those that change from one to another."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

RESET = "0"
NOT_BOLD = "22"
SEEN_ON_SIGNS = frozenset({"1", "2", "3"})
"""Bold, dim, italic: a blank looks the same with them."""
FOREGROUND = frozenset({*range(30, 38), *range(90, 98)})
BACKGROUND = frozenset({*range(40, 48), *range(100, 108)})
EXTENDED = {38: "foreground", 48: "background"}
NUMBERS = {2: 5, 5: 3}
"""Numbers of an extended color in all, by the one that follows 38 or 48."""


class CellLook(NamedTuple):
    """Attributes and colors of a character; a color that is empty is the terminal's own."""

    attributes: frozenset[str] = frozenset()
    foreground: str = ""
    background: str = ""


@lru_cache(maxsize=1024)
def look_of(ansi: str) -> CellLook:
    """Return the look of a style such as `1;38;5;7;48;5;0`."""
    attributes, colors = set(), {"foreground": "", "background": ""}
    left = ansi.split(";") if ansi else []
    while left:
        number = int(left[0])
        size = 1
        if number in EXTENDED:
            size = NUMBERS[int(left[1])]
            colors[EXTENDED[number]] = ";".join(left[:size])
        elif number in FOREGROUND:
            colors["foreground"] = left[0]
        elif number in BACKGROUND:
            colors["background"] = left[0]
        elif number not in (39, 49):
            attributes.add(left[0])
        left = left[size:]
    return CellLook(frozenset(attributes), **colors)


@lru_cache(maxsize=4096)
def change(before: str, after: str) -> str:
    """The shortest sequence from one style to another; nothing where they are the same."""
    if before == after:
        return ""
    was, now = look_of(before), look_of(after)
    anew = f"\x1b[{RESET};{after}m" if after else f"\x1b[{RESET}m"
    gone = was.attributes - now.attributes
    color_gone = (was.foreground and not now.foreground) or (was.background and not now.background)
    if color_gone or not gone <= {"1"}:
        return anew
    added = [NOT_BOLD] if gone else []
    kept = was.attributes - {"2"} if gone else was.attributes  # not bold is not dim either
    added += sorted(now.attributes - kept)
    added += [now.foreground] if now.foreground != was.foreground else []
    added += [now.background] if now.background != was.background else []
    return min(f"\x1b[{';'.join(added)}m" if added else "", anew, key=len)


def erasable(ansi: str) -> bool:
    """Return True if a blank of this style looks like an erased cell."""
    return look_of(ansi).attributes <= SEEN_ON_SIGNS


@lru_cache(maxsize=1024)
def blank_style(ansi: str) -> str:
    """The style of a blank without what is seen on signs only."""
    return look_of(ansi).background if erasable(ansi) else ansi


def same_blank(before: str, after: str) -> bool:
    """Return True if a blank looks the same in two styles."""
    return erasable(before) and erasable(after) and blank_style(before) == blank_style(after)
