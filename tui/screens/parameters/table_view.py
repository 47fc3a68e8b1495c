"""The list of parameters as lines; pure functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import Parameter
from tui.drive.values import NOT_AVAILABLE
from tui.session.settings.editor import Editor
from tui.widgets.drawing import fitted_names, short
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, LINE, PLAIN, STALE, STRONG, TITLE

from .value_text import held_drawn, is_marked, old_text, other_text, range_text

NAME_CELLS, NAME_ROOM = 46, 30
"""Cells of a name at most if no name is longer, and those that it needs before limits are shown."""
WIDTHS = ((150, 14, 9, 30), (90, 11, 8, 21), (0, 9, 0, 0))
"""From a width of the list on: cells of a value, of the manual's number, and of the limits."""
ADDRESS = 15
UNNAMED_VALUE = "unknown (99)"
"""A value without a name in a list that has names, at its usual length."""
TEXT_MOST = 28
"""Cells of a value at most, in a list with long names of values."""
LEAST_NAME, LEAST_STAGED_NAME = 25, 22
"""Cells of the names that long values leave them; fewer next to staged values."""
STAGED_MARK = 3
"""Cells of the arrow before a staged value."""


@dataclass(frozen=True, slots=True)
class TableLine:
    """A line of the table: a parameter, the heading of a group or a step, or the text of a step."""

    code: str = ""
    group: str = ""
    text: str = ""


class Columns(NamedTuple):
    """Widths of the columns; 0 for one that is not shown."""

    name: int
    code: int = 7
    value: int = 9
    staged: int = 0
    other: int = 0
    number: int = 0
    address: int = 0
    range: int = 0

    @property
    def taken(self) -> int:
        """The cells of all columns but the name, with the marks between them."""
        staged = self.staged + STAGED_MARK if self.staged else 0
        other = self.other + 1 if self.other else 0
        return (
            1
            + self.code
            + self.number
            + self.value
            + staged
            + other
            + 3
            + (1 if self.range or self.address else 0)
            + self.range
            + self.address
        )


class Filled(NamedTuple):
    """The columns of a list that are not empty, and what its names need."""

    staged: bool
    other: bool
    range: bool
    name: int
    """Cells of the longest name, with a space."""
    value_now: int = 0
    """Cells of the longest value that is shown now."""
    value: int = 0
    """Cells of the longest value in the list, or of the longest name of one."""


class TableLayout(NamedTuple):
    """The columns of a list of parameters, and its names as they fit."""

    columns: Columns
    names: Mapping[str, str]


def layout_of(editor: Editor, items: Sequence[TableLine], width: int) -> TableLayout:
    """Return the columns of a list; an empty one leaves its cells to the names."""
    profile = editor.session.profile
    parameters = [profile[item.code] for item in items if item.code]
    results = editor.staging.results
    names = tuple(parameter.name for parameter in parameters)
    now = max((_longest_now(editor, p.code) for p in parameters), default=0)
    longest = max((longest_value(profile, p.code) for p in parameters), default=0)
    filled = Filled(
        any(p.code in editor.staging.edits or p.code in results for p in parameters),
        any(other_text(editor, p) for p in parameters),
        any(range_text(editor, p) for p in parameters),
        max(map(len, names), default=0) + 1,
        min(TEXT_MOST, now),
        min(TEXT_MOST, max(now, longest)),
    )
    columns = fitting_columns(width, filled)
    is_cut = columns.value < now or (filled.staged and columns.name < filled.name)
    if is_cut and not editor.other:
        # the details have the factory value
        columns = fitting_columns(width, filled._replace(other=False))
    return TableLayout(columns, fitted_names(names, columns.name - 1))


@lru_cache(maxsize=4096)
def longest_value(profile: Profile, code: str) -> int:
    """Return the length of the longest name of a parameter's values; 0 if it is a number."""
    names = profile.names(profile[code])
    return max(map(len, (UNNAMED_VALUE, *names.values()))) if names else 0


def _longest_now(editor: Editor, code: str) -> int:
    """Return the length of the held value or the staged one, whichever is longer."""
    edit = editor.staging.edits.get(code)
    held = held_drawn(
        editor, code, current=len, old=lambda value, _: len(value), missing=len(NOT_AVAILABLE)
    )
    return max(held, len(edit.text) if edit is not None else 0)


def fitting_columns(width: int, filled: Filled) -> Columns:
    """Return the columns that fit a list of that width.

    Limits are omitted if names would have less than `NAME_ROOM` cells, number and address if one
    would be shortened: the details have them. Cells that no name needs go to the values.
    """
    value, number, limits = next(row for least, *row in WIDTHS if width >= least)
    columns = Columns(
        0,
        value=value,
        staged=value if filled.staged else 0,
        other=value if filled.other else 0,
    )
    longer = filled.value - value if filled.value > value else 0
    longer *= 1 + filled.staged + filled.other
    more = (
        ("range", limits if filled.range else 0, min(filled.name, NAME_ROOM) + longer),
        ("number", number, filled.name + longer),
        ("address", ADDRESS if number == WIDTHS[0][2] else 0, filled.name + longer),
    )
    for column, cells, name in more:
        wider = columns._replace(**{column: cells})
        if wider.taken + max(8, name) <= width:
            columns = wider
    columns = _with_longer_values(columns, width, filled)
    return columns._replace(name=max(8, min(max(NAME_CELLS, filled.name), width - columns.taken)))


def _with_longer_values(columns: Columns, width: int, filled: Filled) -> Columns:
    """Return the columns with values as long as the list has them, if its names leave the room.

    For the values that are shown now, names are shortened, too.
    """
    shared = 1 + filled.staged + filled.other
    least = LEAST_STAGED_NAME if filled.staged else LEAST_NAME
    value = columns.value
    for name, longest in ((filled.name, filled.value), (least, filled.value_now)):
        spare = (width - columns.taken - min(filled.name, name)) // shared
        value = max(value, min(longest, columns.value + spare))
    return columns._replace(
        value=value,
        staged=value if filled.staged else 0,
        other=value if filled.other else 0,
    )


def items_of(editor: Editor, codes: Sequence[str], *, headings: bool) -> list[TableLine]:
    """The lines of a list of parameters, a heading before each group."""
    found: list[TableLine] = []
    last = ""
    for code in codes:
        group = editor.session.profile[code].group
        if headings and group != last:
            found.append(TableLine(group=group))
            last = group
        found.append(TableLine(code))
    return found


def head_line(columns: Columns, other: str) -> Text:
    """The names of the columns."""
    text = Text(" ", no_wrap=True)
    text.append(f"{'Code':<{columns.code}}", TITLE)
    if columns.number:
        text.append(f"{'Number':<{columns.number}}", TITLE)
    text.append(f"{'Name':<{columns.name}}", TITLE)
    text.append(f"{'Value':>{columns.value}}", TITLE)
    if columns.staged:
        text.append(f"{'Staged':>{columns.staged + STAGED_MARK}}", TITLE)
    if columns.other:
        text.append(f" {short(other, columns.other):>{columns.other}}", TITLE)
    text.append("    " if columns.range or columns.address else "   ")
    if columns.range:
        text.append(f"{'Limits':<{columns.range}}", TITLE)
    if columns.address:
        text.append(f"{'Address':<{columns.address}}", TITLE)
    return text


def row_line(
    editor: Editor, item: TableLine, layout: TableLayout, width: int, *, chosen: bool
) -> Text:
    """One line of the table."""
    if item.group:
        text = Text(no_wrap=True)
        text.append(f" {item.group} ", TITLE)
        text.append("─" * max(0, width - len(item.group) - 3), LINE)
        return text
    if not item.code:
        return Text(f"   {item.text}", FAINT, no_wrap=True)
    text = _row(editor, editor.session.profile[item.code], layout)
    if chosen:
        text.append(" " * max(0, width - text.cell_len))
        text.stylize(CURSOR)
    return text


def _row(editor: Editor, parameter: Parameter, layout: TableLayout) -> Text:
    columns, code, text = layout.columns, parameter.code, Text(no_wrap=True)
    sure = is_verified(parameter) or code in editor.marks.confirmed
    text.append("*" if code in editor.marks.favorites else " ", ALARM)
    shown_code = short(code, columns.code - (1 if sure else 2)) + ("" if sure else "?")
    text.append(f"{shown_code:<{columns.code}}", _code_style(parameter, sure))
    if columns.number:
        text.append(f"{short(parameter.number, columns.number - 1):<{columns.number}}", FAINT)
    name = layout.names[parameter.name]
    text.append(f"{name:<{columns.name}}", PLAIN if parameter.access != "r" else FAINT)
    changed = is_marked(editor, parameter)
    held, style = held_drawn(
        editor,
        code,
        current=lambda value: (value, STRONG if changed else PLAIN),
        old=lambda value, _: (value, STALE),
        missing=(NOT_AVAILABLE, FAINT),
    )
    text.append(f"{short(held, columns.value):>{columns.value}}", style)
    if columns.staged:
        text.append_text(_staged(editor, code, columns.staged))
    if columns.other:
        other = short(other_text(editor, parameter), columns.other)
        text.append(f" {other:>{columns.other}}", FAINT)
    text.append(" ")
    text.append("■" if changed else " ", ALARM)
    text.append(_kept(editor, code), ALARM)
    text.append(" " if columns.range or columns.address else "")
    if columns.range:
        limits = short(range_text(editor, parameter), columns.range - 1)
        text.append(f"{limits:<{columns.range}}", FAINT)
    if columns.address:
        text.append(f"16#{parameter.address:04X} {parameter.address:>6}", FAINT)
    return text


def _code_style(parameter: Parameter, sure: bool) -> Style:
    if not sure:
        return ALARM
    return FAINT if parameter.access == "r" else STRONG


def _staged(editor: Editor, code: str, width: int) -> Text:
    """Return the staged value, or the value before a write; always of the same width."""
    edit, result = editor.staging.pending(code), editor.staging.results.get(code)
    text = Text(no_wrap=True)
    if edit is None:
        old = old_text(editor, code)
        text.append(f"{short(f'was {old}' if old else '', width + 2):>{width + 3}}", FAINT)
        return text
    failed = result is not None and not result.done
    style = ALARM if failed or code in editor.staging.changed_elsewhere else ATTENTION
    text.append(f" → {short(edit.text, width):>{width}}", style)
    return text


def _kept(editor: Editor, code: str) -> str:
    """Return R if it waits for a reset of the drive, S if it is not saved to EEPROM, or a blank."""
    return "R" if code in editor.waits_for_reset else "S" if code in editor.unsaved else " "
