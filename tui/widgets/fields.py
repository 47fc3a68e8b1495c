"""Fields to type into: a text unchanged, and numbers in which Space is not a character."""

from __future__ import annotations

from typing import Any, ClassVar

from textual.widgets import Input

from .plain import Signs


class Field(Input):
    """A field of one line; a space belongs to the text."""

    def update_node_styles(self, animate: bool = True) -> None:
        """Nothing is styled before it is on a screen: then it is, as a whole."""
        if self.is_attached:
            super().update_node_styles(animate)

    takes_space: ClassVar[bool] = True
    """True if Space is typed into it; where it is not, Space stops the motor there too."""

    def __init__(self, value: str = "", **how: Any) -> None:
        super().__init__(value, highlighter=Signs(), compact=True, **how)


class NumberInput(Field):
    """A field for a number, a reference, an address: Space stops the motor here too."""

    takes_space = False

    def check_consume_key(self, key: str, character: str | None) -> bool:
        """Space is left to the stop."""
        return key != "space" and super().check_consume_key(key, character)
