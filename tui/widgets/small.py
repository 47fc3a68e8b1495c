"""Contents of a terminal that is too small for a screen: the motor, and the keys that stop it."""

from __future__ import annotations

from rich.text import Text

from tui.drive.plain import plain

from .drawing import wrapped
from .palette import (
    ALARM,
    ATTENTION_BLOCK,
    FAINT,
    FAULT,
    STALE,
    STATE_SIGNS,
    STOP_KEY,
    STRONG,
    age_text,
)
from .replay_bar import NO_MOTOR, replay_line
from .strip import STRIP_STYLES, DriveNow, StripView

LEAST_WIDTH, LEAST_HEIGHT = 60, 16
"""Columns and rows that every screen needs."""

ROWS_FOR_GAPS = 10
"""Rows from which empty lines separate the parts."""

STOPS = (("Space", ""), ("F12", ""), ("F9", "STOP ALL"))


def is_too_small(width: int, height: int) -> bool:
    """Return True if a terminal is too small for a screen."""
    return width < LEAST_WIDTH or height < LEAST_HEIGHT


def small_lines(view: StripView, target: str, width: int, height: int) -> list[Text]:
    """The state, the figures, the stop keys and the sentence; the end is dropped if too long.

    `target` is the label of the stop key.
    """
    drive = view.drive
    lines = [replay_line(view.replay, width)] if view.replay is not None else []
    no_drive = [Text(" No drive is open.", STRONG)]
    lines += _drive_lines(drive, width) if drive is not None else no_drive
    if view.faults:
        lines.append(Text(f" {view.faults} in fault on this line", FAULT))
    apart = [Text()] if height >= ROWS_FOR_GAPS else []
    lines += [*apart, *_keys(target, width), *apart]
    message = (
        f"{width} x {height} is too small: make it {LEAST_WIDTH} x {LEAST_HEIGHT}."
        " Until then only the stop keys work."
    )
    lines += [Text(f" {part}", ALARM) for part in wrapped(message, max(8, width - 2), 4)]
    for line in lines:
        line.no_wrap = True
        line.truncate(width)
    return lines[:height]


def _drive_lines(drive: DriveNow, width: int) -> list[Text]:
    """State, figures with their units, and the name."""
    style = STRIP_STYLES.get(drive.kind, STRONG)
    state = f"{STATE_SIGNS.get(drive.kind, '□')} {drive.words}"
    if drive.age is not None:
        style, state = ALARM, f"? {drive.words} {age_text(drive.age)} ago"
    line = Text(f" {drive.device} ", FAINT).append(state, style)
    if drive.armed is not None:
        line.append(" ").append(f" ARM {drive.armed:2.0f} ", ATTENTION_BLOCK)
    values = Text()
    style = STRONG if drive.age is None else STALE
    for text, unit in (
        (drive.frequency, drive.frequency_unit),
        (drive.current, drive.current_unit),
    ):
        values.append(f"{text or '-----':>6}", style).append(f" {unit}  ", FAINT)
    name = Text(f" {plain(drive.name or drive.model)}", FAINT)
    return [line, values, name]


def _keys(target: str, width: int) -> list[Text]:
    """The stop keys, on as many lines as they need."""
    lines = [Text()]
    if target == NO_MOTOR:
        return [Text(f" {target}", FAINT)]
    for key, label in STOPS:
        part = Text(f" {key} {label or target} ", STOP_KEY)
        if lines[-1].cell_len + part.cell_len > width:
            lines.append(Text())
        lines[-1].append_text(part)
    return lines
