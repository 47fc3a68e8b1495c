"""Registration of Parameters: what the panel lists, and the keys."""

from __future__ import annotations

from ..keys.action import ARMING, TEACH, Registration, key_rows

KEEP = "Confirm an unverified parameter, or keep an edit if the value in the drive has changed."


REGISTERED = (
    Registration(
        title="Parameters",
        about="every parameter of the drive; edit, back up, compare, restore",
        digit="3",
        narrow="Par",
        screen="parameters.screen.ParametersScreen",
        actions=(
            *ARMING,
            *key_rows(
                ("edit", "enter", "edit", "Edit the parameter under the cursor."),
                ("step_value(1)", "+", "step", "Raise the staged value by one step."),
                (
                    "write",
                    "w",
                    "write",
                    "Write all staged values, each read back. Needs arming; asks first.",
                ),
                (
                    "filter(1)",
                    "d",
                    "",
                    "Show the next selection of parameters: staged, all, and more.",
                ),
                ("filter(-1)", "D", "", "Show the previous selection."),
                ("undo", "u", "", "Undo the last edit; after a write, stage the old values."),
                ("undo_all", "U", "", "Undo every edit. Asks first."),
                (
                    "write_one",
                    "W",
                    "",
                    "Write only the edit under the cursor. Needs arming; asks first.",
                ),
                ("move(-1)", "up", "", "Move up."),
                ("move(1)", "down", "", "Move down."),
                ("page(-1)", "pageup", "", "Move up one page."),
                ("page(1)", "pagedown", "", "Move down one page."),
                ("end(-1)", "home", "", "Go to the first parameter."),
                ("end(1)", "end", "", "Go to the last parameter."),
                ("group(1)", "tab,right", "", "Go to the next group."),
                ("group(-1)", "shift+tab,left", "", "Go to the previous group."),
                ("step_value(-1)", "-", "", "Lower the staged value by one step."),
                ("undo_this", "delete", "", "Undo the edit under the cursor."),
                ("favorite", "*", "", "Add to the favorites, or remove from them."),
                ("confirm", "y", "", KEEP),
                ("stage_set", "i", "", "Stage the differences from the compared file."),
                ("factory", "F", "", "Restore the factory settings. Needs arming; asks first."),
                ("leave", "escape", "", "Leave the search, then the selection, then the screen."),
            ),
            TEACH,
        ),
    ),
)
