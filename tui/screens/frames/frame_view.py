"""One frame as a row of the list, and several frames as text for a file. Pure functions."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rich.text import Text

from tui.bus.api import Frame
from tui.drive.plain import plain
from tui.widgets.drawing import cut, cut_at_word, short
from tui.widgets.palette import ALARM, CURSOR, FAINT, PLAIN, STRONG
from tui.wire.frames import hex_text

FEWEST = 12
"""Minimum columns for text or bytes, even if the note is long."""
BYTES_WIDTH = 44
"""Columns of the bytes if they are shown next to the text."""
BESIDE_BYTES = 110
"""Minimum columns to show text and bytes side by side, and the hour in times."""


def frame_time(wall: float) -> str:
    """Format seconds since 1970 as the local time of day, to the millisecond."""
    thousandth = int(wall * 1000) % 1000
    return f"{time.strftime('%H:%M:%S', time.localtime(wall))}.{thousandth:03d}"


def gap_text(seconds: float | None) -> str:
    """Format the time since the previous frame in nine columns: ms below 1 s, then s."""
    if seconds is None:
        return " " * 9
    reported = f"{1000 * seconds:.1f} ms" if seconds < 0.9999 else f"{seconds:.2f} s"
    if seconds >= 100:
        reported = f"{seconds:.0f} s"
    return f"{'+' + reported:>9}"


def gaps(frames: Sequence[Frame]) -> list[float | None]:
    """Return the seconds between each frame and the one before it; None for the first."""
    before = [None, *(frame.time for frame in frames)][: len(frames)]
    return [
        None if value is None else max(0.0, frame.time - value)
        for value, frame in zip(before, frames, strict=True)
    ]


def frame_line(
    frame: Frame,
    wall: float,
    gap: float | None,
    width: int,
    words: str = "",
    *,
    found: bool = False,
) -> Text:
    """Draw a frame: time, gap, direction, text or bytes, note.

    `wall` is in seconds since 1970, `gap` in seconds. Without `words`, the bytes are shown. A frame
    that was `found` is highlighted.
    """
    text = Text(no_wrap=True)
    at = frame_time(wall)
    text.append(f" {at if width >= BESIDE_BYTES else at[3:]} {gap_text(gap)} ", FAINT)
    text.append("→ " if frame.direction == "out" else "  ← ", STRONG)
    note = f"  {frame.note}" if frame.note else ""
    room = max(FEWEST, width - text.cell_len - len(note))
    if not words:
        text.append(short(hex_text(frame.data), room), PLAIN)
    elif width >= BESIDE_BYTES:
        left = max(FEWEST, room - BYTES_WIDTH)
        text.append(cut(words, left), PLAIN)
        text.append(f" {short(hex_text(frame.data), BYTES_WIDTH - 1)}", FAINT)
    else:
        text.append(cut_at_word(words, room), PLAIN)
    text.append(note, ALARM)
    if found:
        text.stylize(CURSOR)
    return text


def frames_text(
    frames: Sequence[Frame],
    places: Sequence[int],
    reported: Sequence[str],
    since_epoch: float,
    heading: Sequence[str],
) -> str:
    """Format the frames at `places` as lines with tabs, after comment lines with the heading.

    `since_epoch` plus a frame's time is in seconds since 1970. `reported` has a text per place.
    """
    between = gaps(frames)
    lines = [f"# {line}" for line in heading]
    lines.append("# date time\tgap ms\tdirection\tsays\tnote\tbytes")
    for at, words in zip(places, reported, strict=True):
        frame, gap = frames[at], between[at]
        wall = since_epoch + frame.time
        day = time.strftime("%Y-%m-%d", time.localtime(wall))
        ms = "" if gap is None else f"{1000 * gap:.1f}"
        way = "request" if frame.direction == "out" else "reply"
        message = plain(words), plain(frame.note)
        parts = (f"{day} {frame_time(wall)}", ms, way, *message, hex_text(frame.data))
        lines.append("\t".join(parts))
    return "\n".join(lines) + "\n"
