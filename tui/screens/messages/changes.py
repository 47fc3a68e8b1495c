"""Lines of what changed since a time: writes, trips, runs and lost links, the newest first."""

from __future__ import annotations

from datetime import date, datetime

from rich.style import Style
from rich.text import Text

from tui.drive.sentences import counted
from tui.session.changes import (
    Change,
    ChangeList,
    LineLoss,
    LineRun,
    change_text,
    device_of,
    time_of_change,
)
from tui.widgets.drawing import wrapped
from tui.widgets.palette import ALARM, FAINT, FAULT, PLAIN, STRONG

CHANGE_TIME_WIDTH = 10
CHANGE_LINES = 4
"""Lines of one change at most."""
NOTHING_SINCE = " Nothing since then is in the journal or in the record of a line."


def change_list_lines(changes: ChangeList, width: int, today: date) -> list[Text]:
    """All changes, with a line before those of an earlier day."""
    found = [Text(f" {text}", ALARM, no_wrap=True) for text in _troubles(changes)]
    in_order = changes.in_order
    several = len({change.line for change in in_order}) > 1
    day = today
    for change in reversed(in_order):
        when = time_of_change(change)
        if when is not None and when.date() != day:
            day = when.date()
            found.append(Text(f" {day:%A}, {day.isoformat()}", FAINT, no_wrap=True))
        found += _lines(change, when, width, several=several)
    return found if in_order else [*found, Text(NOTHING_SINCE, FAINT)]


def change_count_text(changes: ChangeList) -> str:
    """The number of changes."""
    count = len(changes.entries) + len(changes.runs) + len(changes.losses)
    return counted(count, "1 change", "{count} changes")


def _troubles(changes: ChangeList) -> list[str]:
    lines = len(changes.damaged)
    damaged = "1 line of the journal is damaged.", "{count} lines of the journal are damaged."
    return [*([counted(lines, *damaged)] if lines else []), *changes.unread]


def _lines(change: Change, when: datetime | None, width: int, *, several: bool) -> list[Text]:
    """A change with its time and its drive; with its line if there are several."""
    device = device_of(change)
    place = [change.line] if several else []
    place += [f"drive {device}" if several else f"Drive {device}"] if device is not None else []
    text = ": ".join([*([", ".join(place)] if place else []), change_text(change)])
    parts = wrapped(text, width - CHANGE_TIME_WIDTH - 1, CHANGE_LINES)
    found = []
    for number, part in enumerate(parts):
        at = f"{when:%H:%M:%S}" if not number and when is not None else ""
        line = Text(f" {at:<{CHANGE_TIME_WIDTH - 1}}", FAINT, no_wrap=True)
        line.append(part, _style(change))
        found.append(line)
    return found


def _style(change: Change) -> Style:
    match change:
        case LineRun():
            return STRONG
        case LineLoss():
            return ALARM
        case _:
            tripped = change.kind == "fault" and change.answer != "reset"
            return FAULT if tripped else PLAIN
