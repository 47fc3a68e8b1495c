"""Description of a write, in words, before it is done."""

from __future__ import annotations

from collections.abc import Sequence

from tui.drive.settings.edits import Edit, Edits, consequences
from tui.drive.settings.limits import edit_problems
from tui.drive.settings.writable import cuts_line
from tui.drive.settings.write_sequence import ordered
from tui.drive.values import NOT_AVAILABLE
from tui.session.settings.editor import Editor

EDITS_NAMED = 9
"""Edits that are named; the others are counted."""


def write_text(editor: Editor, edits: Sequence[Edit]) -> str:
    """Old and new of each edit in the order of writing, then what is dangerous about it."""
    profile, raws = editor.session.profile, editor.values.raws
    chosen = Edits(tuple(edits))
    order = ordered(profile, chosen, raws)
    codes = max(len(e.code) for e in order)
    olds = max(len(e.old_text or NOT_AVAILABLE) for e in order)
    lines = [
        f"{e.code:<{codes}}  {e.old_text or NOT_AVAILABLE:>{olds}} → {e.text}"
        for e in order[:EDITS_NAMED]
    ]
    if len(order) > EDITS_NAMED:
        lines.append(f"and {len(order) - EDITS_NAMED} more")
    reported = list(edit_problems(profile, chosen, raws).values())
    reported += [r.text for e in order if (r := editor.refusal(e.code)) is not None]
    reported += [edit.warning for edit in order if edit.warning]
    reported += consequences(profile, chosen, raws, editor.values.lacking)
    reported += [
        f"{e.code} changes the line itself: the drive answers at its new settings only."
        for e in order
        if cuts_line(profile, profile[e.code])
    ]
    return "\n".join([*lines, *([""] if reported else []), *dict.fromkeys(reported)])
