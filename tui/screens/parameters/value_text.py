"""Held, staged and possible values of a parameter, as text; pure functions."""

from __future__ import annotations

from tui.drive.profile.schema import Confidence, Parameter
from tui.drive.settings.factory import factory_is_sure, factory_value, not_factory
from tui.drive.settings.in_force import LimitsInForce, limits_in_force
from tui.drive.shown import shown
from tui.drive.values import NOT_AVAILABLE, is_enumeration
from tui.session.settings.editor import Editor

CONFIDENCE_WORDS: dict[Confidence, str] = {
    "manual": "manual",
    "manual+public": "manual and public files",
    "public-x2": "two public files",
    "public": "one public file",
    "analogy": "a sister family",
    "unverified": "none",
}
"""Source of the knowledge about a parameter."""


def value_text(editor: Editor, code: str) -> str:
    """The held value, dashes while there is none."""
    value = editor.values.value(code)
    return value.display if value is not None else NOT_AVAILABLE


def other_text(editor: Editor, parameter: Parameter) -> str:
    """The factory value, or that of the set that the drive is compared with."""
    if editor.other:
        raw = editor.other.get(parameter.code)
        return "" if raw is None else text_of(editor, parameter, raw)
    return factory_text(editor, parameter)


def factory_text(editor: Editor, parameter: Parameter) -> str:
    """The factory value, with a ? if no document of the family states it; or words for it."""
    values = editor.values
    value = factory_value(editor.session.profile, parameter, values.raws, values.lacking)
    if value is None:
        return parameter.factory_text
    return value.display if factory_is_sure(parameter) else f"{value.display} ?"


def is_changed(editor: Editor, parameter: Parameter) -> bool:
    """Return True if a setting is not as from the factory."""
    values = editor.values
    return not_factory(editor.session.profile, parameter, values.raws, values.lacking)


def text_of(editor: Editor, parameter: Parameter, raw: int) -> str:
    """A raw value of a parameter with its unit."""
    return shown(
        editor.session.profile, parameter, raw, editor.values.raws, editor.values.lacking
    ).display


def old_text(editor: Editor, code: str) -> str:
    """Return the parameter's value before the last write; empty if it was not written."""
    result = editor.staging.results.get(code)
    return result.edit.old_text if result is not None and result.done else ""


def limits_now(
    editor: Editor, parameter: Parameter, *, staged: bool = False
) -> LimitsInForce | None:
    """The present limits, or those after the staged edits."""
    raws = editor.staging.edits.after(editor.values.raws) if staged else editor.values.raws
    return limits_in_force(editor.session.profile, parameter, raws, editor.values.lacking)


def range_text(editor: Editor, parameter: Parameter) -> str:
    """Return its range: the limits in force, or the number of names."""
    if parameter.access == "r" or parameter.bits:
        return ""
    if is_enumeration(parameter):
        return f"{len(editor.session.profile.names(parameter))} values"
    limits = limits_now(editor, parameter)
    return limits.text if limits is not None else ""


def step_text(editor: Editor, parameter: Parameter) -> str:
    """Return the value of one step with its unit; empty if it is not a number."""
    limits = limits_now(editor, parameter)
    return f"{limits.step:f} {limits.unit}".rstrip() if limits is not None else ""
