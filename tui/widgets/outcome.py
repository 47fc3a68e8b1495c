"""What became of work on a drive, as a person reads it."""

from __future__ import annotations

from rich.text import Text

from tui.session.work import Outcome, OutcomeKind

from .drawing import cut
from .palette import ALARM, ATTENTION, STRONG

OUTCOME_STYLES = {
    OutcomeKind.WORKING: ATTENTION,
    OutcomeKind.DONE: STRONG,
    OutcomeKind.REFUSED: ALARM,
}


def outcome_lines(outcome: Outcome, width: int) -> list[Text]:
    """What became of the last order, on at most two lines."""
    head = {
        OutcomeKind.WORKING: "ORDERED ",
        OutcomeKind.DONE: "DONE ",
        OutcomeKind.REFUSED: "NOT DONE ",
    }[outcome.kind]
    text = head + outcome.text
    style = OUTCOME_STYLES[outcome.kind]
    if len(text) <= width:
        return [Text(text, style)]
    at = text.rfind(" ", 0, width)
    return [Text(text[:at], style), Text(cut(text[at + 1 :], width).rstrip(), style)]
