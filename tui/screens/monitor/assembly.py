"""Rows of all parts of Monitor, and of its other values in columns; pure functions of a view.

`start_monitor` starts the polls of what they show.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from rich.text import Text

from tui.bus.model import LineStatus
from tui.drive.profile.profile import Profile, is_verified, mark_of
from tui.drive.profile.schema import MonitoringValue, Parameter, Quantity
from tui.drive.values import NOT_AVAILABLE, is_enumeration
from tui.screens.monitor.readouts import gauge
from tui.session.monitor.trend import readout_parameter
from tui.session.shown import Quality
from tui.widgets.drawing import fitted_names, rule, short, wrapped
from tui.widgets.palette import ALARM, ATTENTION, FAINT, KEY, PLAIN, STALE, STRONG, age_text

from .arrange import WIDE_VALUE_COLUMN, Arrangement
from .curves import curve_lines
from .readouts import framed, readout_lines, readout_quantities
from .state import state_lines
from .view import View, end_of
from .words import (
    WordPage,
    alarm_line,
    bit_columns,
    bit_grid,
    bit_lines,
    has_alarm,
    shown_words,
    word_line,
    word_pages,
)

if TYPE_CHECKING:
    from tui.session.console import DriveConsole

LABELS: dict[Quantity, str] = {
    "ramp_output": "After ramp",
    "speed": "Speed",
    "motor_voltage": "Motor voltage",
    "mains_voltage": "Mains",
    "dc_bus": "DC bus",
    "torque": "Torque",
    "power": "Power",
    "input_power": "Input power",
    "drive_thermal": "Drive thermal",
    "motor_thermal": "Motor thermal",
    "motor_load": "Motor load",
    "drive_load": "Drive load",
    "energy": "Energy",
    "run_hours": "Run time",
    "power_on_hours": "Power-on time",
}
SHORT_LABELS: dict[Quantity, str] = {
    "ramp_output": "Ramped",
    "motor_voltage": "Motor V",
    "mains_voltage": "Mains",
    "input_power": "Input",
    "drive_thermal": "Drv th",
    "motor_thermal": "Mot th",
    "motor_load": "Load",
    "drive_load": "Drv ld",
    "run_hours": "Runtime",
    "power_on_hours": "On time",
}
"""Labels for narrow columns, of 7 cells at most: names in the middle of which nothing is cut."""
IN_READOUTS: frozenset[Quantity] = frozenset(
    {"output_frequency", "frequency_reference", "motor_current"}
)
UNIT_CELLS, NUMBER_CELLS, SHORT_NUMBER_CELLS = 3, 7, 6
SHORT_FROM = 22
"""Least cells of a column for full labels and numbers."""
VALUE_CELLS = 24
"""Cells of a value that has a bar after it."""
VALUE_CELLS_MOST = 30
BAR_CELLS, END_CELLS = 8, 4


@lru_cache(maxsize=16)
def other_values(profile: Profile, *, wide: bool = False) -> Sequence[MonitoringValue]:
    """Return the values of the monitoring set without a readout, in the profile's order."""
    found = (readout_parameter(profile, q) for q in readout_quantities(profile, wide=wide))
    shown = {parameter.code for parameter in found if parameter is not None}
    values = profile.data.monitoring.values
    return tuple(v for v in values if v.parameter not in shown and _is_other(profile, v))


def _is_other(profile: Profile, value: MonitoringValue) -> bool:
    parameter = profile[value.parameter]
    if parameter.quantity in IN_READOUTS:
        return False
    if parameter.quantity in LABELS:
        return True
    if parameter.bits or is_enumeration(parameter) or parameter.quantity is not None:
        return False
    return parameter.code != profile.data.faults.parameter and bool(
        parameter.unit or not is_verified(parameter)
    )


def motor_lines(
    view: View, width: int, rows: int, columns: int, *, wide: bool = False
) -> list[Text]:
    """Return the values column by column, as many as fit. Tab shows the others."""
    values = other_values(view.profile, wide=wide)[: rows * columns]
    cells = (width - 1) // columns
    barred = any(value.high for value in values)
    labels = value_labels(view.profile, values, cells, barred)
    lines = [Text(" ", no_wrap=True) for _ in range(rows)]
    for at, (value, label) in enumerate(zip(values, labels, strict=True)):
        place = _value(view, value, label, cells, barred)
        lines[at % rows].append_text(place).append(" " * (cells - place.cell_len))
    return lines


def value_cells(cells: int, barred: bool) -> int:
    """Return the cells for name, number and unit in a column of `cells` cells."""
    with_bar = VALUE_CELLS + 2 + BAR_CELLS + END_CELLS
    return VALUE_CELLS if barred and cells >= with_bar else min(cells - 2, VALUE_CELLS_MOST)


def value_labels(
    profile: Profile, values: Sequence[MonitoringValue], cells: int, barred: bool
) -> list[str]:
    """Return distinct names of values with their marks, padded to fit a column of `cells` cells."""
    numbers = SHORT_NUMBER_CELLS if cells < SHORT_FROM else NUMBER_CELLS
    room = value_cells(cells, barred) - numbers - UNIT_CELLS - 1
    parameters = [profile[value.parameter] for value in values]
    marks = [f" {mark_of(profile, parameter)}".rstrip() for parameter in parameters]
    names = [_label(parameter, is_short=cells < SHORT_FROM) for parameter in parameters]
    fitted = fitted_names(tuple(names), max(1, room - max(map(len, marks), default=0)))
    return [f"{fitted[name]}{mark}".ljust(room) for name, mark in zip(names, marks, strict=True)]


def _value(view: View, value: MonitoringValue, label: str, cells: int, barred: bool) -> Text:
    """Return name, number and unit of a value, followed by a bar if there is room."""
    parameter = view.profile[value.parameter]
    columns = value_cells(cells, barred)
    numbers = SHORT_NUMBER_CELLS if cells < SHORT_FROM else NUMBER_CELLS
    text = Text(label, FAINT, no_wrap=True)
    reading = view.reading(value.parameter)
    if reading is None or reading.raw is None:
        text.append(f"{NOT_AVAILABLE:>{numbers}}", FAINT)
        return text.append(f" {short(parameter.unit or 'raw', UNIT_CELLS):<{UNIT_CELLS}}", FAINT)
    number, unit = reading.drawn(
        view.now,
        current=lambda held: ((held.text, STRONG), (held.unit or "raw", FAINT)),
        old=lambda held, age: ((held.text, FAINT), (age_text(age), STALE)),
        missing=((NOT_AVAILABLE, FAINT), (age_text(reading.age(view.now)), STALE)),
    )
    text.append(f"{short(number[0], numbers):>{numbers}}", number[1])
    text.append(f" {short(unit[0], UNIT_CELLS):<{UNIT_CELLS}}", unit[1])
    high = end_of(view, value.high)
    if (
        cells >= columns + 2 + BAR_CELLS + END_CELLS
        and high is not None
        and reading.quality is Quality.GOOD
    ):
        low = end_of(view, value.low) or 0.0
        text.append("  ")
        text.append_text(gauge(reading.current_number, low, high, BAR_CELLS))
        text.append(short(f"{high:g}", END_CELLS), FAINT)
    return text


def _label(parameter: Parameter, *, is_short: bool) -> str:
    """Return the label of a quantity; any other value has the name of its parameter."""
    if parameter.quantity is None:
        return parameter.name
    full = LABELS.get(parameter.quantity, parameter.name)
    return SHORT_LABELS.get(parameter.quantity, full) if is_short else full


NOTICE_ROWS = 2
HELD = 0.9
"""Least share of the requested poll rate that counts as reached."""


def notice_lines(view: View, width: int) -> list[Text]:
    """Return the most important notice in at most two rows.

    The list is empty without a notice, in a fault, and while values are not current.
    """
    if view.snapshot is None or view.lost or view.snapshot.state.kind == "fault":
        return []
    control = view.control
    no_effect = f"No effect. {control.hindrance.sentence}" if control.hindrance else ""
    for message, style in (
        (control.offer, ATTENTION),
        (control.lost, ALARM),
        (control.why_disarmed, ATTENTION),
        (no_effect, PLAIN),
    ):
        if message:
            return [Text(f"  {line}", style) for line in wrapped(message, width - 4, NOTICE_ROWS)]
    return []


def line_figures(view: View) -> Text:
    """Return the poll rate in cycles per second, and the block that carries the values.

    A replay has the rate of its record, whatever rate the panel requests on a line.
    """
    rate = view.snapshot.rate if view.snapshot and not view.lost else 0.0
    wished = 1 / view.period
    held = view.replayed or rate > HELD * wished or not rate
    block = view.snapshot.block.lower() if view.snapshot is not None else ""
    cycles = f"{rate:.1f} cycles/s" if view.replayed else f"{rate:.1f} of {wished:.1f} cycles/s"
    figures = cycles
    if block:
        figures = f"{cycles} by {block}"
    text = Text(f"{figures} ", FAINT, no_wrap=True)
    if not held:
        text.stylize(ALARM, 0, len(cycles))
    return text


Parts = dict[str, list[Text]]
WORD_WIDTH = 30
"""Least cells of each table of bits, if several are side by side."""
NEXT_CELLS = 12
WordTable = tuple[WordPage, ...]
"""Pages of bits that Tab shows together; empty for the table of all values."""


def monitor_parts(view: View, room: Arrangement, words: Sequence[Parameter]) -> Parts:
    """Return the rows of each part, by its widget ID.

    Each part has exactly its number of rows; a notice may add some to the message.
    """
    lead = [Text("")] * room.lead
    if view.snapshot is None and view.stop is None and view.line.status is LineStatus.CONNECTED:
        # frames of nothing would delay the first values, on a slow link by a second
        waits = [*lead, Text(" ").append_text(state_lines(view, room.state_width - 4)[0])]
        rest = {place: [Text("")] for place in ("readouts", "motor", "curve")}
        return {**rest, "state": waits, "message": [Text("")] * room.bottom}
    readouts = readout_lines(view, room.width - room.state_width - 1, wide=room.third)
    return {
        "readouts": lead + readouts,
        "state": lead + framed_state(view, room.state_width),
        "motor": motor_lines(view, room.width, room.values, room.columns, wide=room.third),
        "curve": curve_or_table(view, room, words),
        "message": bottom_lines(view, room, words),
    }


def framed_state(view: View, width: int) -> list[Text]:
    """Return the framed state block, with the line's answers in its lower edge."""
    head, *rows = state_lines(view, width - 4)
    right = Text(" ").append_text(head).append(" ")
    title = Text(" State ", FAINT)
    if title.cell_len + right.cell_len > width - 2:  # the state itself is never left out
        title = Text("")
        right.truncate(width - 2, overflow="ellipsis")
    padded = [Text(" ").append_text(row).append(" ") for row in rows]
    return framed(title, right, padded[:3], padded[3], width)


def curve_or_table(view: View, room: Arrangement, words: Sequence[Parameter]) -> list[Text]:
    """Return the curve, or the table that Tab shows instead."""
    found = tables(view.profile, room, words)
    if view.word is None or view.word >= len(found):
        return curve_lines(view, room)
    return _table_lines(view, room, found[view.word])


def tables(profile: Profile, room: Arrangement, words: Sequence[Parameter]) -> list[WordTable]:
    """Return the tables in the order of Tab; all values are first if some do not fit above."""
    values = other_values(profile, wide=room.third)
    found: list[WordTable] = [()] if len(values) > room.values * room.columns else []
    if not room.wide:
        most = bit_columns(room.width - 1) * (room.curve - 1)
        return found + [(page,) for page in word_pages(words, most)]
    pages, many = word_pages(words, room.curve - 1), room.width // WORD_WIDTH
    return found + [tuple(pages[at : at + many]) for at in range(0, len(pages), many)]


def _table_lines(view: View, room: Arrangement, table: WordTable) -> list[Text]:
    """Return a table in exactly the rows of the curve."""
    width = room.width - 1
    following = Text.assemble(("  Tab", KEY), (" next", FAINT))
    if not table:
        columns = max(1, width // WIDE_VALUE_COLUMN)
        rows = -(-len(other_values(view.profile, wide=room.third)) // columns)
        heading = Text(" ").append_text(rule("All values", width - NEXT_CELLS))
        lines = motor_lines(view, width, min(rows, room.curve - 1), columns, wide=room.third)
        rest = [Text("")] * (room.curve - 1 - len(lines))
        return [heading.append_text(following), *lines, *rest]
    if len(table) == 1 and not room.wide:
        return bit_grid(view, table[0], width, room.curve)
    cells = width // len(table) - 1
    parts = [bit_lines(view, page, cells) for page in table]
    lines = [Text(no_wrap=True) for _ in range(room.curve)]
    for part in parts:
        for line, row in zip(lines, [*part, *[Text("")] * room.curve], strict=False):
            line.append_text(row).append(" " * (cells + 1 - row.cell_len))
    return lines


def bottom_lines(view: View, room: Arrangement, words: Sequence[Parameter]) -> list[Text]:
    """Return notices, the set bits of up to two words, and the alarms in the last row.

    If there is one row, notices and an alarm still get rows of their own; words get none.
    """
    notices = notice_lines(view, room.width)
    figures = line_figures(view) if room.wide else Text("")
    last = alarm_line(view, room.width - figures.cell_len - 1, tab=True)
    last.append(" ").append_text(figures)
    texts = notices + [word_line(view, word, room.width - 1) for word in shown_words(words)]
    if room.bottom == 1:
        return [*notices, last] if has_alarm(view) else notices or texts[:1] or [last]
    space = max(room.bottom - 1, len(notices))
    texts = texts[:space]
    return [*texts, *[Text("")] * (space - len(texts)), last]


def watched_words(profile: Profile) -> list[Parameter]:
    """Return the words with named bits: the status word, the monitoring set's, inputs, outputs."""
    watched = [profile[v.parameter] for v in profile.data.monitoring.values]
    found = [parameter for parameter in watched if parameter.bits]
    for quantity in ("digital_inputs", "digital_outputs"):
        parameter = profile.quantity(quantity)
        if parameter is not None and parameter.bits and parameter not in found:
            found.append(parameter)
    return sorted(found, key=lambda p: p.quantity != "status_word")


def codes_beside(profile: Profile) -> list[str]:
    """Return the codes to read slowly: ends of bars, channels, and words with named bits."""
    codes = [v.high for v in profile.data.monitoring.values if profile.get(v.high)]
    for quantity in ("command_channel", "reference_channel"):
        parameter = profile.quantity(quantity)
        if parameter is not None:
            codes.append(parameter.code)
    codes += [parameter.code for parameter in watched_words(profile)]
    return list(dict.fromkeys(codes))


def start_monitor(console: DriveConsole, period: float) -> None:
    """Poll what Monitor shows, each `period` seconds."""
    console.monitor.start(period=period, extra=codes_beside(console.session.profile))
