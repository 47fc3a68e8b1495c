"""Result of work on a drive, while it is new."""

from __future__ import annotations

from rich.style import Style

from tui.session.work import Outcome, OutcomeKind
from tui.widgets.palette import ALARM, ATTENTION, STRONG

OUTCOME_STYLES = {
    OutcomeKind.WORKING: ATTENTION,
    OutcomeKind.DONE: STRONG,
    OutcomeKind.REFUSED: ALARM,
}
NEWS_FOR = {OutcomeKind.WORKING: 60.0, OutcomeKind.DONE: 15.0, OutcomeKind.REFUSED: 60.0}
"""Seconds for which the result of the last work is shown."""


def news(
    message: Outcome | None, now: float, *, busy: bool, passed: Outcome | None = None
) -> tuple[str, Style] | None:
    """The sentence and its style while the work goes on and for some time after it, else None.

    `passed` is the outcome that a key has led on from: it is no longer news.
    """
    if message is None or message is passed:
        return None
    kind = message.kind
    if not busy and now - message.time >= NEWS_FOR[kind]:
        return None
    return message.text, OUTCOME_STYLES[kind]
