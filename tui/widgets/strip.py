"""The first two lines of every screen: what the open drive does, and where the keys 1 to 7 lead.

Every part has its place, so that nothing moves when a value changes. Pure functions.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from rich.cells import cell_len
from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain
from tui.drive.sentences import counted

from .drawing import armed_text, cut, cut_at_word, short
from .palette import (
    ALARM,
    ATTENTION,
    ATTENTION_BLOCK,
    CURSOR,
    FAINT,
    FAULT,
    FAULT_BLOCK,
    KEY,
    PLAIN,
    RUNNING,
    STALE,
    STATE_SIGNS,
    STRONG,
    age_text,
)

STATE_WIDTH = 14
VALUES_WIDTH = 26
"""`123.4 → 123.4 Hz  123.4 A`, each at its place."""
RIGHT_WIDTH, NARROW_RIGHT = 24, 13
"""Kept for the faults of the line and for ARMED, whether they are there or not."""
NARROW, WIDE = 72, 100
"""Columns below which these are short, and from which a trouble of the line has its own place."""
LOAD_WIDTH = 12
"""Cells of the load of the line; on fewer than `WIDE` columns a trouble of the line is there."""
NAME_WIDEST = 44
BETWEEN = " · "
NAME_LEAST = 12
"""Cells that the end of a line's name keeps; where that is too many it is cut behind."""
STRIP_STYLES: Mapping[str, Style] = {
    "running": RUNNING,
    "fault": FAULT_BLOCK,
    "unknown": ALARM,
    "stop": ATTENTION,
    "stop failed": FAULT_BLOCK,
}


class DriveNow(NamedTuple):
    """The open drive at one moment, in words and figures."""

    device: int
    name: str
    """Name that it reports; empty if none."""
    model: str
    kind: str
    """Kind of its state, or `stop` while one is on its way, `stop failed` where it is none."""
    words: str
    frequency: str = ""
    reference: str = ""
    frequency_unit: str = "Hz"
    current: str = ""
    current_unit: str = "A"
    age: float | None = None
    """Seconds since it was heard, where that is too long ago to be the present."""
    armed: float | None = None
    """Seconds for which it is armed yet."""
    by: str = ""
    """Its commander, if it is not this panel."""


class StripView(NamedTuple):
    """All that the status bar shows."""

    drive: DriveNow | None = None
    line: str = ""
    """The open line and how many drives were found on it."""
    faults: int = 0
    """Drives of the line that are in fault."""
    unseen: bool = False
    """True if one of the faults was not looked at yet."""
    load: float | None = None
    clock: str = ""
    read_only: bool = False
    off_record: bool = False
    """True if the journal cannot be written."""
    trouble: tuple[str, ...] = ()
    """A few words for a trouble of the line, the longest first; empty while it is healthy."""


def strip_line(view: StripView, width: int) -> Text:
    """The first line: the open drive, or the line where none is open."""
    right = _right(view, width)
    if view.drive is None:
        left = Text(no_wrap=True)
        left.append(" Drive Panel", STRONG)
        room = max(0, width - right.cell_len - 1)
        reported = _line_text(plain(view.line), room - left.cell_len - len(BETWEEN))
        left.append(f"{BETWEEN}{reported}" if reported else "", FAINT)
        left.truncate(room, overflow="ellipsis")
    else:
        left = _drive(view.drive, width)
        left.truncate(max(0, width - right.cell_len))
    left.append(" " * max(0, width - left.cell_len - right.cell_len))
    left.append_text(right)
    left.truncate(width)
    return left


def _line_text(line: str, room: int) -> str:
    """The line in so many cells: its long name loses its beginning, its facts lose nothing."""
    name, between, more = line.partition(BETWEEN)
    left = room - cell_len(between + more)
    if cell_len(name) <= left or left < NAME_LEAST:
        return line
    while cell_len(name) >= left:
        name = name[1:]
    return f"…{name}{between}{more}"


def _drive(drive: DriveNow, width: int) -> Text:
    """Return its identity, state and values; the name gets the room that the others leave."""
    right = RIGHT_WIDTH if width >= NARROW else NARROW_RIGHT
    room = max(4, min(NAME_WIDEST, width - STATE_WIDTH - VALUES_WIDTH - right))
    who = Text(no_wrap=True)
    who.append(f"{drive.device:>2} ", FAINT)
    name, model = plain(drive.name), plain(drive.model)
    who.append(name or model, STRONG)
    if name and model and room - who.cell_len > 6:
        who.append(f" · {model}", FAINT)
    who.truncate(room - 1, overflow="ellipsis", pad=True)
    return who.append(" ").append_text(_state(drive)).append_text(_values(drive))


def _state(drive: DriveNow) -> Text:
    style = STRIP_STYLES.get(drive.kind, STRONG)
    sign = {"stop": "▼", "stop failed": "■"}.get(drive.kind, STATE_SIGNS.get(drive.kind, "□"))
    words = drive.words
    if drive.age is not None:
        sign, style, words = "?", ALARM, f"{age_text(drive.age)} ago"
    text = Text(no_wrap=True)
    text.append(f"{sign} {short(words, STATE_WIDTH - 3)}", style)
    text.append(" " * max(1, STATE_WIDTH - text.cell_len))
    return text


def _values(drive: DriveNow) -> Text:
    style = STRONG if drive.age is None else STALE
    text = Text(no_wrap=True)
    if not (drive.frequency or drive.current):
        return text.append(" " * VALUES_WIDTH)
    # the unit first behind the reference, as both have it
    text.append(f"{drive.frequency:>5}", style)
    text.append(f" → {drive.reference:>5}" if drive.reference else " " * 8, PLAIN)
    text.append(f" {drive.frequency_unit:<2}", FAINT)
    text.append(f"{drive.current:>6}", style)
    text.append(f" {short(drive.current_unit, 2):<2}", FAINT)
    return text


def _right(view: StripView, width: int) -> Text:
    """Return the part on the whole line, and whether keys move this drive's motor."""
    text, drive, narrow = Text(no_wrap=True), view.drive, width < NARROW
    room = NARROW_RIGHT if narrow else RIGHT_WIDTH
    off_record = "J!" if narrow and drive is not None else "NO JOURNAL "
    narrow = narrow or view.off_record
    if view.faults:
        count = counted(view.faults, "■ 1 fault", "■ {count} faults")
        count = f"■{view.faults}" if narrow else count
        style = FAULT_BLOCK if view.unseen else FAULT
        text.append(f" {count} " if view.unseen and not narrow else count, style)
        text.append(" ")
    if view.off_record:
        text.append(off_record, ALARM)
    if drive is not None and drive.armed is not None:
        armed = Text(f" ARM {drive.armed:2.0f} ", ATTENTION_BLOCK) if narrow else None
        text.append_text(armed or armed_text(drive.armed))
    elif view.read_only:
        text.append("read-only ", FAINT)
    elif drive is not None and drive.by:
        left = (NARROW_RIGHT if narrow else room) - text.cell_len - len("by  ")
        text.append(f"by {short(drive.by, max(4, left))} ", FAINT)
    if drive is not None:
        return _trouble(view.trouble, room - text.cell_len).append_text(text)
    load = f"load {view.load * 100:3.0f} %  " if view.load is not None else ""
    if width >= WIDE or not view.trouble:
        trouble = _trouble(view.trouble, width)
        return trouble.append_text(text).append(f"{load}{view.clock} ", FAINT)
    trouble = _trouble(view.trouble, LOAD_WIDTH)
    text.append_text(trouble).append(" " * (LOAD_WIDTH - trouble.cell_len))
    return text.append(f"{view.clock} ", FAINT)


def _trouble(signs: Sequence[str], room: int) -> Text:
    """The longest of the words for a trouble that there is room for; its sign alone, or nothing."""
    forms = (f"▲ {sign} " if sign else "▲ " for sign in signs)
    form = next((form for form in forms if len(form) <= room), "")
    return Text(no_wrap=True).append(form, ALARM)


class Tab(NamedTuple):
    """A screen of the panel as its tab shows it."""

    place: str
    key: str
    name: str
    narrow: str
    """Its name where the terminal is narrow."""
    room: int = 0
    """Cells kept for its mark."""


def tabs_line(
    tabs: Sequence[Tab],
    chosen: str,
    marks: Mapping[str, tuple[str, Style]],
    width: int,
    *,
    lead: bool = True,
) -> Text:
    """The second line: where the keys lead, what is there, and where we are.

    Where the keys do not `lead` there now, as digits are typed, they are drawn dim.
    """
    full = sum(len(tab.name) + tab.room + 3 for tab in tabs) + 1
    wide = full <= width
    text, block = Text(no_wrap=True), (0, 0)
    for tab in tabs:
        here, start = tab.place == chosen, text.cell_len
        text.append(f" {tab.key}", STRONG if here and lead else KEY if lead else FAINT)
        text.append(f" {tab.name if wide else tab.narrow}", STRONG if here else FAINT)
        mark, style = marks.get(tab.place, ("", PLAIN))
        text.append(f" {mark}" if mark and wide else mark, style)
        if wide:
            text.append(" " * max(0, start + len(tab.name) + 3 + tab.room - text.cell_len))
        if here:
            text.append(" ")
            block = (start, text.cell_len)
    text.stylize(CURSOR, *block)
    text.truncate(width)
    return text


def message_line(when: str, message: str, style: Style, hint: str, width: int) -> Text:
    """The last line but one: the newest event with its time, and which key shows more."""
    text = Text(no_wrap=True)
    text.append(f" {cut(when, 8)} ", FAINT)
    room = max(8, width - text.cell_len - (len(hint) + 2 if hint else 1))
    text.append(cut_at_word(message, room), style)
    if hint:
        text.append(" " * max(1, width - text.cell_len - len(hint) - 1))
        key, _, does = hint.partition(" ")
        text.append(key, KEY)
        text.append(f" {does}", FAINT)
    return text


class BarMessage(NamedTuple):
    """The present message; `age` in seconds."""

    when: str
    text: str
    kind: str
    age: float
    there: bool = False
    """True if it is about another drive than the one that is open."""


class FrameView(NamedTuple):
    """All parts around a screen at one moment."""

    strip: StripView
    place: str
    marks: dict[str, tuple[str, Style]]
    message: BarMessage | None
    not_stopped: tuple[str, ...] = ()
    """A text for each motor that a stop does not stop; drawn over everything, whole."""

    @property
    def at_once(self) -> object:
        """Parts shown at once on a slow link too: state, stop, fault, arming, message."""
        strip, drive, message = self.strip, self.strip.drive, self.message
        who = drive and (drive.device, drive.kind, drive.words, drive.age is None, drive.by)
        armed = drive is not None and drive.armed is not None
        # figures in a message count seconds
        text = message and re.sub(r"\d+", "", message.text)
        faults = strip.faults, strip.unseen, bool(strip.trouble)
        return who, armed, faults, strip.off_record, self.place, self.marks, text, self.not_stopped
