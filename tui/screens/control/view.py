"""Commander of a drive as lines: sources, switches between them, writes of a change."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from tui.drive.control_source import SourceChange
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import ControlSource, Way
from tui.drive.shown import shown
from tui.drive.values import NOT_AVAILABLE
from tui.session.drive_state import channel_text
from tui.session.monitor.snapshot import Snapshot
from tui.widgets.drawing import cut, fitted_names, wrapped
from tui.widgets.palette import ALARM, ATTENTION, FAINT, LINE, PLAIN, STRONG

SOURCE_WIDTH = 16
WIRE = 18
LEFT_ROWS = 3
CHANGE_CODE, CHANGE_NAME = 10, 12
"""Cells of the code of a change, and those of its name at least."""


def now_lines(
    profile: Profile,
    today: ControlSource | None,
    latest: Snapshot | None,
    trouble: str,
    switches: Sequence[str],
    width: int,
) -> list[Text]:
    """Return three lines: a blank, the present commander with its configuration, and switches.

    `switches` are texts about inputs that switch to another commander.
    """
    lines = [Text("")]
    state = latest.state if latest is not None and not latest.error else None
    text = Text("  Commanded by  ", FAINT, no_wrap=True)
    text.append((state.channel if state else "") or _channel(profile, latest), STRONG)
    if trouble:
        text.append(f"   {trouble}", ALARM)
    elif today is None:
        text.append("   the active configuration is not listed", ALARM)
    else:
        text.append(f"   configuration {today.name}", FAINT)
    text.truncate(width, overflow="ellipsis")
    reported = (
        "; ".join(switch.partition(":")[0] for switch in switches)
        if len(switches) > 1
        else "".join(switches)
    )
    return [*lines, text, Text(cut(f"  {reported}", width).rstrip(), ATTENTION, no_wrap=True)]


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


def diagram(source: ControlSource) -> list[Text]:
    """The signal paths of command and reference; always four lines."""
    return [*_way(source.command, "command"), *_way(source.reference, "reference")]


def _way(way: Way, goal: str) -> list[Text]:
    first = Text(no_wrap=True)
    first.append(f"   {way.sources[0]:<{SOURCE_WIDTH}}", STRONG)
    if len(way.sources) == 1:
        first.append("─" * (WIRE + 2) + "▶ ", LINE)
        first.append(goal, PLAIN)
        return [first, Text("")]
    first.append("───┐ ", LINE)
    first.append(way.switch, ATTENTION)
    second = Text(no_wrap=True)
    second.append(f"   {way.sources[1]:<{SOURCE_WIDTH}}", STRONG)
    second.append("───┴" + "─" * (WIRE - 2) + "▶ ", LINE)
    second.append(goal, PLAIN)
    return [first, second]


def change_lines(profile: Profile, found: Sequence[SourceChange], width: int) -> list[Text]:
    """Return the pending writes, one parameter after another."""
    if not found:
        return [Text("   Nothing: this configuration is active.", STRONG)]
    values = [(_named(profile, c, c.old), _named(profile, c, c.new)) for c in found]
    names = tuple(change.parameter.name for change in found)
    beside = CHANGE_CODE + len(" ") + max(len(f"{old} → {new}") for old, new in values)
    room = max(CHANGE_NAME, min(width - beside, max(map(len, names))))
    fitted = fitted_names(names, room)
    return [
        _change(change, f"{fitted[name]:<{room}}", *texts, width)
        for change, name, texts in zip(found, names, values, strict=True)
    ]


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
    lines = [Text(f"   {line}", FAINT) for line in wrapped(source.note, width - 4, 2)]
    unsure = [change.parameter.code for change in found if not change.verified]
    if unsure:
        text = f"? No available manual confirms the address of {', '.join(unsure)}."
        lines.append(Text(cut(f"   {text}", width).rstrip(), ALARM))
    return lines
