"""What the Monitor screen says of commands: armed or not, what became of an order, its keys."""

from __future__ import annotations

from collections.abc import Sequence

from rich.style import Style
from rich.text import Text

from tui.session.work import Kind, Outcome

from .drawing import Key, cut, key_line, key_styles
from .monitor_view import View
from .palette import ALARM, ATTENTION, FAINT, STRONG

OUTCOME_STYLES = {Kind.WORKING: ATTENTION, Kind.DONE: STRONG, Kind.REFUSED: ALARM}


def outcome_lines(outcome: Outcome, width: int) -> list[Text]:
    """What became of the last order, on at most two lines."""
    head = {Kind.WORKING: "ORDERED ", Kind.DONE: "DONE ", Kind.REFUSED: "NOT DONE "}[outcome.kind]
    text = head + outcome.text
    style = OUTCOME_STYLES[outcome.kind]
    if len(text) <= width:
        return [Text(text, style)]
    at = text.rfind(" ", 0, width)
    return [Text(text[:at], style), Text(cut(text[at + 1 :], width).rstrip(), style)]


def order_keys(view: View, keys: Sequence[Key]) -> Text:
    """The line of keys: stop first; orders that cannot work now are dim."""

    def styles(action: str) -> tuple[Style, Style]:
        if not action.startswith(("reset", "run_line")):
            return key_styles(action)
        return (ATTENTION, STRONG) if works_now(view, action) else (FAINT, FAINT)

    return key_line(keys, styles)


def works_now(view: View, action: str) -> bool:
    """Whether an order can work now, as far as is known without asking the drive."""
    if view.control.armed_for is None or view.lost or view.snapshot is None:
        return False
    if action == "reset":
        return view.snapshot.state.kind == "fault"
    return not view.control.no_effect or action == "run_line('reference')"
