"""Shared pieces of the Faults screen: labels, readings as text, certainties; pure functions."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

from rich.style import Style
from rich.text import Text

from tui.drive.values import NOT_AVAILABLE, Value, set_bits
from tui.session.shown import Shown
from tui.widgets.palette import FAINT, PLAIN, STALE, age_text

LABEL = 13
"""Columns of the headings at the left."""
CONTACTS = ("digital_inputs", "digital_outputs")
"""Words shown by the names of their set bits, not in hexadecimal."""
TRUST_MARKS: Mapping[str, str] = {"manual": "manual", "public": "guide", "practice": "practice"}
"""Certainty of the first cause in a word; `practice` is general practice."""


def labelled(label: str, lines: Sequence[Text]) -> list[Text]:
    """Return the lines, indented, with a label at the left of the first."""
    return [
        Text.assemble((f"  {label if not number else '':<{LABEL - 2}}", FAINT)).append_text(line)
        for number, line in enumerate(lines)
    ]


def reading_text(reading: Shown | None, now: float) -> tuple[str, Style]:
    """Return a value with its unit, and its age if it is old."""
    if reading is None:
        return NOT_AVAILABLE, FAINT
    parameter = reading.parameter

    def text(value: Value) -> str:
        if parameter.quantity in CONTACTS:
            return ", ".join(bit.name for bit in set_bits(parameter.bits, value.raw)) or "none"
        return f"{value.text} {value.unit}".rstrip()

    return reading.drawn(
        now,
        current=lambda value: (text(value), PLAIN),
        old=lambda value, age: (f"{text(value)}, {age_text(age)} old", STALE),
        missing=(NOT_AVAILABLE, FAINT),
    )


def dated_text(wall: float, now: float) -> str:
    """Return a time of day, with its date unless it is today; both in seconds since 1970."""
    when = time.localtime(wall)
    today = when[:3] == time.localtime(now)[:3]
    return time.strftime("%H:%M:%S" if today else "%d %b %Y %H:%M:%S", when)


def ago_text(seconds: float) -> str:
    """Return an age that changes once a minute at most."""
    if seconds < 60:
        return "just now"
    if seconds < 7200:
        return f"{seconds / 60:.0f} min ago"
    if seconds < 172_800:
        return f"{seconds / 3600:.0f} h ago"
    return f"{seconds / 86400:.0f} days ago"
