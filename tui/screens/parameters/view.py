"""Parameters as lines: a table by groups, what is known of one, what is staged; pure functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console
from rich.style import Style
from rich.text import Text

from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import Parameter
from tui.drive.settings.selection import not_factory
from tui.drive.settings.writable import marks, waits_for_reset
from tui.drive.shown import limits_text, shown
from tui.drive.values import NOT_AVAILABLE, is_enumeration, set_bits
from tui.session.settings.editor import Editor
from tui.widgets.drawing import armed_text, cut, short
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, LINE, PLAIN, STALE, STRONG, TITLE

CODE_WIDTH = 7
VALUE_WIDTH = 13
OTHER_WIDTH, OTHER_WIDE = 11, 13
MANUAL_NUMBER_WIDTH = 9
RANGE_WIDTH = 22
NEWS = 3
"""Lines for what is said and what happened to a parameter last."""
WIDE_TABLE = 110
"""Columns from which the manual's number and the range have columns of their own."""


@dataclass(frozen=True, slots=True)
class TableLine:
    """A line of the table: a parameter, or the heading of a group."""

    code: str = ""
    group: str = ""


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
    text = Text(no_wrap=True)
    text.append(f"   {'Code':<{CODE_WIDTH}}", TITLE)
    if width >= WIDE_TABLE:
        text.append(f"{'Number':<{MANUAL_NUMBER_WIDTH}}", TITLE)
    text.append(cut("Name", name_width(width)), TITLE)
    text.append(f"{'Value':>{VALUE_WIDTH}}   {'Staged':<{VALUE_WIDTH}}", TITLE)
    text.append(_other(other, width), TITLE)
    if width >= WIDE_TABLE:
        text.append(f"  {'Range':<{RANGE_WIDTH}}", TITLE)
    return text


def name_width(width: int) -> int:
    """The room for a name."""
    more = MANUAL_NUMBER_WIDTH + RANGE_WIDTH + 2 if width >= WIDE_TABLE else 0
    other = len(_other("", width))
    return max(8, width - (3 + CODE_WIDTH + 2 * VALUE_WIDTH + 3 + other + 3 + more))


def _other(text: str, width: int) -> str:
    """The column of the factory value, or of what the drive is compared with."""
    columns = OTHER_WIDE if width >= WIDE_TABLE else OTHER_WIDTH
    return f"{short(text, columns - 1):>{columns}}"


def row_line(editor: Editor, item: TableLine, width: int, *, chosen: bool) -> Text:
    """One line of the table."""
    if item.group:
        text = Text(no_wrap=True)
        text.append(f" {item.group} ", TITLE)
        text.append("─" * max(0, width - len(item.group) - 3), LINE)
        return text
    text = _row(editor, editor.session.profile[item.code], width)
    if chosen:
        text.append(" " * max(0, width - text.cell_len))
        text.stylize(CURSOR)
    return text


def _row(editor: Editor, parameter: Parameter, width: int) -> Text:
    code, text = parameter.code, Text(no_wrap=True)
    favourite = "*" if code in editor.marks.favourites else " "
    text.append(f" {favourite} ", ALARM)
    sure = is_verified(parameter) or code in editor.marks.confirmed
    text.append(
        f"{code + ('' if sure else '?'):<{CODE_WIDTH}}"[:CODE_WIDTH], _code_style(parameter, sure)
    )
    if width >= WIDE_TABLE:
        text.append(f"{parameter.number[: MANUAL_NUMBER_WIDTH - 1]:<{MANUAL_NUMBER_WIDTH}}", FAINT)
    text.append(cut(parameter.name, name_width(width) - 1) + " ", FAINT)
    held = value_text(editor, code)
    changed = not_factory(editor.session.profile, parameter, editor.values.raws.get(code))
    text.append(
        f"{short(held, VALUE_WIDTH):>{VALUE_WIDTH}}", _value_style(editor, parameter, changed)
    )
    text.append_text(_staged(editor, code))
    text.append(_other(other_text(editor, parameter), width), FAINT)
    text.append(_flags(editor, parameter), ALARM)
    if width >= WIDE_TABLE:
        text.append(cut(range_text(editor, parameter), RANGE_WIDTH - 1), FAINT)
    return text


def _code_style(parameter: Parameter, sure: bool) -> Style:
    if not sure:
        return ALARM
    return FAINT if parameter.access == "r" else STRONG


def _value_style(editor: Editor, parameter: Parameter, changed: bool) -> Style:
    if parameter.code not in editor.values.raws:
        return FAINT
    if parameter.access == "r":
        return PLAIN
    return STRONG if changed else PLAIN


def _staged(editor: Editor, code: str) -> Text:
    edit, result = editor.staging.edits.get(code), editor.staging.results.get(code)
    text = Text(no_wrap=True)
    if edit is None:
        said = "written" if result is not None and result.done else ""
        text.append(f"   {said:<{VALUE_WIDTH}}", FAINT)
        return text
    text.append(" → ", ATTENTION)
    failed = result is not None and not result.done
    style = ALARM if failed or code in editor.staging.changed_elsewhere else ATTENTION
    text.append(f"{short(edit.text, VALUE_WIDTH - 1):<{VALUE_WIDTH}}", style)
    return text


def _flags(editor: Editor, parameter: Parameter) -> str:
    """Two signs: locked while the motor runs, waits for a reset or for saving."""
    code = parameter.code
    refused = editor.refusal(code)
    locked = refused is not None and refused.reason == "running" and editor.state is not None
    kept = "r" if code in editor.waits_for_reset else "s" if code in editor.unsaved else " "
    return f" {'■' if locked else ' '}{kept}"


def value_text(editor: Editor, code: str) -> str:
    """The held value, dashes while there is none."""
    value = editor.values.value(code)
    return value.display if value is not None else NOT_AVAILABLE


def other_text(editor: Editor, parameter: Parameter) -> str:
    """The factory value, or that of the set that the drive is compared with."""
    if editor.other:
        raw = editor.other.get(parameter.code)
        return "" if raw is None else _shown(editor, parameter, raw)
    return factory_text(editor, parameter)


def factory_text(editor: Editor, parameter: Parameter) -> str:
    """The factory value, or what is known of it in words."""
    if parameter.factory is None:
        return parameter.factory_text
    return _shown(editor, parameter, parameter.factory)


def _shown(editor: Editor, parameter: Parameter, raw: int) -> str:
    values = editor.values
    return shown(editor.session.profile, parameter, raw, values.raws, values.lacking).display


def range_text(editor: Editor, parameter: Parameter) -> str:
    """The range in its unit, as wide as the profile allows."""
    if parameter.access == "r" or parameter.bits:
        return ""
    names = editor.session.profile.names(parameter)
    if is_enumeration(parameter):
        return f"{len(names)} values"
    if parameter.min is None and parameter.max is None:
        return ""
    return limits_text(editor.session.profile, parameter, editor.values.raws, editor.values.lacking)


def parameter_lines(editor: Editor, code: str, width: int) -> list[Text]:
    """What one parameter is, on three lines."""
    parameter = editor.session.profile[code]
    return [
        _place(editor, parameter, width),
        _meaning(editor, parameter, width),
        _writing(editor, parameter, width),
    ]


def news_lines(editor: Editor, code: str, message: Text, width: int) -> list[Text]:
    """What is said, and what happened to the parameter last: always so many lines."""
    news = _news(editor, editor.session.profile[code]) if code else Text("")
    first = _wrapped(message, width, NEWS)
    rest = _wrapped(news, width, NEWS - len(first)) if news.plain != message.plain else []
    lines = [*rest, *([Text("")] * (NEWS - len(first) - len(rest))), *first]
    return [Text(" ") + line if line.plain else line for line in lines]


def _wrapped(text: Text, width: int, most: int) -> list[Text]:
    lines: list[Text] = (
        list(text.wrap(Console(width=width, markup=False), width - 3)) if text.plain else []
    )
    if len(lines) > most > 0:
        lines[most - 1].append(" …")
    return lines[:most]


def _place(editor: Editor, parameter: Parameter, width: int) -> Text:
    raw = editor.values.raws.get(parameter.code)
    text = Text(no_wrap=True)
    text.append(f" {parameter.code} ", STRONG)
    hexadecimal = f"16#{parameter.address:04X}"
    number = parameter.number if parameter.number not in (hexadecimal, parameter.code) else ""
    text.append(" · ".join(x for x in (number, hexadecimal, str(parameter.address)) if x), FAINT)
    if raw is not None:
        text.append(
            f"   raw {raw} = 16#{raw & 0xFFFFFFFF if raw > 0xFFFF else raw & 0xFFFF:04X}", FAINT
        )
    if (limits := range_text(editor, parameter)) and not is_enumeration(parameter):
        scale = editor.session.profile.scale(parameter, editor.values.raws, editor.values.lacking)
        step = f" by {scale:f}" if scale is not None else ""
        text.append(f"   {limits}{step}", PLAIN)
    factory = f"   factory {factory_text(editor, parameter)}"
    if factory.strip() != "factory" and text.cell_len + len(factory) <= width:
        text.append(factory, FAINT)  # stands in the table too
    text.truncate(width, overflow="ellipsis")
    return text


def _meaning(editor: Editor, parameter: Parameter, width: int) -> Text:
    text = Text(no_wrap=True)
    text.append(f" {parameter.name}", PLAIN)
    raw = editor.values.raws.get(parameter.code)
    if parameter.bits and raw is not None:
        names = ", ".join(bit.on or bit.name for bit in set_bits(parameter.bits, raw))
        text.append(f": {names or 'no bit set'}", PLAIN)
    if parameter.base:
        text.append(f" (% of {parameter.base})", FAINT)
    if parameter.scale_by is not None:
        text.append(f". Its unit step follows {parameter.scale_by.parameter}.", FAINT)
    if parameter.note:
        text.append(
            f" {parameter.note}" if text.plain.endswith(".") else f". {parameter.note}", FAINT
        )
    text.truncate(width, overflow="ellipsis")
    return text


def _writing(editor: Editor, parameter: Parameter, width: int) -> Text:
    text = Text(no_wrap=True)
    refused = editor.refusal(parameter.code)
    if refused is not None:
        text.append(f" {refused.text}", ALARM if refused.reason == "running" else FAINT)
    else:
        text.append(" Writable now", STRONG)
        text.append(
            "".join(f", {mark}" for mark in marks(editor.session.profile, parameter)), FAINT
        )
    text.append(f"   source: {parameter.confidence}", FAINT)
    text.truncate(width, overflow="ellipsis")
    return text


def _news(editor: Editor, parameter: Parameter) -> Text:
    """What happened to it last: another's change, a refusal, a remark."""
    code, profile = parameter.code, editor.session.profile
    edit, result = editor.staging.edits.get(code), editor.staging.results.get(code)
    if code in editor.staging.changed_elsewhere:
        before = _shown(editor, parameter, editor.staging.changed_elsewhere[code])
        said = f"Changed by somebody else: it was {before}. Delete drops your edit, y keeps it."
        return Text(said, ALARM)
    if result is not None and not result.done:
        return Text(result.text, ALARM)
    if edit is not None:
        text = Text(f"{edit.old_text or NOT_AVAILABLE} → {edit.text}", ATTENTION)
        text.append(f" (raw {edit.old} → {edit.new})", FAINT)
        text.append(f"  {edit.remark}" if edit.remark else "", ALARM)
        return text
    if result is not None:
        text = Text(result.text, FAINT)
        if waits_for_reset(profile, parameter):
            text.append(" In force after a reset of the drive.", ALARM)
        return text
    return Text(editor.values.absent.get(code, ""), STALE)


def status_line(editor: Editor, armed: float | None, width: int) -> Text:
    """Armed or not, what the drive does, what waits to be written, saved or reset."""
    text = Text(no_wrap=True).append_text(armed_text(armed))
    watched = editor.watched()
    now = "state not known" if watched is None else watched.headline
    text.append(f"  {now}", PLAIN if editor.state else ALARM)
    count = len(editor.staging.edits)
    text.append(f"   {count} staged", ATTENTION if count else FAINT)
    if editor.unsaved:
        text.append(f"   {len(editor.unsaved)} not saved", ALARM)
    if editor.waits_for_reset:
        text.append("   RESET THE DRIVE: " + ", ".join(sorted(editor.waits_for_reset)), ALARM)
    text.truncate(width, overflow="ellipsis")
    return text


__all__ = [
    "TableLine",
    "head_line",
    "items_of",
    "news_lines",
    "parameter_lines",
    "range_text",
    "row_line",
    "status_line",
    "value_text",
]
