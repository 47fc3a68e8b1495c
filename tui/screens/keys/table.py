"""Every action of the panel in one place: its key, its words, the screens it belongs to.

Bindings, the line of keys, the help screen and the command palette are made from this table.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from textual.binding import Binding, BindingType

from tui.widgets.drawing import KeyLabel, fitting

from .action import (
    BLOCKS,
    CONNECTION,
    EVERYWHERE,
    FAULTS,
    FRAMES,
    LISTENING,
    MESSAGES,
    MONITOR,
    OPENING,
    PARAMETERS,
    SOURCES,
    WIRING,
    Action,
    on,
)
from .block_actions import BLOCK_ACTIONS
from .monitor_actions import COMMAND_ACTIONS, TEACH_ACTIONS, WATCH_ACTIONS
from .parameter_actions import PARAMETER_ACTIONS

app_action = partial(Action, app=True)
stops = partial(Action, app=True, first=True)
STOP = "Stop the open drive on its ramp; all drives if none is open. Not while typing text."
STOP_ANYWHERE = "Stop the open drive on its ramp, even while typing text."
STOP_ALL = "Stop all drives of all open lines on their ramps."
ARM = "Arm this drive for 60 s; each key press restarts the 60 s."
PROVE = "Test the drive's reaction to a communication loss. Needs arming; asks first."
GIVE_DRIVE = "Answer a program that requests this drive. Asks first."
ABOVE_MONITOR = (PARAMETERS, BLOCKS, FAULTS, SOURCES, FRAMES)
OF_A_DRIVE = (MONITOR, *ABOVE_MONITOR)
WHILE_OPENING: tuple[KeyLabel, ...] = (("leave", "Esc", "cancel"), ("help", "?", "help"))
"""Keys that mean something while a line is being opened, besides those that stop."""
NEVER_DROPPED = ("stop_by_space", "help")
"""Actions in the line of keys however narrow the terminal is."""
WHILE_TYPING: tuple[KeyLabel, ...] = (
    ("command_palette", "^p", "all"),
    ("help", "F1", "help"),
    ("quit", "^q", "leave"),
)
"""Keys of the whole panel other than letters."""
STOPS_ALL, STOPS_NOBODY = "STOP ALL", "no stop here"
"""Labels of the stop key if it stops every drive, or none."""
WRITE_SOURCE = "Write the chosen configuration. Needs arming and standstill; asks first."
SAVE = "Save to a file: a backup, an assignment, the frames, or the record of a trip."
OPEN = "Open a file: compare a parameter set, or propose an assignment."
FIND = "Find a parameter by code, name, address or value; works on every screen."
WIRING_HELP = "Show wiring and warnings of the family: pins, line rules, LEDs, commands, errata."
SCAN_SETTINGS = "Scan at other baud rates and formats, likely ones first. Asks first."
WHY = "Diagnose why a drive does not answer, and show the next steps."
HEAR = "Listen to a line with another master; send nothing. Asks first."
ACCEPT = "Accept the changed line: another adapter, or other drives. Asks first."
BUNDLE = "Bundle everything about the line in one file, for a colleague."
EEPROM = "Save the settings to the drive's EEPROM, if it needs that. Needs arming; asks first."

PLACES: tuple[tuple[str, str, str], ...] = (
    (CONNECTION, "1", "Line"),
    (MONITOR, "2", "Monitor"),
    (PARAMETERS, "3", "Parameters"),
    (BLOCKS, "4", "Scanner"),
    (FAULTS, "5", "Faults"),
    (SOURCES, "6", "Control"),
    (FRAMES, "7", "Frames"),
)
"""The screens, each with its key everywhere, and how it is called."""

ACTIONS: tuple[Action, ...] = (
    stops("stop_by_space", "space", "STOP", STOP),
    stops("stop", "f12", "", STOP_ANYWHERE),
    stops("stop_all", "f9", "", STOP_ALL),
    *on(
        (CONNECTION,),
        ("open_chosen", "enter", "open", "Open the line or drive under the cursor."),
        ("scan", "s", "search", "Scan the addresses for drives; drives already found stay."),
        ("addresses", "c", "range", "Change the addresses to scan: 1-31, or 1,3,5-7."),
        ("type_line", "n", "line", "Type a line to open: serial, TCP, RTU over TCP, simulated."),
        ("stop_scan", "escape", "", "Leave the field, then end the scan."),
        ("scan_settings", "", "", SCAN_SETTINGS),
        ("refresh_lines", "", "", "Update the list of serial ports."),
        ("disconnect", "", "", "Close the line. Asks first if a drive reacts to that."),
    ),
    *on((MONITOR, SOURCES, PARAMETERS, BLOCKS, FAULTS), ("arm", "a", "arm", ARM)),
    *on((MONITOR, SOURCES, PARAMETERS, BLOCKS, FAULTS), ("disarm", "A", "", "Disarm this drive.")),
    *on((MONITOR, SOURCES, PARAMETERS, BLOCKS, FAULTS), ("answer_request", "G", "", GIVE_DRIVE)),
    *COMMAND_ACTIONS,
    *on((SOURCES,), ("prove", "P", "prove", PROVE)),
    Action("write_chosen", "enter", "write", WRITE_SOURCE, (SOURCES,), bound=False),
    *on(
        (FAULTS,),
        ("open", "enter", "open", "Open the parameter, or show that fault of the history."),
        ("move(-1)", "up", "", "Move up."),
        ("move(1)", "down", "", "Move down."),
        ("other_page", "tab", "trip", "Switch between the fault and the seconds before the trip."),
        ("move_record(1)", "left", "", "Show older values of the record."),
        ("move_record(-1)", "right", "", "Show newer values of the record."),
        ("leave", "escape", "", "Return from the history to the present fault, then to Monitor."),
    ),
    *on((SOURCES,), ("leave", "escape", "back", "Go back to Monitor.")),
    *PARAMETER_ACTIONS,
    *TEACH_ACTIONS,
    *BLOCK_ACTIONS,
    *WATCH_ACTIONS,
    *on(
        (FRAMES, LISTENING),
        ("hold", "h", "hold", "Pause or resume the list."),
        ("other_page", "tab", "page", "Show the next page: values, bytes, counters or summary."),
        ("only", "O", "only", "Filter the frames by drive, function or error: 2 read error."),
        ("find_frame", "j", "", "Find frames by drive, function, error or text."),
        ("scroll(-1)", "up", "", "Show older frames; pauses the list."),
        ("scroll(1)", "down", "", "Show newer frames."),
        ("scroll(-10)", "pageup", "", "Go back ten frames."),
        ("scroll(10)", "pagedown", "", "Go forward ten frames."),
    ),
    *on(
        (FRAMES,),
        (
            "reset_counters",
            "C",
            "",
            "Restart the counts of this panel; other programs keep theirs.",
        ),
        (
            "reset_drive_counters",
            "Z",
            "",
            "Set the drive's own counters to 0. Needs arming; asks first.",
        ),
        ("leave", "escape", "back", "Clear the filter, then return to Monitor."),
    ),
    *on((LISTENING,), ("leave", "escape", "end", "Clear the filter, then end listening.")),
    *on(
        (MESSAGES,),
        ("scroll(-1)", "up", "", "Show newer messages."),
        ("scroll(1)", "down", "older", "Show older messages."),
        ("scroll(-10)", "pageup", "", "Go to newer messages, ten lines."),
        ("scroll(10)", "pagedown", "", "Go to older messages, ten lines."),
        ("leave", "escape", "back", "Go back."),
    ),
    *on((OPENING,), ("leave", "escape", "Line", "Cancel the opening, or go to Line.")),
    *on(
        (WIRING,),
        ("scroll(-1)", "up", "", "Scroll up one line."),
        ("scroll(1)", "down", "scroll", "Scroll down one line."),
        ("page(-1)", "pageup", "", "Scroll up one page."),
        ("page(1)", "pagedown", "", "Scroll down one page."),
        ("section(1)", "tab", "next", "Go to the next section."),
        ("section(-1)", "shift+tab", "", "Go to the previous section."),
        ("leave", "escape", "back", "Go back."),
    ),
    *(app_action(f"goto({place!r})", key, "", f"Go to {name}.") for place, key, name in PLACES),
    app_action("step_drive(-1)", "[", "", "Go to the previous drive on this line."),
    app_action("step_drive(1)", "]", "", "Go to the next drive on this line."),
    app_action("find", "/", "", FIND),
    app_action("messages", "m", "", "Show all messages, with their times."),
    app_action("wiring", "I", "", WIRING_HELP),
    app_action("why", "N", "", WHY),
    app_action("hear", "H", "", HEAR),
    app_action("save_shown", "ctrl+s", "", SAVE),
    app_action("open_file", "ctrl+o", "", OPEN),
    app_action("eeprom", "S", "", EEPROM),
    app_action("command_palette", "ctrl+p", "all", "Find an action by typing words."),
    app_action("help", "?,f1", "help", "Show the keys of this screen."),
    app_action("bundle", "", "", BUNDLE),
    app_action("accept_line", "", "", ACCEPT),
    app_action("redraw", "ctrl+l", "", "Redraw the screen if it is garbled."),
    app_action(
        "quit", "q,ctrl+q", "leave", "Leave the panel. Asks first if that has consequences."
    ),
)


def bindings(screen: str | None) -> list[BindingType]:
    """Textual's bindings of a screen, or of the app for None."""
    return [
        Binding(
            action.keys,
            action.id,
            action.label or action.help,
            show=False,
            id=f"{screen or 'app'}.{action.id}",
            tooltip=action.help,
            priority=action.first,
        )
        for action in ACTIONS
        if action.bound
        and action.keys
        and action.app == (screen is None)
        and (screen is None or screen in action.screens)
    ]


def screen_actions(screen: str) -> list[Action]:
    """Actions that work on a screen: the stop first, then the screen's own and the app's."""
    return [action for action in ACTIONS if screen in action.screens]


def keys_line(screen: str, width: int, stops: str = "STOP") -> list[KeyLabel]:
    """The line of keys of a screen, the stop first; where it is narrow, without the last ones.

    `stops` says whom the stop key stops.
    """
    first = stop_keys(stops, typing=False)[0]
    keys = [
        (action.id, action.shown, action.label) for action in screen_actions(screen) if action.label
    ]
    named = [first if key[0] == first[0] else key for key in keys]
    return fitting(named, width, NEVER_DROPPED)


def typing_line(
    width: int, stops: str, own: Sequence[tuple[str, str]], *, spaces: bool
) -> list[KeyLabel]:
    """The line of keys while a text is typed: no letter means anything else then.

    `own` are the keys of that field and what they do; with `spaces` a space is text too.
    """
    first = stop_keys(stops, typing=spaces)[0]
    keys = [first, *((f"typing {key}", key, does) for key, does in own), *WHILE_TYPING]
    return fitting(keys, width, NEVER_DROPPED)


def opening_line(width: int, stops: str) -> list[KeyLabel]:
    """The line of keys while a line is being opened: any other key is ignored."""
    return fitting([*stop_keys(stops, typing=False), *WHILE_OPENING], width, NEVER_DROPPED)


def stop_keys(stops: str, *, typing: bool) -> list[KeyLabel]:
    """The keys that stop now, as a line of keys names them: whom that key `stops`, then all.

    While a text is `typing`, Space is text and the key is F12.
    """
    keys = [("stop_by_space", "F12" if typing else "Space", stops)]
    return keys if stops in (STOPS_ALL, STOPS_NOBODY) else [*keys, ("stop_all", "F9", STOPS_ALL)]


SHELL_KEYS = {"ctrl+z": "Ctrl+Z", "ctrl+backslash": "Ctrl+\\"}
"""Keys by which a shell suspends or ends a program; Ctrl+C has an action of its own."""


def elsewhere(screen: str, key: str, character: str | None = None) -> str:
    """Return which screen uses a key that this one does not know; empty if none.

    Of a key with a sign the table has the `character`, as `*`, and not its name.
    """
    if shell_key := SHELL_KEYS.get(key):
        return f"{shell_key} ends nothing here: q leaves the panel."
    keys = {key, character}
    found = [a for a in ACTIONS if keys & {*a.keys.split(",")} and screen not in a.screens]
    if not found:
        return ""
    first = found[0]
    names = {place: f"{name} ({digit})" for place, digit, name in PLACES}
    where = [names[a.screens[0]] for a in found if a.screens[0] in names] or ["another screen"]
    if len(set(where)) == 1:
        return f"{first.shown} has a meaning on {where[0]}: {first.help}"
    *most, last = sorted(set(where), key=lambda name: name[-2])
    return f"{first.shown} has a meaning on {', '.join(most)} and {last}."


def once_closed(screen: str, key: str, character: str | None = None) -> str:
    """Report where a key works that the dialog over a screen does not know; empty if nowhere."""
    keys = {key, character}
    here = next((a for a in screen_actions(screen) if keys & {*a.keys.split(",")}), None)
    if here is not None:
        return f"{here.shown} works once this is closed (Esc): {here.help}"
    return elsewhere(screen, key, character)


__all__ = [
    "ACTIONS",
    "BLOCKS",
    "CONNECTION",
    "EVERYWHERE",
    "FAULTS",
    "FRAMES",
    "LISTENING",
    "MESSAGES",
    "MONITOR",
    "OPENING",
    "PARAMETERS",
    "SOURCES",
    "STOPS_ALL",
    "STOPS_NOBODY",
    "WIRING",
    "Action",
    "bindings",
    "keys_line",
    "once_closed",
    "opening_line",
    "screen_actions",
    "stop_keys",
    "typing_line",
]
