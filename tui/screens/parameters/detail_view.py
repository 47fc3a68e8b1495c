"""Details of the parameter under the cursor, as lines; pure functions."""

from __future__ import annotations

from rich.text import Text

from tui.drive.bit_texts import bit_texts
from tui.drive.profile.profile import notations
from tui.drive.profile.schema import Parameter
from tui.drive.settings.factory import factory_is_sure
from tui.drive.settings.writable import needs_standstill, waits_for_reset
from tui.drive.taught_profile import why_not_taught
from tui.drive.values import NOT_AVAILABLE, is_enumeration, without_named_bits
from tui.session.settings.editor import Editor
from tui.widgets.drawing import wrapped
from tui.widgets.palette import ALARM, ATTENTION, FAINT, KEY, LINE, PLAIN, STALE, STRONG, age_text

from .value_text import (
    CONFIDENCE_WORDS,
    factory_text,
    held_drawn,
    is_changed,
    limits_now,
    old_text,
    range_text,
    step_text,
    text_of,
    value_text,
)

SHORT, TALL = 5, 8
"""Lines for one parameter, in a low and in a tall terminal."""
TALL_FROM = 32
"""Rows from which a terminal is tall."""


def parameter_lines(
    editor: Editor, code: str, width: int, height: int, step: str = ""
) -> list[Text]:
    """Return the details of one parameter in `height` lines, the last for its latest event.

    `step` is its text in the commissioning steps, if those are shown.
    """
    parameter = editor.session.profile[code]
    news = _news(editor, parameter)
    # a warning is shown in full, at the cost of help
    most = 3 if height > SHORT else 1 if news.style == PLAIN else 2
    reported = wrapped(news.plain, max(20, width - 3), most)
    lines = _help(editor, parameter, width, height - 2 - max(1, len(reported)), step)
    lines += [_limits(editor, parameter, width), _place(editor, parameter, width)]
    lines += [Text(f" {line}", news.style, no_wrap=True) for line in reported]
    return [*lines, *([Text("")] * (height - len(lines)))]


def _help(editor: Editor, parameter: Parameter, width: int, room: int, step: str) -> list[Text]:
    """Code, full name and help, in at most `room` lines."""
    head = f"{parameter.code}  {parameter.name}"
    reported = [*([step] if step else []), *_help_parts(editor, parameter)]
    words = " ".join(part if part.endswith(".") else f"{part}." for part in reported)
    parts = wrapped(f"{head}. {words}" if words else head, max(20, width - 3), room)
    lines = [Text(f" {part}", FAINT, no_wrap=True) for part in parts]
    # in a narrow terminal the name may continue on the second line
    left = len(head)
    for line, part in zip(lines, parts, strict=True):
        line.stylize(PLAIN, 1, 1 + max(0, min(left, len(part))))
        left -= len(part) + 1
    lines[0].stylize(STRONG, 1, 1 + len(parameter.code))
    return lines


def _help_parts(editor: Editor, parameter: Parameter) -> list[str]:
    held, found = editor.values.held(parameter.code), list[str]()
    if parameter.bits and held is not None and held.raw is not None:
        texts = ", ".join(bit_texts(parameter.bits, held.raw))
        when = held_drawn(
            editor,
            parameter.code,
            current=lambda _: "Now",
            old=lambda _, age: f"{age_text(age)} ago",
            missing="",
        )
        found.append(f"{when}: {texts or without_named_bits(held.raw)}")
    # a profile's note on a word without a scale says that it is shown raw
    if parameter.note and parameter.code not in editor.session.profile.taught:
        found.append(parameter.note)
    found += _taught(editor, parameter)
    if parameter.base:
        found.append(f"In percent of {parameter.base}")
    if (source := parameter.scale_source) and source not in parameter.note:
        found.append(f"Its step depends on {source}")
    if is_enumeration(parameter) and parameter.access != "r":
        choices = dict.fromkeys(editor.session.profile.names(parameter).values())
        found.append(f"One of: {', '.join(choices)}")
    return found


def _taught(editor: Editor, parameter: Parameter) -> list[str]:
    """Return the learned scale, or how to learn one; empty if it has a scale."""
    session = editor.session
    if (scale := session.profile.taught.get(parameter.code)) is not None:
        return [f"Learned scale: {scale.text}. Press L to check it against the display"]
    if parameter.access != "r" or why_not_taught(session.family, parameter.code):
        return []
    return ["Press L or Enter to learn its scale from the drive's display"]


def _limits(editor: Editor, parameter: Parameter, width: int) -> Text:
    """The active limits, when a new value takes effect, how it is saved, the factory value."""
    text = Text(" ", no_wrap=True)
    number = not is_enumeration(parameter) and limits_now(editor, parameter) is not None
    if parameter.access != "r" and number:
        limits, step = range_text(editor, parameter), step_text(editor, parameter)
        by = step.partition(" ")[0]  # the limits already name the unit
        text.append(f"{limits}, step {by}" if limits else f"step {step}", PLAIN)
        text.append(" · ", FAINT)
    text.append(" · ".join(_effect(editor, parameter)), FAINT)
    if parameter.storage == "ram-until-saved" and parameter.access != "r":
        until = " · lost at power-off until saved: "
        if text.cell_len + len(until) < width:
            text.append(until, FAINT).append("S", KEY)
        else:
            text.append(" · ", FAINT).append("S", KEY).append(" save", FAINT)
    factory = f" · factory {factory_text(editor, parameter)}"
    if factory_text(editor, parameter) and text.cell_len + len(factory) < width:
        text.append(factory, FAINT)  # optional: the list shows it, too
    return text


def _effect(editor: Editor, parameter: Parameter) -> list[str]:
    profile = editor.session.profile
    if parameter.access == "r":
        return ["read-only"]
    later = waits_for_reset(profile, parameter)
    found = ["takes effect after a reset"] if later else []
    if needs_standstill(profile, parameter):
        found.append("only at standstill")
    elif not later:
        found.append("takes effect immediately")
    found += {"ram": ["lost at power-off"], "eeprom": ["saved immediately"]}.get(
        parameter.storage, []
    )
    return found


def _place(editor: Editor, parameter: Parameter, width: int) -> Text:
    """Return its address, raw value and source."""
    raw, edit = editor.values.raws.get(parameter.code), editor.staging.pending(parameter.code)
    hexadecimal = f"16#{parameter.address:04X}"
    number = parameter.number if parameter.number not in (hexadecimal, parameter.code) else ""
    wire = notations(parameter)[2].partition(" (")[0]
    parts = [part for part in (number, hexadecimal, wire) if part]
    if parameter.eeprom_address is not None:
        parts.append(f"EEPROM 16#{parameter.eeprom_address:04X}")
    if raw is not None and parameter.type != "ascii":
        staged = f" → {edit.new}" if edit is not None else ""
        word = f" = 16#{_word(edit.new if edit is not None else raw)}" if width >= 80 else ""
        parts.append(f"raw {raw}{staged}{word}")
    text = Text(f" {' · '.join(parts)} · source: ", FAINT, no_wrap=True)
    words = CONFIDENCE_WORDS[parameter.confidence]
    sure = parameter.confidence not in ("analogy", "unverified")
    sure = sure or parameter.code in editor.marks.confirmed
    text.append(words if sure else f"{words} (unverified)", FAINT if sure else ALARM)
    return text


def _word(raw: int) -> str:
    return f"{raw & 0xFFFFFFFF if raw > 0xFFFF else raw & 0xFFFF:04X}"


def _news(editor: Editor, parameter: Parameter) -> Text:
    """Return the latest event: a change in the drive, a refusal, a staged or old value."""
    code = parameter.code
    edit, result = editor.staging.pending(code), editor.staging.results.get(code)
    if code in editor.staging.changed_elsewhere:
        before = text_of(editor, parameter, editor.staging.changed_elsewhere[code])
        message = (
            f"Changed in the drive since you staged it: it was {before}."
            " Press Delete to drop your edit, y to keep it."
        )
        return Text(message, ALARM)
    if result is not None and not result.done:
        return Text(result.text, ALARM)
    refused = editor.refusal(code)
    locked = refused.text if refused is not None and refused.reason == "running" else ""
    if edit is not None and locked:
        return Text(f"Staged: {edit.text}. {locked}", ALARM)
    if edit is not None:
        keys = _keys_to_write(editor, "it")
        message = f"Staged: {edit.old_text or NOT_AVAILABLE} → {edit.text}. {keys}."
        return Text(f"{message} {edit.remark}".strip(), ALARM if edit.remark else ATTENTION)
    if code in editor.waits_for_reset:
        return Text("Takes effect after a reset of the drive.", ALARM)
    if old := old_text(editor, code):
        message = f"Now {value_text(editor, code)}, was {old}"
        # u would first undo staged edits
        u = "" if len(editor.staging.edits) else " Press u to stage the old value."
        return Text(f"{message}.{u}", PLAIN)
    if code not in editor.values.raws:
        return Text(editor.values.absent.get(code) or editor.values.trouble, STALE)
    if refused is not None and refused.reason == "unverified":
        message = f"Unverified: no document of this family confirms {parameter.number}."
        return Text(f"{message} Compare it with the keypad, then press y.", FAINT)
    if refused is not None and refused.reason != "read-only":
        return Text(refused.text, FAINT)
    if is_changed(editor, parameter):
        return Text(_not_factory_text(editor, parameter), FAINT)
    return Text("")


def _keys_to_write(editor: Editor, what: str) -> str:
    """The keys that write staged values, as a sentence without a full stop."""
    arming = editor.session.arming
    if arming.hindrance:
        return "Cannot be written now"
    return f"Press w to write {what}" if arming.armed else "Press a to arm, then w"


def _not_factory_text(editor: Editor, parameter: Parameter) -> str:
    """Return the factory value of a changed setting, and its source if it is not certain."""
    message = f"Differs from the factory value, {factory_text(editor, parameter)}"
    grounds = parameter.factory_grounds
    if grounds is None or factory_is_sure(parameter):
        return f"{message}."
    return f"{message} (source: {CONFIDENCE_WORDS[grounds.confidence]}, unverified)."


def status_line(editor: Editor, where: str, width: int) -> Text:
    """The line between list and details: what is staged, not saved, or needs a reset."""
    text, count = Text("─ ", LINE, no_wrap=True), len(editor.staging.edits)
    if count:
        text.append(f"{count} staged", ATTENTION)
        text.append(f". {_keys_to_write(editor, 'it' if count == 1 else 'them')}", FAINT)
    if editor.unsaved:
        text.append(" · " if count else "", LINE)
        text.append(f"{len(editor.unsaved)} not saved", ALARM)
        text.append(": S", KEY)
    if editor.waits_for_reset:
        text.append(" · " if count or editor.unsaved else "", LINE)
        text.append(f"reset the drive for {', '.join(sorted(editor.waits_for_reset))}", ALARM)
    done, whole = editor.values.progress
    if done < whole:
        where = f"reading {done} of {whole} · {where}"
    text.truncate(max(8, width - len(where) - 5), overflow="ellipsis")
    text.append(" " if text.cell_len > len("─ ") else "")
    text.append("─" * max(1, width - text.cell_len - len(where) - 3), LINE)
    text.append(f" {where} ", FAINT)
    text.append("─", LINE)
    return text
