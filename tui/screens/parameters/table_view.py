"""The list of parameters as lines; pure functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.style import Style
from rich.text import Text

from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import Parameter
from tui.session.settings.editor import Editor
from tui.widgets.drawing import cut_at_word, short
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, LINE, PLAIN, STRONG, TITLE

from .value_text import is_changed, old_text, other_text, range_text, value_text

LONGEST_NAME = 46


@dataclass(frozen=True, slots=True)
class TableLine:
    """A line of the table: a parameter, the heading of a group or of a step, or text below it."""

    code: str = ""
    group: str = ""
    text: str = ""


@dataclass(frozen=True, slots=True)
class Columns:
    """Widths of the columns; 0 for one that is not shown."""

    name: int
    code: int = 7
    value: int = 9
    staged: int = 9
    other: int = 9
    number: int = 0
    address: int = 0
    range: int = 0

    @classmethod
    def of(cls, width: int) -> Columns:
        """Return the columns that fit a list of that width; the least important are dropped
        first."""
        if width >= 150:
            wide = cls(0, value=14, staged=14, other=14, number=9, address=15, range=30)
        elif width >= 90:
            wide = cls(0, value=11, staged=10, other=10, number=8, range=21)
        else:
            wide = cls(0)
        return cls(
            max(8, min(LONGEST_NAME, width - wide.taken)),
            wide.code, wide.value, wide.staged, wide.other, wide.number, wide.address, wide.range,
        )  # fmt: skip

    @property
    def taken(self) -> int:
        """The cells of all columns but the name, with the spaces between them."""
        columns = (self.code, self.value, self.staged, self.other, self.number, self.address)
        return 1 + sum(columns) + self.range + 3 + 1 + 3


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


def head_line(width: int, other: str) -> Text:
    """The names of the columns."""
    columns = Columns.of(width)
    text = Text(" ", no_wrap=True)
    text.append(f"{'Code':<{columns.code}}", TITLE)
    if columns.number:
        text.append(f"{'Number':<{columns.number}}", TITLE)
    text.append(f"{'Name':<{columns.name}}", TITLE)
    text.append(f"{'Value':>{columns.value}}   {'Staged':>{columns.staged}}", TITLE)
    text.append(f" {short(other, columns.other):>{columns.other}}   ", TITLE)
    if columns.range:
        text.append(f"{'Limits':<{columns.range}}", TITLE)
    if columns.address:
        text.append(f"{'Address':<{columns.address}}", TITLE)
    return text


def row_line(editor: Editor, item: TableLine, width: int, *, chosen: bool) -> Text:
    """One line of the table."""
    if item.group:
        text = Text(no_wrap=True)
        text.append(f" {item.group} ", TITLE)
        text.append("─" * max(0, width - len(item.group) - 3), LINE)
        return text
    if not item.code:
        return Text(f"   {item.text}", FAINT, no_wrap=True)
    text = _row(editor, editor.session.profile[item.code], Columns.of(width))
    if chosen:
        text.append(" " * max(0, width - text.cell_len))
        text.stylize(CURSOR)
    return text


def _row(editor: Editor, parameter: Parameter, columns: Columns) -> Text:
    code, text = parameter.code, Text(no_wrap=True)
    sure = is_verified(parameter) or code in editor.marks.confirmed
    text.append("*" if code in editor.marks.favorites else " ", ALARM)
    shown_code = short(code, columns.code - (1 if sure else 2)) + ("" if sure else "?")
    text.append(f"{shown_code:<{columns.code}}", _code_style(parameter, sure))
    if columns.number:
        text.append(f"{short(parameter.number, columns.number - 1):<{columns.number}}", FAINT)
    name = cut_at_word(parameter.name, columns.name - 1)
    text.append(f"{name:<{columns.name}}", PLAIN if parameter.access != "r" else FAINT)
    changed = is_changed(editor, parameter)
    held = short(value_text(editor, code), columns.value)
    text.append(f"{held:>{columns.value}}", _value_style(editor, parameter, changed))
    text.append_text(_staged(editor, code, columns.staged))
    text.append(f" {short(other_text(editor, parameter), columns.other):>{columns.other}} ", FAINT)
    text.append("■" if changed else " ", ALARM)
    text.append(_kept(editor, code), ALARM)
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


def _value_style(editor: Editor, parameter: Parameter, changed: bool) -> Style:
    if parameter.code not in editor.values.raws:
        return FAINT
    return STRONG if changed else PLAIN


def _staged(editor: Editor, code: str, width: int) -> Text:
    """Return the staged value, or the value before a write; always of the same width."""
    edit, result = editor.staging.edits.get(code), editor.staging.results.get(code)
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
    """Return whether it waits for a reset of the drive, or to be saved in its EEPROM."""
    return "R" if code in editor.waits_for_reset else "S" if code in editor.unsaved else " "
