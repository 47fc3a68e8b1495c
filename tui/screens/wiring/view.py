"""The page of a family as lines; pure functions."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from tui.drive.family_page import PageLine
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG


def wiring_lines(page: Sequence[PageLine]) -> list[Text]:
    """The lines of a page with their colours: amber where it warns, else grey."""
    return [_line(line) for line in page]


def _line(line: PageLine) -> Text:
    if line.kind == "title":
        return Text(f" {line.head}", STRONG, no_wrap=True)
    text = Text(line.head, FAINT, no_wrap=True)
    if line.kind == "warning":
        text.stylize(ALARM)
    text.append(line.text, PLAIN)
    return text


def section_tops(page: Sequence[PageLine]) -> list[int]:
    """Where the sections begin."""
    return [number for number, line in enumerate(page) if line.kind == "title"]
