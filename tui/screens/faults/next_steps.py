"""Rows of the next steps: what to check, what Enter opens, what a reset needs and does."""

from __future__ import annotations

import time
from datetime import datetime

from rich.text import Text

from tui.drive.hints import reset_text
from tui.drive.profile.schema import Parameter
from tui.drive.sentences import capitalized
from tui.drive.settings.factory import factory_is_sure, factory_value
from tui.widgets.drawing import cut, cut_at_word, rule, wrapped
from tui.widgets.palette import ATTENTION, FAINT, KEY, PLAIN

from .doctor_view import DoctorView, good_raws
from .parts import TRUST_MARKS, reading_text

STEP_WIDTH = 9
"""Columns of the key, or of the name of a step."""
BESIDE_KEY = "a reset"
"""The reset in a sentence; the key is beside it."""
ARM = "Press a to arm, then x."


def next_heading(view: DoctorView, width: int) -> list[Text]:
    """Return the heading of the next steps; none if there is nothing to do."""
    return [] if view.is_quiet else [rule("Next", width)]


def check_rows(view: DoctorView, width: int) -> list[Text]:
    """Return one row per check that no value rules out."""
    left = view.advice
    room = max(10, width - STEP_WIDTH - 1)
    if left is None or view.hint is None or not view.hint.check:
        remedy = view.fault.remedy if view.fault is not None else ""
        return _step("Check", [Text(part, PLAIN) for part in wrapped(remedy, room, 3)])
    excluded = {row.text: row.reason for row in left.excluded}
    rows = [Text(cut(text, room).rstrip(), PLAIN) for text in left.check]
    if rows and view.hint.confidence != "practice":  # checks are always practice
        mark = f"  ({TRUST_MARKS['practice']})"
        if rows[0].cell_len + len(mark) <= room:
            rows[0].append(mark, FAINT)
    rows += [
        Text(cut_at_word(f"× {text} ({excluded[text]})", room), FAINT)
        for text in view.hint.check
        if text in excluded
    ]
    return _step("Check", rows)


def open_row(view: DoctorView, width: int) -> list[Text]:
    """Return what Enter opens: the parameter under the cursor, with its factory setting."""
    rows, at = view.rows, view.at
    if at >= len(rows):
        return []
    row = rows[at]
    parameter = view.profile[row.code]
    room = max(10, width - STEP_WIDTH - 1)
    text = f"Open {row.code} {parameter.name}"
    if factory := _factory_text(view, parameter):
        held = reading_text(view.value_now(row), view.now)[0]
        longer = f"{text}: {held}, factory setting {factory}"
        text = longer if len(longer) < room else text
    return _step("Enter", [Text(cut_at_word(f"{text}.", room), PLAIN)], key=True)


def _factory_text(view: DoctorView, parameter: Parameter) -> str:
    """Return the factory setting, if it is known for sure and the parameter can be written."""
    if not parameter.access.startswith("rw") or not factory_is_sure(parameter):
        return ""
    raws = {**view.raws, **good_raws(view.readings)}
    value = factory_value(view.profile, parameter, raws)
    return value.display if value is not None and value.unit != "raw" else ""


def written_row(view: DoctorView, width: int) -> list[Text]:
    """Return the last write by this program in the seconds before the trip."""
    writes = [] if view.record is None else [e for e in view.record.writes if e.answer == "ok"]
    if not writes:
        return []
    last = writes[-1]
    when = time.strftime("%H:%M:%S", time.localtime(datetime.fromisoformat(last.time).timestamp()))
    change = f"{last.old} → {last.new}" if last.old else last.new
    text = Text(f"{when} ", FAINT)
    text.append(f"wrote {last.code} {change}", ATTENTION)
    text.truncate(max(10, width - STEP_WIDTH - 1), overflow="ellipsis")
    return _step("Before", [text])


def record_row(view: DoctorView, width: int) -> list[Text]:
    """Return the key that shows the seconds before the trip, if they were recorded."""
    if view.record is None:
        return []
    text = f"Show the {len(view.record.moments)} cycles before the trip."
    return _step("Tab", [Text(cut_at_word(text, max(10, width - STEP_WIDTH - 1)), PLAIN)], key=True)


def reset_rows(view: DoctorView, width: int) -> list[Text]:
    """Return what a reset needs and does, whole: it warns if the motor may start."""
    if not view.present:
        return []
    message = reset_text(view.help, view.ready, BESIDE_KEY, view.follows)
    text = capitalized(message.text)
    if view.help is not None and message.wait:
        text = f"{text} Wait about {view.help.wait_s} s before it."
    if view.barred:
        text = f"Not allowed here: {view.barred} {text}"
    elif not view.armed:
        text = f"{ARM} {text}"
    if not message.by_drive:
        text = f"{text} ({TRUST_MARKS['practice']})"
    parts = wrapped(text, max(10, width - STEP_WIDTH - 1), len(text))
    return _step("x", [Text(part, PLAIN) for part in parts], key=True)


def _step(label: str, lines: list[Text], *, key: bool = False) -> list[Text]:
    """Return the lines, indented, with a key or a name at the left of the first."""
    style = KEY if key else FAINT
    return [
        Text.assemble((f"  {label if not number else '':<{STEP_WIDTH - 2}}", style)).append_text(
            line
        )
        for number, line in enumerate(lines)
    ]
