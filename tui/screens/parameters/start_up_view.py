"""The group Commissioning: a first commissioning step by step, as lines; pure functions."""

from __future__ import annotations

from tui.drive.profile.profile import UNVERIFIED, Profile
from tui.drive.profile.schema import StartUpStep
from tui.widgets.drawing import wrapped

from .table_view import TableLine

TEXT_WIDTH, TEXT_LINES = 50, 4
"""Columns and lines of the text of a step without parameters, on the smallest screen."""

GROUNDS_WORDS = {
    "analogy": "as on a sister family",
    "unverified": "order of steps unverified",
    "practice": "general practice",
}
"""Source of a step and its place, if the family's own documents do not state it."""


def start_up_items(profile: Profile) -> list[TableLine]:
    """One heading per step; below it its parameters, or the text of a step without parameters."""
    found: list[TableLine] = []
    for number, step in enumerate(profile.data.start_up, start=1):
        mark = " ?" if step.confidence in UNVERIFIED else ""
        found.append(TableLine(group=f"{number} {step.step}{mark}"))
        found += [TableLine(code) for code in step.parameters]
        if not step.parameters:
            lines = wrapped(step.text, TEXT_WIDTH, TEXT_LINES)
            found += [TableLine(text=line) for line in lines]
    return found


def step_help(profile: Profile, code: str) -> str:
    """Return the text of a parameter's step; empty without a step."""
    step = next(
        (
            start_up_step
            for start_up_step in profile.data.start_up
            if code in start_up_step.parameters
        ),
        None,
    )
    return "" if step is None else _words_of_step(step)


def _words_of_step(step: StartUpStep) -> str:
    grounds = GROUNDS_WORDS.get(step.confidence, "")
    head = f"{step.step} ({grounds})" if grounds else step.step
    return f"{head}: {step.text} {step.note}".rstrip()
