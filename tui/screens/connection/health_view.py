"""Health of the line, and of the drive under the cursor, in the last minute. Pure functions."""

from __future__ import annotations

from dataclasses import replace

from rich.text import Text

from tui.bus.api import DeviceCounters, LastMinute, LineCounters
from tui.session.monitor.line_health import LEAST_REPLIES, POOR, SEVERAL_FRAMES, percent
from tui.widgets.palette import ALARM, FAINT, PLAIN

ONE_ROW, NARROW = 120, 80
"""Minimum columns for line and drive in one row, and for the number of replies."""
LINE, DRIVE = " Line 60 s ", " Drive {:<4}"
NO_REPLIES = "no replies"

_STRANGE = ("foreign", "strays")


def health_lines(counted: LineCounters, device: int | None, width: int) -> list[Text]:
    """Draw good, lost, damaged, foreign and stray frames, each figure in a fixed column.

    Line and drive share a row from `ONE_ROW` columns; below, there are two rows.
    """
    beside, cells = width >= ONE_ROW, 5 if NARROW <= width < ONE_ROW else 4
    minute = counted.minute
    line = Text(LINE, FAINT, no_wrap=True)
    _good(line, minute.share, minute.replies, " good" if beside else _of(minute.replies, width))
    _count_all(line, minute, ("lost", "damaged", *_STRANGE), cells)
    if device is None:
        return [line] if beside else [line, Text("")]
    own = counted.devices.get(device, DeviceCounters()).minute
    # replies missed by a silent drive count for the drive, not for the line
    own = replace(own, lost=own.lost + own.silent, silent=0)
    drive = Text(DRIVE.format(device), FAINT, no_wrap=True)
    _good(drive, own.share, own.replies, "" if beside else _of(own.replies, width))
    _count_all(drive, own, ("lost", "damaged"), cells)
    drive.append("" if beside else " " * (cells + len(" foreign")))
    _count_all(drive, own, ("strays",), cells)
    return [line.append("  ").append_text(drive)] if beside else [line, drive]


def _good(text: Text, share: float | None, replies: int, words: str) -> None:
    figure = f"{percent(share)} %"
    cells = len(figure) + len(words)
    if share is None and len(NO_REPLIES) <= cells:
        text.append(f"{NO_REPLIES:<{cells}}", FAINT)
        return
    text.append(figure, ALARM if _is_poor(share, replies) else PLAIN)
    text.append(words, FAINT)


def _of(replies: int, width: int) -> str:
    return f" of{_count(replies, 6)} good" if width >= NARROW else ""


def _is_poor(share: float | None, replies: int) -> bool:
    return share is not None and share < POOR and replies >= LEAST_REPLIES


def _count_all(text: Text, minute: LastMinute, names: tuple[str, ...], cells: int) -> None:
    poor = _is_poor(minute.share, minute.replies)
    for name in names:
        number: int = getattr(minute, name)
        bad = number >= SEVERAL_FRAMES if name in _STRANGE else poor and number
        style = ALARM if bad else PLAIN if number else FAINT
        text.append(_count(number, cells), style).append(f" {name}", FAINT)


def _count(number: int, cells: int) -> str:
    """Format a count in `cells` cells, the first one blank; large counts as thousands (k)."""
    short = str(number) if number < 10 ** (cells - 1) else f"{number // 1000}k"
    return f"{short:>{cells}}"
