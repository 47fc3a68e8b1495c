"""The line of keys on Monitor: which commands can work now."""

from __future__ import annotations

from collections.abc import Sequence

from rich.style import Style
from rich.text import Text

from tui.widgets.drawing import KeyLabel, key_line, key_styles
from tui.widgets.palette import ATTENTION, FAINT, STRONG

from .view import View


def order_keys(view: View, keys: Sequence[KeyLabel]) -> Text:
    """The line of keys: stop first; orders that cannot work now are dim."""

    def styles(action: str) -> tuple[Style, Style]:
        if not action.startswith(("reset", "run_line")):
            return key_styles(action)
        return (ATTENTION, STRONG) if works_now(view, action) else (FAINT, FAINT)

    return key_line(keys, styles)


def works_now(view: View, action: str) -> bool:
    """Return True if an order can work now, as far as is known without asking the drive."""
    if view.control.armed_for is None or view.lost or view.snapshot is None:
        return False
    in_fault = view.snapshot.state.kind == "fault"
    if action == "reset" or in_fault:
        return in_fault and action in ("reset", "run_line('reference')")
    return view.control.hindrance is None or action == "run_line('reference')"
