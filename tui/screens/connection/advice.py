"""Advice on Line instead of drives: the event, the next step, the possible drives. Pure."""

from __future__ import annotations

from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.widgets.drawing import wrapped
from tui.widgets.palette import ALARM, FAINT, FAULT, PLAIN

ERROR_KIND, ALARM_KIND = "error", "alarm"
ADVICE = 4
"""Lines at most for what happened, and for what to do next, while no drive is found."""
FAMILIES = 7
"""Lines at most for the families that watch the line."""
READ_ONLY = "Read-only: nothing is written to a drive, not even a stop."
ADVICE_INDENT = 3


class Advice(NamedTuple):
    """An event, and the next step."""

    now: str
    next_step: str
    kind: str = ""


def advice_lines(
    advice: Advice, width: int, *, left: str = "", families: str = "", read_only: bool = False
) -> list[Text]:
    """The lines, a part each; `left` is the time that a search still takes, if one goes on."""
    style = {ERROR_KIND: FAULT, ALARM_KIND: ALARM}.get(advice.kind, PLAIN)
    now = f"{advice.now} {left} left." if left else advice.now
    lines = [Text(""), *_part(now, width, ADVICE, style)]
    lines += _part(advice.next_step, width, ADVICE, FAINT)
    if families and not advice.kind:
        lines += [Text(""), *_part(families, width, FAMILIES, PLAIN)]
    if read_only:
        lines += [Text(""), *_part(READ_ONLY, width, 2, FAINT)]
    return lines


def _part(text: str, width: int, most: int, style: Style) -> list[Text]:
    return [
        Text(f"  {part}", style) for part in wrapped(text, max(10, width - ADVICE_INDENT), most)
    ]
