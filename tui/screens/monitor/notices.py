"""Notices on Monitor beside the message: whole sentences; pure functions."""

from __future__ import annotations

from rich.text import Text

from tui.widgets.drawing import wrapped
from tui.widgets.palette import ALARM, ATTENTION, FAINT, PLAIN

from .view import View

NOTICE_ROWS = 2
HELD = 0.9
"""Share of the wished rate from which on it counts as held."""


def notice_lines(view: View, width: int) -> list[Text]:
    """The one notice that matters most now, on at most two lines; none while there is nothing."""
    if view.snapshot is None or view.lost or view.snapshot.state.kind == "fault":
        return []
    control = view.control
    no_effect = f"No effect: {control.hindrance.sentence}" if control.hindrance else ""
    for message, style in (
        (control.offer, ATTENTION),
        (control.lost, ALARM),
        (control.why_disarmed, ATTENTION),
        (no_effect, PLAIN),
    ):
        if message:
            return [Text(f"  {line}", style) for line in wrapped(message, width - 4, NOTICE_ROWS)]
    return []


def line_figures(view: View) -> Text:
    """Return the read rate of the drive and the line's share of good replies."""
    rate = view.snapshot.rate if view.snapshot and not view.lost else 0.0
    wished = 1 / view.period
    held = rate > HELD * wished or not rate
    text = Text(f"{rate:.1f} of {wished:.1f} cycles/s", FAINT if held else ALARM, no_wrap=True)
    if view.snapshot is not None and view.snapshot.block:
        text.append(f" by {view.snapshot.block.lower()}", FAINT)
    counts = view.counters
    failed = counts.timeouts + counts.checksum + counts.wrong
    return text.append(f", {counts.requests} requests, {failed} failed ", FAINT)
