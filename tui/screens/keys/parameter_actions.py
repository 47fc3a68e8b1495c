"""Actions of the Parameters screen: action, keys, label in the line of keys, help."""

from __future__ import annotations

from .action import PARAMETERS, on

KEEP = "Confirm an unverified parameter, or keep an edit over another's change."

PARAMETER_ACTIONS = on(
    (PARAMETERS,),
    ("edit", "enter", "edit", "Edit the parameter under the cursor."),
    ("step_value(1)", "+", "step", "Stage one step more."),
    ("write", "w", "write", "Write all that is staged, each read back; armed, asks."),
    ("filter(1)", "d", "", "Show another selection: staged, all, and more."),
    ("filter(-1)", "D", "", "The selection before."),
    ("undo", "u", "", "Take the last edit back; after a write, stage the old values."),
    ("undo_all", "U", "", "Take every edit back; asks."),
    ("write_one", "W", "", "Write the edit under the cursor; armed, asks."),
    ("move(-1)", "up", "", "One up."),
    ("move(1)", "down", "", "One down."),
    ("page(-1)", "pageup", "", "A screen up."),
    ("page(1)", "pagedown", "", "A screen down."),
    ("end(-1)", "home", "", "The first parameter."),
    ("end(1)", "end", "", "The last parameter."),
    ("group(1)", "tab,right", "", "The next group."),
    ("group(-1)", "shift+tab,left", "", "The group before."),
    ("step_value(-1)", "-", "", "Stage one step less."),
    ("undo_this", "delete", "", "Take the edit under the cursor back."),
    ("favorite", "*", "", "Mark or unmark as a favorite."),
    ("confirm", "y", "", KEEP),
    ("stage_set", "i", "", "Stage what the file compared with has otherwise."),
    ("report", "", "", "Write a report on this drive (Markdown)."),
    ("factory", "F", "", "Recall the factory settings; armed, asks."),
    ("leave", "escape", "", "Out of search, selection, screen."),
)
