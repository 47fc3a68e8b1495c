"""Text shown as it is written: never as markup, never as a command to the terminal.

All text from people, drives, files and profiles passes through here on its way to Textual's
widgets, which would read brackets in a `str` as markup.
"""

from __future__ import annotations

from rich.highlighter import Highlighter
from rich.text import Text
from textual.visual import VisualType
from textual.widgets import Label
from textual.widgets.option_list import Option

from tui.drive.plain import plain


class Plain(Label):
    """A label without markup."""

    def __init__(
        self, content: VisualType = "", *, id: str | None = None, classes: str | None = None
    ) -> None:
        super().__init__(written(content), markup=False, id=id, classes=classes)

    def update(self, content: VisualType = "", *, layout: bool = True) -> None:
        """Replace the text."""
        super().update(written(content), layout=layout)


def written(content: VisualType) -> VisualType:
    """A `str` or `Text` with its control characters as symbols; anything else unchanged."""
    if isinstance(content, str):
        return plain(content, lines=True)
    return signs(content) if isinstance(content, Text) else content


def signs(text: Text) -> Text:
    """The same text, in the same colors, with its control characters as symbols."""
    if text.plain.replace("\n", "").isprintable():
        return text
    shown = text.copy()
    shown.plain = plain(text.plain, lines=True)
    return shown


def entry(text: Text, *, id: str | None = None, disabled: bool = False) -> Option:
    """A line of a list."""
    return Option(signs(text), id=id, disabled=disabled)


class Signs(Highlighter):
    """Shows the control characters in a field as symbols."""

    def highlight(self, text: Text) -> None:
        """Replace them, one for one."""
        text.plain = plain(text.plain)
