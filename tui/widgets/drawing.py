"""Drawing with characters: numbers at their place, bars, rules, trends; pure functions."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Collection, Sequence
from decimal import Decimal

from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain

from .palette import (
    ALARM,
    ATTENTION_BLOCK,
    BAR,
    BAR_REST,
    FAINT,
    KEY,
    LINE,
    MARK,
    PLAIN,
    STOP_KEY,
    STRONG,
    TITLE,
)

EIGHTHS_HIGH = " ▁▂▃▄▅▆▇█"


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
    return textwrap.wrap(text, width, max_lines=most, placeholder=" …")


def aligned(text: str, whole: int, decimals: int) -> str:
    """A number with its decimal point at a fixed place; other text to the right."""
    width = whole + (decimals + 1 if decimals else 0)
    try:
        number = Decimal(text)
    except ArithmeticError:
        return f"{text:>{width}}"[:width] if len(text) > width else f"{text:>{width}}"
    if not number.is_finite():
        return f"{text:>{width}}"
    left, _, right = text.partition(".")
    if not decimals:
        return f"{left:>{whole}}"
    return f"{left:>{whole}}" + (f".{right:<{decimals}}" if right else " " * (decimals + 1))


def bar(
    value: float | None,
    low: float,
    high: float,
    width: int,
    mark: float | None = None,
    style: Style = BAR,
) -> Text:
    """A bar from zero (or the low end) to the value, between thin ends, with a mark on it."""
    text = Text(no_wrap=True)
    inner = max(1, width - 2)
    cells = [(" ", BAR_REST)] * inner
    if value is not None and high > low:
        start = _place(max(low, min(high, 0.0)), low, high, inner)
        end = _place(value, low, high, inner)
        cells = [_cell(i, min(start, end), max(start, end), style) for i in range(inner)]
    if mark is not None and high > low:
        at = min(inner - 1, int(_place(mark, low, high, inner)))
        cells[at] = ("│", MARK)
    text.append("▕", LINE)
    for character, one in cells:
        text.append(character, one)
    text.append("▏", LINE)
    return text


def _place(value: float, low: float, high: float, width: int) -> float:
    return (max(low, min(high, value)) - low) / (high - low) * width


def _cell(index: int, start: float, end: float, style: Style) -> tuple[str, Style]:
    filled = max(0.0, min(end, index + 1) - max(start, index))
    if filled <= 0:
        return "·", BAR_REST
    return ("▆" if filled >= 0.5 else "▖"), style  # leaves a gap to the bar above


def trend(
    points: Sequence[float | None], high: float, width: int, height: int, style: Style = BAR
) -> list[Text]:
    """Columns of block characters, the newest at the right; a gap where there was no value."""
    rows: list[Text] = []
    last = list(points)[-width:]
    shown: list[float | None] = [*([None] * (width - len(last))), *last]
    levels = [
        None if p is None else max(0, min(height * 8, round(abs(p) / high * height * 8)))
        for p in shown
    ]
    for row in range(height - 1, -1, -1):
        text = Text(no_wrap=True)
        line = "".join(_column(level, row) for level in levels)
        text.append(line, style)
        rows.append(text)
    return rows


def _column(level: int | None, row: int) -> str:
    if level is None:
        return " "
    if row == 0 and level == 0:
        return "▁"
    return EIGHTHS_HIGH[max(0, min(8, level - row * 8))]


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
    """How a key and its words are drawn; a key that stops a motor is red."""
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
    """Whether a drive is armed, and for how many seconds more."""
    if armed is None:
        return Text(" NOT ARMED  ", ALARM if lost else STRONG)
    return Text(f" ARMED {armed:2.0f} s ", ATTENTION_BLOCK)


def pair(label: str, value: str, style: Style = PLAIN, width: int = 12) -> Text:
    """A dim label and its value, behind a label of `width`."""
    text = Text(no_wrap=True)
    text.append(f"{label:<{width}}", FAINT)
    text.append(value, style)
    return text
