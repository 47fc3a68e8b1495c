"""Status bar, tabs and message line of every screen, as lines. Pure functions.

Every part has a fixed place, so that nothing moves when a value changes.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from rich.cells import cell_len
from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain
from tui.drive.sentences import counted

from .drawing import armed_text, cut, cut_at_word, fitted_name, short
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
from .replay_bar import ReplayView

STATE_WIDTH = 14
VALUES_WIDTH, NARROW_VALUES = 26, 23
"""Cells of `123.4 → 123.4 Hz  123.4 A`, and of `123.4→123.4 Hz 123.4 A `."""
RIGHT_WIDTH, MIDDLE_RIGHT, NARROW_RIGHT = 24, 21, 13
"""Cells reserved for the number of faults and for ARMED, by the width of the terminal."""
NARROW, MIDDLE, WIDE = 72, 86, 100
"""Columns below which texts are shortened, and from which line trouble has its own place."""
LOAD_WIDTH = 12
"""Cells of the load of the line; below `WIDE` columns, line trouble replaces the load."""
NAME_WIDEST = 44
BETWEEN = " · "
NAME_LEAST = 12
"""Cells of a line's name that are always shown; with less room, the end of the text is cut."""
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
    """Kind of its state; `stop` during a stop, `stop failed` if the motor did not stop."""
    words: str
    frequency: str = ""
    reference: str = ""
    frequency_unit: str = "Hz"
    current: str = ""
    current_unit: str = "A"
    age: float | None = None
    """Seconds since the last reply if the values are old; None if they are current."""
    armed: float | None = None
    """Seconds for which it stays armed; None if it is not armed."""
    by: str = ""
    """Its commander, if it is not this panel."""
    family: str = ""
    """Short form of its model; empty if there is none."""


class StripView(NamedTuple):
    """Contents of the status bar."""

    drive: DriveNow | None = None
    line: str = ""
    """The open line and how many drives were found on it."""
    faults: int = 0
    """Drives of the line that are in fault."""
    unseen: bool = False
    """True if one of the faults has not been viewed yet."""
    load: float | None = None
    clock: str = ""
    read_only: bool = False
    off_record: bool = False
    """True if the journal cannot be written."""
    trouble: tuple[str, ...] = ()
    """Texts for line trouble, the longest first; empty while the line is healthy."""
    replay: ReplayView | None = None
    """The replay that is shown; None if the drives are live."""


def strip_line(view: StripView, width: int) -> Text:
    """The status bar: the open drive, or the line if no drive is open."""
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
    """The line in at most `room` cells: only its name is shortened, at the beginning."""
    name, between, more = line.partition(BETWEEN)
    left = room - cell_len(between + more)
    if cell_len(name) <= left or left < NAME_LEAST:
        return line
    while cell_len(name) >= left:
        name = name[1:]
    return f"…{name}{between}{more}"


def _drive(drive: DriveNow, width: int) -> Text:
    """Return identity, state and values; the identity gets the remaining room."""
    values = NARROW_VALUES if width < NARROW else VALUES_WIDTH
    room = max(4, min(NAME_WIDEST, width - STATE_WIDTH - values - _right_width(width)))
    who = Text(no_wrap=True)
    who.append(f"{drive.device:>2} ", FAINT)
    name, model = identity_in(drive, room - who.cell_len - 1)
    who.append(name, STRONG).append(model, FAINT)
    who.truncate(room - 1, overflow="ellipsis", pad=True)
    who.append(" ").append_text(_state(drive))
    return who.append_text(_values(drive, is_narrow=width < NARROW))


LEAST_NAME = 6
"""Cells of a name that still identify its drive beside the model."""


def identity_in(drive: DriveNow, room: int) -> tuple[str, str]:
    """Return the name and the model in so many cells: a long model is short, then a long name."""
    name, model = plain(drive.name), plain(drive.model)
    if not name or not model:
        return name or model, ""
    family = plain(drive.family) or model
    forms = (f" · {model}", f" · {family}", f"·{family}")
    form = next((form for form in forms if cell_len(name + form) <= room), "")
    if form:
        return name, form
    left = room - cell_len(forms[-1])
    if left < LEAST_NAME:
        return _shortened(name, room), ""
    return _shortened(name, left), forms[-1]


def _shortened(name: str, room: int) -> str:
    """Return a name in at most so many cells; wide characters take two."""
    wide = cell_len(name) - len(name)
    return fitted_name(name, max(3, room - wide))


def _right_width(width: int) -> int:
    return NARROW_RIGHT if width < NARROW else MIDDLE_RIGHT if width < MIDDLE else RIGHT_WIDTH


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


def _values(drive: DriveNow, *, is_narrow: bool) -> Text:
    style = STRONG if drive.age is None else STALE
    text, arrow = Text(no_wrap=True), "→" if is_narrow else " → "
    if not (drive.frequency or drive.current):
        return text.append(" " * (NARROW_VALUES if is_narrow else VALUES_WIDTH))
    # one unit, after the reference: both values have it
    text.append(f"{drive.frequency:>5}", style)
    text.append(f"{arrow if drive.reference else '':{len(arrow)}}{drive.reference:>5}", PLAIN)
    text.append(f" {drive.frequency_unit:<2}", FAINT)
    text.append(f"{drive.current:>6}", style)
    text.append(f" {short(drive.current_unit, 2):<2}", FAINT)
    return text


def _right(view: StripView, width: int) -> Text:
    """Return the right part: faults of the line, and whether this drive is armed."""
    drive, room = view.drive, _right_width(width)
    # as much as has room, the shortest form in any case
    forms = (_whole_line(view, room, level=level) for level in range(LEVELS_MOST + 1))
    for text in forms:
        if text.cell_len <= room:
            break
    if drive is not None:
        return _trouble(view.trouble, room - text.cell_len).append_text(text)
    load = f"load {view.load * 100:3.0f} %  " if view.load is not None else ""
    if width >= WIDE or not view.trouble:
        trouble = _trouble(view.trouble, width)
        return trouble.append_text(text).append(f"{load}{view.clock} ", FAINT)
    trouble = _trouble(view.trouble, LOAD_WIDTH)
    text.append_text(trouble).append(" " * (LOAD_WIDTH - trouble.cell_len))
    return text.append(f"{view.clock} ", FAINT)


LEVELS_MOST = 3
"""Steps by which the part at the right shrinks: the faults, then ARMED, then the journal."""


def _whole_line(view: StripView, room: int, *, level: int) -> Text:
    """Return faults, a journal that cannot be written, and arming; at `level` 0 in full."""
    text, drive = Text(no_wrap=True), view.drive
    if view.faults:
        count = counted(view.faults, "■ 1 fault", "■ {count} faults")
        count = f"■{view.faults}" if level else f" {count} "
        text.append(count, FAULT_BLOCK if view.unseen else FAULT).append(" ")
    if view.off_record:
        text.append("J!" if level >= LEVELS_MOST and drive is not None else "NO JOURNAL", ALARM)
        text.append("" if level > 1 else " ")
    if drive is not None and drive.armed is not None:
        armed = Text(f" ARM {drive.armed:2.0f} ", ATTENTION_BLOCK) if level > 1 else None
        text.append_text(armed or armed_text(drive.armed))
    elif view.read_only:
        text.append("read-only ", FAINT)
    elif drive is not None and drive.by:
        left = room - text.cell_len - len("by  ")
        text.append(f"by {short(drive.by, max(4, left))} ", FAINT)
    return text


def _trouble(signs: Sequence[str], room: int) -> Text:
    """The longest text for line trouble that fits; the sign alone, or nothing."""
    forms = (f"▲ {sign} " if sign else "▲ " for sign in signs)
    form = next((form for form in forms if len(form) <= room), "")
    return Text(no_wrap=True).append(form, ALARM)


class Tab(NamedTuple):
    """A screen of the panel as its tab shows it."""

    place: str
    key: str
    name: str
    narrow: str
    """Its name in a narrow terminal."""


def tabs_line(
    tabs: Sequence[Tab],
    chosen: str,
    marks: Mapping[str, tuple[str, Style]],
    width: int,
    *,
    lead: bool = True,
) -> Text:
    """The tabs: key, name and mark of each screen, with the present one highlighted.

    A mark is one cell between the key and the name, so it moves nothing. The keys are dim if they
    do not `lead` to the screens now, because digits are being typed.
    """
    names = {tab.place: tab.name for tab in tabs}
    if (gap := tab_gap(names.values(), width)) < 1:
        names = {tab.place: tab.narrow for tab in tabs}
        gap = max(1, tab_gap(names.values(), width))
    text, block = Text(" ", no_wrap=True), (0, 0)
    for tab in tabs:
        here, start = tab.place == chosen, text.cell_len
        text.append(tab.key, STRONG if here and lead else KEY if lead else FAINT)
        mark, style = marks.get(tab.place, (" ", PLAIN))
        text.append(mark, style)
        text.append(names[tab.place], STRONG if here else FAINT)
        if here:
            block = (start - 1, text.cell_len + 1)
        text.append(" " * gap)
    text.stylize(CURSOR, *block)
    text.truncate(width)
    return text


TAB_GAP_MOST = 4


def tab_gap(names: Collection[str], width: int) -> int:
    """Return the cells between two tabs, the same for all; below 1 if there is no room."""
    cells = sum(len(name) + 2 for name in names)
    return min(TAB_GAP_MOST, (width - 2 - cells) // max(1, len(names) - 1))


def message_line(when: str, message: str, style: Style, hint: str, width: int) -> Text:
    """The message line: the newest event with its time, and the key that shows more."""
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
    """Contents of the message line; `age` in seconds."""

    when: str
    text: str
    kind: str
    age: float
    there: bool = False
    """True if it is about a drive other than the open one."""


class FrameView(NamedTuple):
    """Contents of the frame around a screen at one moment."""

    strip: StripView
    place: str
    marks: dict[str, tuple[str, Style]]
    message: BarMessage | None
    not_stopped: tuple[str, ...] = ()
    """A text for each motor that did not stop; always shown in full."""

    @property
    def at_once(self) -> object:
        """Parts that a slow link shows immediately, too: state, stop, fault, arming, message."""
        strip, drive, message = self.strip, self.strip.drive, self.message
        who = drive and (drive.device, drive.kind, drive.words, drive.age is None, drive.by)
        armed = drive is not None and drive.armed is not None
        # a message may count seconds: its figures do not make it new
        text = message and re.sub(r"\d+", "", message.text)
        faults = strip.faults, strip.unseen, bool(strip.trouble)
        replay = strip.replay and (strip.replay.playing, strip.replay.speed)
        shown = strip.off_record, self.place, self.marks, replay
        return who, armed, faults, *shown, text, self.not_stopped
