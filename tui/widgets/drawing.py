"""Drawing with characters: rules, cut and wrapped text, key bars; pure functions."""

from __future__ import annotations

import re
import textwrap
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import lru_cache

from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain

from .palette import (
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
    """The heading of a section: its title on a thin line, `right` at the right if there is room."""
    tail = f" {right} " if right and len(title) + len(right) + 5 <= width else ""
    text = Text(no_wrap=True)
    text.append(f"{title} ", TITLE)
    text.append("─" * max(0, width - len(title) - 1 - len(tail) - (1 if tail else 0)), LINE)
    if tail:
        text.append(tail, TITLE)
        text.append("─", LINE)
    return text


def short(text: str, width: int) -> str:
    """The text in at most `width` cells, with an ellipsis if it is too long."""
    text = plain(text)
    return f"{text[: width - 1]}…" if len(text) > width else text


def cut(text: str, width: int) -> str:
    """The text in exactly `width` cells, with an ellipsis if it is too long."""
    return f"{short(text, width):<{width}}"


def cut_at_word(text: str, width: int) -> str:
    """The text in at most `width` cells, cut after a whole word with an ellipsis if too long."""
    text = plain(text)
    if len(text) <= width:
        return text
    at = text.rfind(" ", 0, width)
    return f"{text[: at if at > width // 2 else width - 1].rstrip(' ,;:')}…"


ARTICLES = frozenset(("a", "an", "the"))
"""Words that a name loses first if it is too long."""
DENIES = re.compile(r"\b(?:without|not|no)\b", re.IGNORECASE)
"""Words without which the rest of a name would mean the opposite."""
DENIAL_CUTS = 10
"""Cuts between words that the loss of such a word outweighs."""


@lru_cache(maxsize=64)
def fitted_names(names: tuple[str, ...], width: int) -> Mapping[str, str]:
    """Return the names of one list, each in at most so many cells, no two of them alike.

    A longer name loses its articles, then a part of its middle. What is left of it begins and
    ends like no other name, if possible.
    """
    fitted = {name: plain(name) for name in names if len(plain(name)) <= width}
    taken = set(fitted.values())
    longer = {name: _without_articles(plain(name)) for name in names if name not in fitted}
    others = sorted((*taken, *longer.values()))
    for name, text in longer.items():
        forms = [text] if len(text) <= width else _without_middle(text, width)
        free = [form for form in forms if form not in taken]
        own = (form for form in free if _is_own(form, others))
        fitted[name] = next(own, free[0] if free else forms[0])
        taken.add(fitted[name])
    return fitted


def _without_articles(text: str) -> str:
    return " ".join(word for word in text.split(" ") if word not in ARTICLES)


def _is_own(form: str, names: Sequence[str]) -> bool:
    """Return True if one of the sorted names begins and ends like a shortened one, no more."""
    head, _, tail = form.partition("…")
    first, last = bisect_left(names, head), bisect_right(names, f"{head}\U0010ffff")
    return sum(name.endswith(tail) for name in names[first:last]) <= 1


def _without_middle(text: str, width: int) -> list[str]:
    """Return the ways to shorten a text to so many cells by a part in its middle, the best first.

    A cut between words is better, and one in the middle of the width. A word that denies the rest
    stays if any cut keeps it.
    """
    if len(text) <= width:
        return [text]
    found, denials = [], len(DENIES.findall(text))
    for head in range(1, width - 1):
        for tail in range(max(1, width - head - 4), width - head):
            if text[head - 1] == " " or text[-tail] == " ":
                continue
            cuts = (text[head] != " ") + (text[-tail - 1] != " ")
            if denials:
                kept = len(DENIES.findall(f"{text[:head]}…{text[-tail:]}"))
                cuts += DENIAL_CUTS * (denials - kept)
            found.append((3 * cuts + (width - head - tail) + abs(head - tail) / 4, head, tail))
    return [f"{text[:head]}…{text[-tail:]}" for _, head, tail in sorted(found)] or [text[:width]]


def fitted_name(name: str, width: int) -> str:
    """Return a name in at most so many cells, shortened in its middle: its end may be a number."""
    return fitted_names((name,), width)[name]


def whole_sentences(text: str, width: int) -> str:
    """As many whole sentences as fit the width; the whole text if not even the first one does."""
    if len(text) <= width:
        return text
    end = text.rfind(". ", 0, width + 1)
    return text if end < 0 else text[:end]


def wrapped(text: str, width: int, most: int) -> list[str]:
    """The text in lines of at most `width` cells, `most` lines at most."""
    if not text or most < 1:
        return []
    text = plain(text, lines=True)
    return textwrap.wrap(text, max(1, width), max_lines=most, placeholder=" …")


KeyLabel = tuple[str, str, str]
"""An action, its key and its label in the key bar."""


def fitting(keys: Sequence[KeyLabel], width: int, kept: Collection[str]) -> list[KeyLabel]:
    """The keys that fit the width; the last are dropped first, those in `kept` never."""
    left = list(keys)
    for key in reversed(keys):
        if key_line(left).cell_len <= width:
            break
        if key[0] not in kept:
            left.remove(key)
    return left


def key_styles(action: str) -> tuple[Style, Style]:
    """Return the styles of a key and its label; a key that stops a motor is red."""
    return (STOP_KEY, STOP_KEY) if action.startswith("stop") else (KEY, FAINT)


def key_line(
    keys: Sequence[KeyLabel], styles: Callable[[str], tuple[Style, Style]] = key_styles
) -> Text:
    """The key bar; `styles` returns the styles of a key and its label for an action."""
    text = Text(no_wrap=True)
    for index, (action, key, does) in enumerate(keys):
        drawn, words = styles(action)
        text.append("  " if index else " ")
        text.append(key, drawn)
        text.append(f" {does}", words)
    return text


def armed_text(armed: float | None) -> Text:
    """Return `ARMED` with the remaining seconds, or `NOT ARMED`."""
    if armed is None:
        return Text(" NOT ARMED  ", STRONG)
    return Text(f" ARMED {armed:2.0f} s ", ATTENTION_BLOCK)


def pair(label: str, value: str, style: Style = PLAIN, width: int = 12) -> Text:
    """A dim label of `width` cells, followed by its value."""
    text = Text(no_wrap=True)
    text.append(f"{label:<{width}}", FAINT)
    text.append(value, style)
    return text
