"""Kind of text that the focused widget accepts: none, numbers, or any text with spaces.

A widget declares it by `takes_text` and `takes_space`; Textual's own widgets are known.
"""

from __future__ import annotations

from textual.widget import Widget

# by name: importing a text area would take longer than the first picture may
TEXT_FIELDS = frozenset({"Input", "TextArea"})


def takes_text(widget: Widget | None) -> bool:
    """Return True if typed characters become text in this widget."""
    reported = getattr(widget, "takes_text", None)
    if reported is not None:
        return bool(reported)
    return any(kind.__name__ in TEXT_FIELDS for kind in type(widget).__mro__)


def takes_space(widget: Widget | None) -> bool:
    """Return True if a space is text in this widget; False in a field for numbers."""
    reported = getattr(widget, "takes_space", None)
    if reported is not None:
        return bool(reported)
    return takes_text(widget) and getattr(widget, "type", "text") == "text"
