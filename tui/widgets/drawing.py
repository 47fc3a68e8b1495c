"""Drawing with characters: rules, cut and wrapped text, lines of keys; pure functions."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Collection, Sequence

from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain

from .palette import (
    ALARM,
    ATTENTION_BLOCK,
    FAINT,
    KEY,
    LINE,
    PLAIN,
    STOP_KEY,
    STRONG,
    TITLE,
)


def rule(title: str, width: int, right: str = "") -> Text:
    """The heading of a part: its title on a thin line."""
    tail = f" {right} " if right and len(title) + len(right) + 5 <= width else ""
    text = Text(no_wrap=True)
    text.append(f"{title} ", TITLE)
    text.append("─" * max(0, width - len(title) - 1 - len(tail) - (1 if tail else 0)), LINE)
    if tail:
        text.append(tail, TITLE)
        text.append("─", LINE)
    return text


def short(text: str, width: int) -> str:
    """The text in at most so many cells, with an ellipsis where it is too long."""
    text = plain(text)
    return f"{text[: width - 1]}…" if len(text) > width else text


def cut(text: str, width: int) -> str:
    """The text in exactly so many cells, with an ellipsis where it is too long."""
    return f"{short(text, width):<{width}}"


def cut_at_word(text: str, width: int) -> str:
    """The text in at most so many cells, ended at a word with an ellipsis where it is longer."""
    text = plain(text)
    if len(text) <= width:
        return text
    at = text.rfind(" ", 0, width)
    return f"{text[: at if at > width // 2 else width - 1].rstrip(' ,;:')}…"


def wrapped(text: str, width: int, most: int) -> list[str]:
    """The text in lines of that width, at most so many."""
    if not text or most < 1:
        return []
    text = plain(text, lines=True)
    return textwrap.wrap(text, max(1, width), max_lines=most, placeholder=" …")


KeyLabel = tuple[str, str, str]
"""An action, its key and its label in the line of keys."""


def fitting(keys: Sequence[KeyLabel], width: int, kept: Collection[str]) -> list[KeyLabel]:
    """The keys for which there is room; the last go first, those of the actions kept never."""
    left = list(keys)
    for key in reversed(keys):
        if key_line(left).cell_len <= width:
            break
        if key[0] not in kept:
            left.remove(key)
    return left


def key_styles(action: str) -> tuple[Style, Style]:
    """Return the styles of a key and its words; a key that stops a motor is red."""
    return (STOP_KEY, STOP_KEY) if action.startswith("stop") else (KEY, FAINT)


def key_line(
    keys: Sequence[KeyLabel], styles: Callable[[str], tuple[Style, Style]] = key_styles
) -> Text:
    """Keys and what they do, on one line; `styles` of a key and its words, by the action."""
    text = Text(no_wrap=True)
    for index, (action, key, does) in enumerate(keys):
        drawn, words = styles(action)
        text.append("  " if index else " ")
        text.append(key, drawn)
        text.append(f" {does}", words)
    return text


def armed_text(armed: float | None, *, lost: bool = False) -> Text:
    """Return whether a drive is armed, and for how many seconds more."""
    if armed is None:
        return Text(" NOT ARMED  ", ALARM if lost else STRONG)
    return Text(f" ARMED {armed:2.0f} s ", ATTENTION_BLOCK)


def pair(label: str, value: str, style: Style = PLAIN, width: int = 12) -> Text:
    """A dim label and its value, behind a label of `width`."""
    text = Text(no_wrap=True)
    text.append(f"{label:<{width}}", FAINT)
    text.append(value, style)
    return text
