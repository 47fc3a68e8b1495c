"""Registration of Faults: its title, description and keys."""

from __future__ import annotations

from ..keys.action import ARMING, RESET_FAULT, Registration, key_rows

REGISTERED = (
    Registration(
        title="Faults",
        about="the present fault with its causes, likeliest first, values at the trip and now,"
        " the history",
        digit="5",
        narrow="Flt",
        screen="faults.screen.FaultsScreen",
        actions=(
            *ARMING,
            RESET_FAULT,
            *key_rows(
                ("open", "enter", "open", "Open the parameter, or show that fault of the history."),
                ("move(-1)", "up", "", "Move up."),
                ("move(1)", "down", "", "Move down."),
                (
                    "other_page",
                    "tab",
                    "record",
                    "Switch between the fault and the seconds before the trip.",
                ),
                ("move_record(1)", "left", "", "Show older values of the record."),
                ("move_record(-1)", "right", "", "Show newer values of the record."),
                (
                    "leave",
                    "escape",
                    "",
                    "Return from the history to the present fault, then to Monitor.",
                ),
            ),
        ),
    ),
)
