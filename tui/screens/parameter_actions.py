"""Actions of the Parameters screen: action, keys, label in the line of keys, help."""

from __future__ import annotations

from .action import PARAMETERS, on

KEEP = "Confirm an unverified parameter, or keep an edit over another's change."
COMPARE = "Compare with a file, another drive of the line, or the factory settings."

PARAMETER_ACTIONS = on(
    (PARAMETERS,),
    ("edit", "enter", "edit", "Edit the parameter under the cursor."),
    ("search", "/", "find", "Search code, name, address and values."),
    ("filter(1)", "d", "show", "Show another selection: staged, all, and more."),
    ("filter(-1)", "D", "", "The selection before."),
    ("undo", "u", "", "Take the edit under the cursor back."),
    ("undo_all", "U", "", "Take every edit back."),
    ("write", "w", "write", "Write all that is staged, each read back."),
    ("write_one", "W", "", "Write the edit under the cursor."),
    ("move(-1)", "up", "", "One up."),
    ("move(1)", "down", "", "One down."),
    ("page(-1)", "pageup", "", "A screen up."),
    ("page(1)", "pagedown", "", "A screen down."),
    ("end(-1)", "home", "", "The first parameter."),
    ("end(1)", "end", "", "The last parameter."),
    ("group(-1)", "[", "", "The group before."),
    ("group(1)", "]", "", "The next group."),
    ("step_value(1)", "+", "", "Stage one step more."),
    ("step_value(-1)", "-", "", "Stage one step less."),
    ("favourite", "*", "", "Mark as a favourite, or no more."),
    ("confirm", "y", "", KEEP),
    ("save", "s", "", "Save to EEPROM, where the drive needs it."),
    ("factory", "F", "", "Recall the factory settings."),
    ("backup", "b", "", "Back all parameters up to a file."),
    ("report", "p", "", "Write a report on this drive."),
    ("compare", "o", "", COMPARE),
    ("stage_set", "n", "", "Stage what the set has otherwise."),
    ("leave", "escape", "", "Out of search, selection, screen."),
    ("monitor", "2", "", "Go to Monitor."),
)
