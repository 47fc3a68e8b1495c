"""Large readouts: output frequency, motor current, and one more if there is room.

Their digits are three rows high, drawn with box characters. Each has a frame with its name and
unit, its extremes on the page of the curve, and a bar. Pure functions of a view.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal
from functools import lru_cache
from itertools import groupby
from operator import itemgetter

from rich.style import Style
from rich.text import Text

from tui.drive.profile.profile import Profile, mark_of
from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.values import NOT_AVAILABLE, Value, possible_decimals
from tui.session.monitor.trend import TREND_QUANTITIES, readout_parameter
from tui.session.shown import Quality, Shown
from tui.widgets.drawing import short
from tui.widgets.palette import BAR, BAR_REST, FAINT, LINE, MARK, PLAIN, STALE, STRONG, age_text

from .curves import bar_end
from .time_axis import points_of_page
from .view import View, bar_number, directed, end_of


def gauge(
    value: float | None,
    low: float,
    high: float,
    width: int,
    mark: float | None = None,
    style: Style = BAR,
) -> Text:
    """A bar of exactly `width` cells, filled from zero (or the low end) to the value.

    If the low end is below zero, zero has a sign of its own inside the bar.
    """
    inner = max(1, width - 2)
    cells = [("─", BAR_REST)] * inner
    if high > low:
        zero = _halves(max(low, min(high, 0.0)), low, high, inner)
        if value is not None:
            end = _halves(value, low, high, inner)
            cells = [_cell(at, min(zero, end), max(zero, end), style) for at in range(inner)]
        if low < 0 < high and cells[at := min(inner - 1, zero // 2)][0] == "─":
            cells[at] = ("┼", LINE)
        if mark is not None:
            cells[min(inner - 1, _halves(mark, low, high, inner) // 2)] = ("┃", MARK)
    text = Text("├", LINE, no_wrap=True)
    for item, run in groupby(cells, key=itemgetter(1)):
        text.append("".join(character for character, _ in run), item)
    return text.append("┤", LINE)


def _halves(value: float, low: float, high: float, inner: int) -> int:
    """The position of a value, in halves of a cell."""
    return round((max(low, min(high, value)) - low) / (high - low) * inner * 2)


def _cell(at: int, start: int, end: int, style: Style) -> tuple[str, Style]:
    """The cell `at`; `start` and `end` of the filled part are in halves of a cell."""
    left, right = start <= 2 * at < end, start <= 2 * at + 1 < end
    if left and right:
        return "━", style
    if left or right:
        return ("╸" if left else "╺"), style
    return "─", BAR_REST


ROWS = 3
DIGIT_CELLS = 3
GLYPHS: Mapping[str, tuple[str, str, str]] = {
    "0": ("┌─┐", "│ │", "└─┘"),
    "1": ("  ╷", "  │", "  ╵"),
    "2": ("╶─┐", "┌─┘", "└─╴"),
    "3": ("╶─┐", "╶─┤", "╶─┘"),
    "4": ("╷ ╷", "└─┤", "  ╵"),
    "5": ("┌─╴", "└─┐", "╶─┘"),
    "6": ("┌─╴", "├─┐", "└─┘"),
    "7": ("╶─┐", "  │", "  ╵"),
    "8": ("┌─┐", "├─┤", "└─┘"),
    "9": ("┌─┐", "└─┤", "╶─┘"),
    "-": ("  ", "╶─", "  "),
    ".": (" ", " ", "."),
    " ": (" ", " ", " "),
}
"""The three rows of each character; a minus is two cells wide, a point one."""
PLAIN_GLYPHS: Mapping[str, tuple[str, str, str]] = {
    "0": (" _ ", "| |", "|_|"),
    "1": ("   ", "  |", "  |"),
    "2": (" _ ", " _|", "|_ "),
    "3": (" _ ", " _|", " _|"),
    "4": ("   ", "|_|", "  |"),
    "5": (" _ ", "|_ ", " _|"),
    "6": (" _ ", "|_ ", "|_|"),
    "7": (" _ ", "  |", "  |"),
    "8": (" _ ", "|_|", "|_|"),
    "9": (" _ ", "|_|", " _|"),
    "-": ("  ", "_ ", "  "),
    ".": (" ", " ", "."),
    " ": (" ", " ", " "),
}
"""The same in ASCII, for terminals without box characters."""
DASH = ("   ", "╶─╴", "   ")
"""One digit of a missing number."""


def readout_cells(decimals: int, *, signed: bool, whole: int = 3) -> int:
    """The width of a number with this many digits before and after the point."""
    point = 1 + DIGIT_CELLS * decimals if decimals else 0
    return (2 if signed else 0) + DIGIT_CELLS * whole + point


def big(text: str, width: int, *, plain: bool = False) -> list[str]:
    """A number in three rows, right-aligned in exactly `width` cells.

    A number that is too wide loses decimals first. If it is still too wide, or is not a number, the
    text is shown small in the lowest row. With `plain` it is drawn in ASCII.
    """
    glyphs = PLAIN_GLYPHS if plain else GLYPHS
    for shown in _shorter(text):
        rows = ["".join(glyphs[character][row] for character in shown) for row in range(ROWS)]
        if len(rows[0]) <= width:
            return [row.rjust(width) for row in rows]
    return [" " * width, " " * width, text[:width].rjust(width)]


def dashes(width: int) -> list[str]:
    """Three dashes instead of an unknown number."""
    return ["".join(part[row] for part in (DASH,) * 3).rjust(width)[:width] for row in range(ROWS)]


def _shorter(text: str) -> list[str]:
    """The number, then the number with fewer and fewer decimals; empty if it is not a number."""
    places = len(text.partition(".")[2])
    if not text or not set(text) <= GLYPHS.keys():
        return []
    try:
        number = Decimal(text)
    except ArithmeticError:
        return []
    return [text, *(f"{number:.{left}f}" for left in range(places - 1, -1, -1))]


SIGN_CELLS = 5
"""Extra cells of the frequency's readout, for its sign and a third digit."""
SIDE_CELLS = 9
"""Cells of the extremes at the right of the digits: a name and a number."""
READOUT_MOST = 60
TITLES: dict[Quantity, str] = {
    "output_frequency": "Output",
    "motor_current": "Current",
    "torque": "Torque",
    "power": "Power",
    "motor_load": "Motor load",
}
THIRD: Sequence[Quantity] = ("torque", "power", "motor_load")
"""Candidates for the third readout; the first in the monitoring set is shown."""


@lru_cache(maxsize=16)
def readout_quantities(profile: Profile, *, wide: bool) -> tuple[Quantity, ...]:
    """Return the quantities with a large readout; `wide` adds a third if it is monitored."""
    found: list[Quantity] = ["output_frequency", "motor_current"]
    watched = {value.parameter for value in profile.data.monitoring.values}
    if wide:
        for quantity in THIRD:
            parameter = profile.quantity(quantity)
            if parameter is not None and parameter.code in watched:
                return (*found, quantity)
    return tuple(found)


def readout_lines(view: View, width: int, *, wide: bool = False) -> list[Text]:
    """Return the readouts side by side; each row has exactly `width` cells."""
    quantities = readout_quantities(view.profile, wide=wide)
    cells = (width - len(quantities) + 1 - SIGN_CELLS) // len(quantities)
    rows = [Text(no_wrap=True) for _ in range(ROWS + 2)]
    for number, quantity in enumerate(quantities):
        more = SIGN_CELLS if number == 0 else 0
        parts = _readout(view, quantity, min(READOUT_MOST, cells + more))
        for row, part in zip(rows, parts, strict=True):
            row.append(" " if number else "")
            row.append_text(part)
    for row in rows:
        row.append(" " * (width - row.cell_len))
    return rows


def framed(title: Text, right: Text, rows: Sequence[Text], bottom: Text, cells: int) -> list[Text]:
    """Return rows in a frame of exactly `cells` cells, with texts in its upper and lower edge.

    The right text is omitted if it does not fit.
    """
    inner = cells - 2
    title = title.copy()
    title.truncate(inner)
    if title.cell_len + right.cell_len > inner:
        right = Text()
    top = Text("┌", LINE, no_wrap=True).append_text(title)
    top.append("─" * (inner - title.cell_len - right.cell_len), LINE)
    lines = [top.append_text(right).append("┐", LINE)]
    for row in rows:
        line = Text("│", LINE, no_wrap=True).append_text(_filled(row, inner, " "))
        lines.append(line.append("│", LINE))
    lower = Text("└", LINE, no_wrap=True).append_text(_filled(bottom, inner, "─"))
    return [*lines, lower.append("┘", LINE)]


def _filled(row: Text, cells: int, character: str) -> Text:
    row = row.copy()
    row.truncate(cells)
    return row.append(character * (cells - row.cell_len), LINE)


def _readout(view: View, quantity: Quantity, cells: int) -> list[Text]:
    """Return one readout; each row has exactly `cells` cells."""
    parameter = readout_parameter(view.profile, quantity)
    text, unit, style = _shown(view, quantity, parameter)
    inner = cells - 2
    field = min(_field(parameter, quantity), inner)
    drawn = dashes(field) if text == NOT_AVAILABLE else big(text, field, plain=view.plain)
    side = _side(view, quantity, parameter) if inner > field + SIDE_CELLS else []
    rows = []
    for number, part in enumerate(drawn):
        row = Text(no_wrap=True).append(part, style)
        if side:
            row.append(" " * (inner - field - SIDE_CELLS))
            row.append_text(side[number])
        rows.append(row)
    title, right = _heading(view, quantity, parameter, short(unit, 4), inner)
    return framed(title, right, rows, _bar(view, quantity, parameter, inner), cells)


def _shown(view: View, quantity: Quantity, parameter: Parameter | None) -> tuple[str, str, Style]:
    """Return text, unit and style of the value."""
    reading = view.reading(parameter.code) if parameter else None
    none = (NOT_AVAILABLE, parameter.unit if parameter else "", FAINT)
    if parameter is None or reading is None:
        return none

    def signed(value: Value) -> str:
        number = directed(view, parameter, bar_number(value))
        backward = quantity == "output_frequency" and number is not None and number < 0
        return f"-{value.text}" if backward and not value.text.startswith("-") else value.text

    return reading.drawn(
        view.now,
        current=lambda value: (signed(value), value.unit or "raw", STRONG),
        old=lambda value, age: (signed(value), value.unit or "raw", FAINT),  # age: in _heading
        missing=none,
    )


def _field(parameter: Parameter | None, quantity: Quantity) -> int:
    """Return the cells of the digits, which are the same for every value of a parameter."""
    signed = quantity != "motor_current"
    if parameter is None or not parameter.unit:
        return readout_cells(0, signed=signed, whole=5)
    decimals = possible_decimals(parameter)
    # a current of 100 A or more loses its decimal here; the status bar shows it
    return readout_cells(decimals, signed=signed, whole=3 if signed or not decimals else 2)


def _heading(
    view: View, quantity: Quantity, parameter: Parameter | None, unit: str, inner: int
) -> tuple[Text, Text]:
    """Return the name with the unit, and at the right the reference or the age of an old value."""
    title = TITLES[quantity]
    if parameter is not None and (mark := mark_of(view.profile, parameter)):
        title += f" {mark}"
    roomy = inner >= len(title) + len(unit) + 4
    text = Text(f" {title}" if roomy else title, PLAIN, no_wrap=True)
    text.append(f" {unit}", FAINT).append(" " if roomy else "")
    reading = view.reading(parameter.code) if parameter else None
    if reading is not None and reading.quality is not Quality.GOOD and reading.raw is not None:
        age = Text(f" {age_text(reading.age(view.now))} old ", STALE)
        left = inner - age.cell_len
        if text.cell_len > left:  # a whole name or the unit, no part of a name
            text = Text(title, PLAIN) if len(title) <= left else Text(short(unit, left), FAINT)
        return text, age
    if quantity == "output_frequency" and (wanted := _reference(view)) is not None:
        right = wanted.drawn(
            view.now,
            current=lambda value: Text(f" ref {value.text:>5} ", FAINT),
            old=lambda value, age: Text(),
            missing=Text(),
        )
        return text, right
    return text, Text()


def _side(view: View, quantity: Quantity, parameter: Parameter | None) -> list[Text]:
    """Return the extremes on the page of the curve, and the seconds from its first to last value.

    A page that has just turned covers less than its span. A low-bandwidth link gets no seconds.
    The rows are empty if the trend lacks the quantity.
    """
    if quantity not in TREND_QUANTITIES or parameter is None or view.page is not None:
        return [Text()] * ROWS  # the cursor may hold an older page than the number beside them
    place = TREND_QUANTITIES.index(quantity)
    start, end = view.page_start, view.page_start + view.step.span
    page = [
        point
        for point in points_of_page(view)
        if start <= point.time < end and point.values[place] is not None
    ]
    if not page:
        return [Text()] * ROWS
    digits = possible_decimals(parameter)
    seen = [value for point in page if (value := point.values[place]) is not None]
    highest, lowest = max(seen), min(seen)
    covered = "" if view.lean else f"{page[-1].time - page[0].time:.0f} s"
    texts = [f"{number:z.{digits}f}" for number in (highest, lowest)]
    # a long number keeps its distance from its name, not from the frame
    cells = SIDE_CELLS - 3
    gap = " " if max(map(len, texts)) < cells - 1 else ""
    texts = [f"{item}{gap}" for item in texts]
    return [
        Text("max", FAINT).append(f"{texts[0]:>{cells}}", PLAIN),
        Text("min", FAINT).append(f"{texts[1]:>{cells}}", PLAIN),
        Text(f"{covered:>{SIDE_CELLS - 1}} ", FAINT),
    ]


def _reference(view: View) -> Shown | None:
    """Return the reference; None if its current value is not known."""
    parameter = view.profile.quantity("frequency_reference")
    reading = view.reading(parameter.code) if parameter else None
    return reading if reading is not None and reading.current_number is not None else None


def _bar(view: View, quantity: Quantity, parameter: Parameter | None, inner: int) -> Text:
    """Return a bar of the value, with its limits as numbers and the reference as a mark."""
    value = next((v for v in view.values if parameter and v.parameter == parameter.code), None)
    if parameter is None or value is None:
        return Text("")
    place = TREND_QUANTITIES.index(quantity) if quantity in TREND_QUANTITIES else None
    high = end_of(view, value.high) if place is None else bar_end(view, parameter, place)
    if high is None or high <= 0:
        return Text("")
    reading = view.reading(parameter.code)
    fresh = reading is not None and reading.quality is Quality.GOOD
    number: float | None = None
    if reading is not None:
        number = reading.drawn(
            view.now, current=bar_number, old=lambda value, age: bar_number(value), missing=None
        )
    mark = None
    if quantity == "output_frequency":
        number = directed(view, parameter, number)
        wanted, reference = view.profile.quantity("frequency_reference"), _reference(view)
        mark = directed(view, wanted, reference.current_number) if fresh and reference else None
    reverse = (number or 0) < 0 or (mark or 0) < 0
    low = -high if reverse else max(0.0, end_of(view, value.low) or 0.0)
    first, last = f"{low:g} ", f" {high:g}"
    cells = inner - len(first) - len(last) - 2
    if cells < 4:
        first, cells = "", inner - len(last) - 1
    drawn = Text(f" {first}" if first else "", FAINT, no_wrap=True)
    drawn.append_text(gauge(number, low, high, cells, mark, BAR if fresh else BAR_REST))
    return drawn.append(f"{last} ", FAINT)
