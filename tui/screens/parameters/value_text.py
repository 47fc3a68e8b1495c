"""Present, staged and possible values of a parameter, as text; pure functions."""

from __future__ import annotations

from collections.abc import Callable

from tui.drive.profile.schema import Confidence, Parameter
from tui.drive.settings.factory import factory_is_sure, factory_value, not_factory
from tui.drive.settings.in_force import LimitsInForce, limits_in_force
from tui.drive.settings.selection import passes
from tui.drive.values import NOT_AVAILABLE, is_enumeration
from tui.session.settings.editor import Editor
from tui.session.shown import Drawn
from tui.widgets.palette import age_text

CONFIDENCE_WORDS: dict[Confidence, str] = {
    "site": "proved on this site",
    "manual": "manual",
    "manual+public": "manual and public files",
    "public-x2": "two public files",
    "public": "one public file",
    "analogy": "a sister family",
    "unverified": "none",
}
"""Source of a fact in a profile, in words."""


def held_drawn(
    editor: Editor,
    code: str,
    *,
    current: Callable[[str], Drawn],
    old: Callable[[str, float], Drawn],
    missing: Drawn,
) -> Drawn:
    """Draw the text of the held value: one that is current, or old with its age in seconds."""
    held = editor.values.held(code)
    if held is None:
        return missing
    return held.drawn(
        editor.session.clock.monotonic(),
        current=lambda value: current(value.display),
        old=lambda value, age: old(value.display, age),
        missing=missing,
    )


def value_text(editor: Editor, code: str) -> str:
    """The present value, with its age if it is old; dashes if there is none."""
    return held_drawn(
        editor,
        code,
        current=lambda text: text,
        old=lambda text, age: f"{text}, {age_text(age)} old",
        missing=NOT_AVAILABLE,
    )


def other_text(editor: Editor, parameter: Parameter) -> str:
    """The value in the compared set; the factory value without a comparison."""
    if editor.other:
        raw = editor.other.get(parameter.code)
        return "" if raw is None else text_of(editor, parameter, raw)
    return factory_text(editor, parameter)


def factory_text(editor: Editor, parameter: Parameter) -> str:
    """The factory value, with a ? if no document of the family states it, or a text for it."""
    values = editor.values
    value = factory_value(editor.session.profile, parameter, values.raws, values.lacking)
    if value is None:
        return parameter.factory_text
    return value.display if factory_is_sure(parameter) else f"{value.display} ?"


def is_changed(editor: Editor, parameter: Parameter) -> bool:
    """Return True if a setting differs from its factory value."""
    values = editor.values
    return not_factory(editor.session.profile, parameter, values.raws, values.lacking)


def is_marked(editor: Editor, parameter: Parameter) -> bool:
    """Return True if a setting differs from the value in the column of the other set.

    That is the factory value, unless another set is compared.
    """
    if not editor.other:
        return is_changed(editor, parameter)
    held = parameter.code in editor.values.raws
    return held and passes(editor.facts, "differs", parameter)


def text_of(editor: Editor, parameter: Parameter, raw: int) -> str:
    """A raw value of a parameter with its unit."""
    return editor.values.value_of(parameter.code, raw).display


def old_text(editor: Editor, code: str) -> str:
    """Return the parameter's value before the last write; empty if it was not written."""
    result = editor.staging.results.get(code)
    return result.edit.old_text if result is not None and result.done else ""


def limits_now(
    editor: Editor, parameter: Parameter, *, staged: bool = False
) -> LimitsInForce | None:
    """The present limits, or with `staged` those after the staged edits."""
    raws = editor.staging.edits.after(editor.values.raws) if staged else editor.values.raws
    return limits_in_force(editor.session.profile, parameter, raws, editor.values.lacking)


def range_text(editor: Editor, parameter: Parameter) -> str:
    """Return the active limits, or the number of values of an enumeration."""
    if parameter.access == "r" or parameter.bits:
        return ""
    if is_enumeration(parameter):
        return f"{len(editor.session.profile.names(parameter))} values"
    limits = limits_now(editor, parameter)
    return limits.text if limits is not None else ""


def step_text(editor: Editor, parameter: Parameter) -> str:
    """Return the size of one step with its unit; empty if it is not a number."""
    limits = limits_now(editor, parameter)
    return f"{limits.step:f} {limits.unit}".rstrip() if limits is not None else ""
