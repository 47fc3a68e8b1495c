"""Fields to type into: texts, and numbers and filters, in which Space is not a character."""

from __future__ import annotations

import re
from typing import Any, ClassVar, Final

from textual.events import Key
from textual.widgets import Input

from tui.terminal.names import unshifted_digit

from .plain import Signs

JOINS_KEY = "-", "joins words"
"""The key that a person types between two words of a filter, and what it does."""
_JOINS: Final = re.compile(r"(?<=[^\W\d_])-(?=\w|$)|(?<=\w)-(?=[^\W\d_])")
"""A hyphen behind or before a letter. That of a number, as in -10 or 2-5, stays."""


class Field(Input):
    """An input field of one line; Space types a space."""

    def update_node_styles(self, animate: bool = True) -> None:
        """Skip styling until the field is on a screen, which then styles all of it."""
        if self.is_attached:
            super().update_node_styles(animate)

    takes_space: ClassVar[bool] = True
    """True if Space is text in this field; if False, Space stops the motor."""

    def check_consume_key(self, key: str, character: str | None) -> bool:
        """Space stops the motor where it is not a character of the text."""
        return (key != "space" or self.takes_space) and super().check_consume_key(key, character)

    def __init__(self, value: str = "", **how: Any) -> None:
        super().__init__(value, highlighter=Signs(), compact=True, **how)


class NumberInput(Field):
    """A field for a number, a reference, an address: Space stops the motor here too."""

    takes_space = False

    def on_key(self, event: Key) -> None:
        """Type the digit of a key that sends it only with Shift, as on a French keyboard."""
        typed = event.character or ""
        if (digit := unshifted_digit(typed)) != typed:
            event.stop()
            event.prevent_default()
            self.replace(digit, *self.selection)


class WordField(Field):
    """A field for words that filter a list, or for a name: Space stops the motor here too."""

    takes_space = False

    @property
    def words(self) -> str:
        """The text with spaces for the hyphens that join words: `top-speed` is `top speed`."""
        return _JOINS.sub(" ", self.value)
