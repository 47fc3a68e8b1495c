"""The two rows that every screen of a replay has instead of status bar and tabs. Pure functions."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain

from .drawing import short
from .palette import REPLAY_BLOCK, REPLAY_FAINT, REPLAY_SIGN

CHECKERS = "▚▚"
NO_MOTOR = "no motor to stop"
"""Label of the stop key if no line is open beside a replay."""
NOTHING_IS_SENT = "nothing is sent"
EVENT_SIGNS: Mapping[str, str] = {"fault": "■", "failed": "■", "stop": "▼", "commander": "▶"}
OTHER_EVENT = "●"
HERE = "█"
REPLAY_NAME_LEAST = 4
"""Cells of a drive's address and name beside its state."""
DATE_FROM = 72
"""Width of the terminal from which the first row has the date."""
BAR_LEAST = 10
"""Cells of the bar of time in the narrowest terminal."""


class ReplayView(NamedTuple):
    """A replay at one moment; times in seconds since 1970."""

    begin: float
    end: float
    now: float
    speed: float
    playing: bool
    drive: str = ""
    """The open drive with its state, else the record."""
    events: tuple[tuple[float, str], ...] = ()
    """Times and kinds of the recorded events."""


def replay_line(view: ReplayView, width: int) -> Text:
    """The first row: the mark, speed and time, the drive, and that nothing is sent."""
    text = Text(f"{CHECKERS} REPLAY {CHECKERS}", REPLAY_BLOCK, no_wrap=True)
    sign = "▶▶" if view.playing else "HELD"
    text.append(f" ×{view.speed:g} {sign:<4}", REPLAY_BLOCK)
    text.append(f" {time.strftime('%H:%M:%S', time.localtime(view.now))}", REPLAY_BLOCK)
    if width >= DATE_FROM:
        text.append(f" {time.strftime('%d %b', time.localtime(view.now))}", REPLAY_FAINT)
    end = f" {NOTHING_IS_SENT} "
    room = width - text.cell_len - len(end)
    drive = _drive(plain(view.drive), room - 2)
    text.append(f"  {drive}".ljust(max(0, room)), REPLAY_BLOCK)
    text.append(end, REPLAY_FAINT)
    text.truncate(width, pad=True)
    return text


def _drive(text: str, room: int) -> str:
    """The drive and its state in at most `room` cells: its name is cut first."""
    name, was, state = text.rpartition(" was ")
    left = room - len(was + state)
    if left >= REPLAY_NAME_LEAST:
        return f"{short(name, left)}{was}{state}"
    return short(f"{name.partition(' ')[0]} {state}" if was else text, room) if room > 0 else ""


def time_line(view: ReplayView, width: int) -> Text:
    """The second row: the bar of the recorded time with its events, and the time gone."""
    begin, end = (time.strftime("%H:%M:%S", time.localtime(at)) for at in (view.begin, view.end))
    gone = f" {_span(view.now - view.begin)}/{_span(view.end - view.begin)} "
    text = Text(f" {begin} ", REPLAY_FAINT, no_wrap=True)
    cells = max(BAR_LEAST, width - text.cell_len - len(f" {end}") - len(gone))
    text.append_text(_bar(view, cells))
    text.append(f" {end}", REPLAY_FAINT).append(gone, REPLAY_BLOCK)
    text.truncate(width, pad=True)
    return text


def _bar(view: ReplayView, cells: int) -> Text:
    bar: list[tuple[str, Style]] = [("━", REPLAY_BLOCK)] * cells
    for at, kind in view.events:
        bar[_cell(view, at, cells)] = (EVENT_SIGNS.get(kind, OTHER_EVENT), REPLAY_SIGN)
    bar[_cell(view, view.now, cells)] = (HERE, REPLAY_BLOCK)
    text = Text(no_wrap=True)
    for sign, style in bar:
        text.append(sign, style)
    return text


def _cell(view: ReplayView, at: float, cells: int) -> int:
    share = (at - view.begin) / max(1e-6, view.end - view.begin)
    return max(0, min(cells - 1, int(share * cells)))


def _span(seconds: float) -> str:
    """A span as minutes and seconds, or with hours."""
    whole = max(0, int(seconds))
    minutes, rest = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes}:{rest:02}"
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}"
