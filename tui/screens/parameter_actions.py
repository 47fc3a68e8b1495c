"""Actions of the Parameters screen."""

from __future__ import annotations

from .action import PARAMETERS, Action

HERE = (PARAMETERS,)

PARAMETER_ACTIONS: tuple[Action, ...] = (
    Action("edit", "enter", "Enter", "edit", "Edit the parameter under the cursor.", HERE),
    Action("search", "slash", "/", "find", "Search code, name, address and values.", HERE),
    Action("filter(1)", "d", "d", "show", "Show another selection: staged, all, ...", HERE),
    Action("filter(-1)", "D", "D", "", "The selection before.", HERE, line=False),
    Action("undo", "u", "u", "", "Take the edit under the cursor back.", HERE, line=False),
    Action("undo_all", "U", "U", "", "Take every edit back.", HERE, line=False),
    Action("write", "w", "w", "write", "Write all that is staged, each read back.", HERE),
    Action("write_one", "W", "W", "", "Write the edit under the cursor.", HERE, line=False),
    Action("move(-1)", "up", "Up", "", "One up.", HERE, line=False),
    Action("move(1)", "down", "Down", "", "One down.", HERE, line=False),
    Action("page(-1)", "pageup", "PgUp", "", "A screen up.", HERE, line=False),
    Action("page(1)", "pagedown", "PgDn", "", "A screen down.", HERE, line=False),
    Action("end(-1)", "home", "Home", "", "The first parameter.", HERE, line=False),
    Action("end(1)", "end", "End", "", "The last parameter.", HERE, line=False),
    Action("group(-1)", "left_square_bracket", "[", "", "The group before.", HERE, line=False),
    Action("group(1)", "right_square_bracket", "]", "", "The next group.", HERE, line=False),
    Action("step_value(1)", "plus", "+", "", "Stage one step more.", HERE, line=False),
    Action("step_value(-1)", "minus", "-", "", "Stage one step less.", HERE, line=False),
    Action("favourite", "asterisk", "*", "", "Mark as a favourite, or no more.", HERE, line=False),
    Action(
        "confirm",
        "y",
        "y",
        "",
        "Confirm an unverified parameter, or keep an edit over another's change.",
        HERE,
        line=False,
    ),
    Action("save", "s", "s", "", "Save to EEPROM, where the drive needs it.", HERE, line=False),
    Action("factory", "F", "F", "", "Recall the factory settings.", HERE, line=False),
    Action("backup", "b", "b", "", "Back all parameters up to a file.", HERE, line=False),
    Action("report", "p", "p", "", "Write a report on this drive.", HERE, line=False),
    Action(
        "compare",
        "o",
        "o",
        "",
        "Compare with a file, another drive of the line, or the factory settings.",
        HERE,
        line=False,
    ),
    Action("stage_set", "n", "n", "", "Stage what the set has otherwise.", HERE, line=False),
    Action("leave", "escape", "Esc", "", "Out of search, selection, screen.", HERE, line=False),
    Action("monitor", "2", "2", "", "Go to Monitor.", HERE, line=False),
)
