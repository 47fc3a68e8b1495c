"""Use of text by a focused widget: none, numbers, or any text, spaces too.

A widget says it by `takes_text` and `takes_space`; of Textual's own it is known.
"""

from __future__ import annotations

from textual.widget import Widget

# by their names: to import a text area takes longer than the whole first picture may
TEXT_FIELDS = frozenset({"Input", "TextArea"})


def takes_text(widget: Widget | None) -> bool:
    """Return True if what is typed becomes text in this widget."""
    reported = getattr(widget, "takes_text", None)
    if reported is not None:
        return bool(reported)
    return any(kind.__name__ in TEXT_FIELDS for kind in type(widget).__mro__)


def takes_space(widget: Widget | None) -> bool:
    """Return True if a space is text in this widget; in a field for numbers it is none."""
    reported = getattr(widget, "takes_space", None)
    if reported is not None:
        return bool(reported)
    return takes_text(widget) and getattr(widget, "type", "text") == "text"
