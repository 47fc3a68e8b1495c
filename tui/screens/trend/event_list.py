"""Events of Trend: signs on the time axis, and a list; pure functions."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.session.events import Event
from tui.session.record.schema import EventRow
from tui.widgets.drawing import short
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, FAULT, KEY, PLAIN, STRONG

TREND_EVENT_SIGNS: dict[str, tuple[str, str, Style]] = {
    "fault": ("■", "#", FAULT),
    "alarm": ("■", "#", ALARM),
    "failed": ("×", "x", FAULT),
    "refused": ("×", "x", ALARM),
    "stop": ("▼", "v", STRONG),
    "done": ("●", "o", ATTENTION),
    "line": ("·", ".", FAINT),
    "commander": ("·", ".", FAINT),
    "clock": ("·", ".", FAINT),
    "lost": ("·", ".", FAINT),
    "abandoned": ("×", "x", ALARM),
}
"""Kinds of events that are shown, with the sign, the one in ASCII, and its style."""
EVENTS_OF_NO_DRIVE = ("stop", "line", "commander", "clock", "lost")
"""Kinds that may concern the whole line; others without a drive are about the panel itself."""
MOST_EVENTS = 500
"""Recorded events that are listed."""
SAME_EVENT_WITHIN = 2.0
"""Seconds in which equal messages are about the same event."""


class TrendEvent(NamedTuple):
    """One event; `wall` is in seconds since 1970."""

    wall: float
    device: int | None
    kind: str
    text: str


def trend_events(
    recorded: Iterable[EventRow], present: Iterable[Event], devices: frozenset[int]
) -> list[TrendEvent]:
    """Return the events of the line and of some drives, newest first, each once."""
    found = [TrendEvent(row.utc / 1e6, row.device, row.kind, _text(row)) for row in recorded]
    found += [TrendEvent(*event) for event in present]
    kept: list[TrendEvent] = []
    last: dict[tuple[str, str], float] = {}
    for event in sorted(found, key=lambda item: -item.wall):
        if not _is_shown(event, devices):
            continue
        same = event.kind, event.text
        if same in last and last[same] - event.wall < SAME_EVENT_WITHIN:
            continue
        last[same] = event.wall
        kept.append(event)
    return kept


def events_shown(recorded: Iterable[EventRow], devices: frozenset[int]) -> list[EventRow]:
    """Return the last events that are shown, the oldest first."""
    return [row for row in recorded if _is_shown(row, devices)][-MOST_EVENTS:]


def _is_shown(event: TrendEvent | EventRow, devices: frozenset[int]) -> bool:
    own = event.kind in EVENTS_OF_NO_DRIVE if event.device is None else event.device in devices
    return event.kind in TREND_EVENT_SIGNS and own


def _text(row: EventRow) -> str:
    """Return the text of a recorded event; that of a stop is only its key or its reason."""
    is_bare = row.kind == "stop" and "stop" not in row.text.casefold()
    return f"Stop: {row.text}" if is_bare else row.text


def sign_of(event: TrendEvent, plain: bool) -> tuple[str, Style]:
    """Return the sign of an event and its style."""
    sign, in_ascii, style = TREND_EVENT_SIGNS[event.kind]
    return (in_ascii if plain else sign), style


def _line(event: TrendEvent, now: float, plain: bool, width: int, *, selected: bool) -> Text:
    """Return the line of an event; with its date before a time of another day."""
    when, today = time.localtime(event.wall), time.localtime(now)
    form = "%H:%M:%S " if when[:3] == today[:3] else "%m-%d %H:%M "
    sign, style = sign_of(event, plain)
    lead = (">" if plain else "▸") if selected else " "
    line = Text(no_wrap=True).append(lead, KEY)
    line.append(time.strftime(form, when), FAINT)
    line.append(sign, style)
    drive = f"{event.device} " if event.device is not None else ""
    text = short(f" {drive}{event.text}", width - line.cell_len)
    line.append(text, STRONG if selected else PLAIN)
    if selected:
        line.append(" " * max(0, width - line.cell_len))
        line.stylize(CURSOR)
    return line


def events_lines(
    events: Sequence[TrendEvent],
    selected: int | None,
    rows: int,
    width: int,
    now: float,
    plain: bool,
) -> list[Text]:
    """Return the list in exactly `rows` rows, with the selected event in it."""
    shown = "  newest first" if events else "  none"
    head = Text(no_wrap=True).append("Events", STRONG).append(shown, FAINT)
    room = max(1, rows - 1)
    first = 0 if selected is None else max(0, min(selected - room // 2, len(events) - room))
    lines = [
        _line(event, now, plain, width, selected=place == selected)
        for place, event in enumerate(events[first : first + room], start=first)
    ]
    return [head, *lines, *[Text("")] * (room - len(lines))][:rows]


def event_line(
    events: Sequence[TrendEvent], cursor: float | None, width: int, now: float, plain: bool
) -> Text:
    """Return the last event, up to the cursor if it is open, with the key of the list."""
    found = next((event for event in events if cursor is None or event.wall <= cursor), None)
    right = Text.assemble(("Tab", KEY), (" events ", FAINT))
    if found is None:
        line = Text("  No event.", FAINT, no_wrap=True)
    else:
        line = _line(found, now, plain, width - right.cell_len - 1, selected=False)
    line.append(" " * max(1, width - line.cell_len - right.cell_len))
    return line.append_text(right)
