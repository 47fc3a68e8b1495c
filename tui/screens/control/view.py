"""Commander of a drive as lines: sources, switches between them, writes of a change."""

from __future__ import annotations

from collections.abc import Sequence

from rich.style import Style
from rich.text import Text

from tui.drive.control_source import SourceChange
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import ControlSource
from tui.drive.sentences import capitalized
from tui.drive.shown import shown
from tui.drive.signal_path import LineStep
from tui.drive.values import NOT_AVAILABLE
from tui.session.drive_state import channel_text
from tui.session.monitor.snapshot import Snapshot
from tui.widgets.drawing import fitted_names, wrapped
from tui.widgets.palette import ALARM, ATTENTION, FAINT, PLAIN, STRONG

LEFT_ROWS = 3
PART_ROWS = 3
"""Rows of one part of a line with a head, at most."""
SHORT_ROWS = 9
"""Rows of the writes in one sentence, at most."""
NOW_HEAD = 14
"""Cells of the head of a line."""
CHANGE_CODE, CHANGE_NAME = 10, 12
"""Cells of the code of a change, and those of its name at least."""


def headed_lines(head: str, parts: Sequence[tuple[str, Style]], width: int) -> list[Text]:
    """Return parts with their styles after a head, on as many lines as they need."""
    line, lines = Text(f"  {head:<{NOW_HEAD}}", FAINT, no_wrap=True), []
    room = width - 2 - NOW_HEAD
    begun = False
    for text, style in parts:
        used = line.cell_len - 2 - NOW_HEAD
        if begun and used + len(f" · {text}") > room:
            lines.append(line)
            line, begun = Text(" " * (2 + NOW_HEAD), no_wrap=True), False
        first, *more = wrapped(text, room, PART_ROWS) or [""]
        line.append(" · " if begun else "", FAINT)
        line.append(first, style)
        begun = True
        for part in more:
            lines.append(line)
            line = Text(" " * (2 + NOW_HEAD), no_wrap=True).append(part, style)
    return [*lines, line]


def now_lines(
    profile: Profile,
    today: ControlSource | None,
    latest: Snapshot | None,
    trouble: str,
    switches: Sequence[str],
    width: int,
    *,
    whole: bool,
) -> tuple[list[Text], list[Text]]:
    """Return the present commander, with its configuration if `whole`; and what can change it.

    `switches` are sentences about that.
    """
    state = latest.state if latest is not None and not latest.error else None
    parts = [((state.channel if state else "") or _channel(profile, latest), STRONG)]
    if trouble:
        parts.append((trouble, ALARM))
    elif today is not None and whole:
        parts.append((f"configuration {today.name}", FAINT))
    elif today is None and profile.data.control_sources:
        parts.append(("the active configuration is not listed", ALARM))
    more = [
        Text(f"  {line}", ATTENTION)
        for text in switches
        for line in wrapped(text, width - 4, PART_ROWS)
    ]
    return headed_lines("Commanded by", parts, width), more


def left_lines(left: str, width: int) -> list[Text]:
    """Lines about a running motor without a commander; empty if there is none."""
    text = f"{left} Press Space to stop it, or T on Monitor to take it over." if left else ""
    return [Text(f"  {line}", ATTENTION) for line in wrapped(text, width - 4, LEFT_ROWS)]


def _channel(profile: Profile, latest: Snapshot | None) -> str:
    """Return the commander from the drive's channel word, if its chart does not show it."""
    parameter = profile.quantity("command_channel")
    if parameter is None or latest is None or latest.error:
        return NOT_AVAILABLE
    reading = latest.readings.get(parameter.code)
    if reading is None:
        return NOT_AVAILABLE
    return reading.drawn(
        latest.time,
        current=lambda value: channel_text(parameter, value) or NOT_AVAILABLE,
        old=lambda value, age: f"was {channel_text(parameter, value)}",
        missing=NOT_AVAILABLE,
    )


def step_row(step: LineStep, *, staged: bool) -> Text:
    """Return the row of a step that makes this line a source."""
    text = Text(no_wrap=True).append(" → ", ATTENTION)
    text.append(capitalized(step.text), PLAIN)
    return text.append("   staged" if staged else "", ATTENTION)


def source_row(source: ControlSource, *, active: bool) -> Text:
    """Return the row of a configuration, with a mark at the active one."""
    text = Text(no_wrap=True).append(*((" ● ", STRONG) if active else (" · ", FAINT)))
    text.append(source.name, STRONG if active else PLAIN)
    return text.append("   active" if active else "", FAINT)


def change_lines(profile: Profile, found: Sequence[SourceChange], width: int) -> list[Text]:
    """Return the pending writes, one parameter after another."""
    if not found:
        return [Text("   Nothing: this configuration is active.", STRONG)]
    values = [(_named(profile, c, c.old), _named(profile, c, c.new)) for c in found]
    names = tuple(change.parameter.name for change in found)
    beside = CHANGE_CODE + len(" ") + max(len(f"{old} → {new}") for old, new in values)
    room = max(CHANGE_NAME, min(width - beside - 1, max(map(len, names))))
    fitted = fitted_names(names, room)
    return [
        _change(change, f"{fitted[name]:<{room}}", *texts, width)
        for change, name, texts in zip(found, names, values, strict=True)
    ]


def short_changes(profile: Profile, found: Sequence[SourceChange], width: int) -> list[Text]:
    """Return the pending writes in one sentence, for a small terminal."""
    texts = [
        f"{change.parameter.code}{'' if change.verified else '?'}"
        f" {_named(profile, change, change.old)} → {_named(profile, change, change.new)}"
        for change in found
    ]
    return [Text(f"   {line}", PLAIN) for line in wrapped(", ".join(texts), width - 4, SHORT_ROWS)]


def _change(change: SourceChange, name: str, old: str, new: str, width: int) -> Text:
    text = Text(no_wrap=True)
    mark = "" if change.verified else "?"
    text.append(
        f"   {change.parameter.code + mark:<{CHANGE_CODE - 3}}",
        PLAIN if change.verified else ALARM,
    )
    text.append(f"{name} ", FAINT)
    text.append(f"{old} → ", FAINT)
    text.append(new, STRONG)
    text.truncate(width, overflow="ellipsis")
    return text


def _named(profile: Profile, change: SourceChange, raw: int | None) -> str:
    if raw is None:
        return NOT_AVAILABLE
    text = shown(profile, change.parameter, raw, {}).display
    return text if str(raw) in text else f"{text} ({raw})"


def note_lines(source: ControlSource, found: Sequence[SourceChange], width: int) -> list[Text]:
    """Return the note on a configuration, and a warning about unverified parameters."""
    lines = [Text(f"   {line}", FAINT) for line in wrapped(source.note, width - 4, PART_ROWS)]
    unsure = [change.parameter.code for change in found if not change.verified]
    if unsure:
        text = f"? No available manual confirms the address of {', '.join(unsure)}."
        lines = [
            *(Text(f"   {line}", ALARM) for line in wrapped(text, width - 4, PART_ROWS)),
            *lines,
        ]
    return lines
