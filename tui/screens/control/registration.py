"""Registration of Control: what the panel lists, the keys, and for which drives it is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..keys.action import ARMING, Action, Registration, key_rows

if TYPE_CHECKING:
    from tui.session.console import DriveConsole

CHOOSE_WORD = "Choose the parameter that this word shows."
PROVE = "Test the drive's reaction to a communication loss. Needs arming; asks first."
WRITE_SOURCE = (
    "Open the parameter of a step, or write the chosen configuration. Writing needs arming and"
    " standstill, and asks first."
)


def no_sources(console: DriveConsole) -> str:
    """Return why a drive has no Control screen; empty if it has one."""
    data = console.session.profile.data
    if data.control_sources or data.signal_paths:
        return ""
    return (
        f"Drive {console.device} sets its control source at the keypad. On Monitor, press t to take"
        " control or g to return it, if the drive can."
    )


REGISTERED = (
    Registration(
        title="Control",
        about="the control source, and the reaction to a communication loss",
        digit="6",
        narrow="Ctl",
        screen="control.screen.ControlSourceScreen",
        refusal=no_sources,
        actions=(
            *ARMING,
            *key_rows(("prove", "P", "test", PROVE)),
            Action("write_chosen", "enter", "choose", WRITE_SOURCE, bound=False),
            *key_rows(("other_page", "tab", "map", "Show the communication map.")),
            *key_rows(("leave", "escape", "", "Go back to Monitor.")),
        ),
    ),
    Registration(
        title="Map",
        tab="Control",
        screen="control.map_screen.MapScreen",
        actions=(
            Action("choose_word", "enter", "choose", CHOOSE_WORD, bound=False),
            *key_rows(
                ("turn_format(1)", "right", "format", "Show the word in the next format."),
                ("turn_format(-1)", "left", "", "Show the word in the previous format."),
                ("page(1)", "pagedown", "", "Show the rows of the map that follow."),
                ("page(-1)", "pageup", "", "Show the rows of the map that come before."),
                ("clear_word", "delete", "", "Clear the word under the cursor."),
                ("other_page", "tab", "back", "Go back to the switches."),
                ("leave", "escape", "", "Go back to Control."),
            ),
        ),
    ),
)
