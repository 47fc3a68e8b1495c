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
STOP = "Stop the drive on its ramp, except while typing text; without an open drive, stop all."
STOP_ANYWHERE = "Stop the drive on its ramp, also while text is typed."
STOP_ALL = "Stop every drive of the line on its ramp, from any screen."
ARM = "Arm this drive for a minute, or for a minute more."
PROVE = "Prove that the drive reacts to a silent line as it is set to; armed, asks."
GIVE_DRIVE = "Answer a program that asks to command this drive; asks."
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
WRITE_SOURCE = "Write the chosen configuration; armed, motor at rest, asks."
SAVE = "Save what is shown to a file: a backup, an assignment, the record of a trip."
OPEN = "Open a file: compare with it and stage what it has otherwise, or propose its slots."
FIND = "Find a parameter by code, name, address or value, from anywhere."
WIRING_HELP = "Wiring, pins, warnings of a family: connectors, line rules, lamps, commands, errata."
SCAN_SETTINGS = "Search at other baud rates and formats, likely ones first; asks."
WHY = "Why no answer? Diagnose a silent drive, and show the next step."
HEAR = "Listen to a line on which another master asks; the panel sends nothing there, asks."
ACCEPT = "Accept the line with another adapter or other drives than before; asks."
BUNDLE = "Bundle for a colleague: all about the line in one file."
EEPROM = "Save the settings in the drive's EEPROM, where it needs that; armed, asks."

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
        ("open_chosen", "enter", "open", "Open the chosen line or drive."),
        ("scan", "s", "search", "Search for drives at the addresses given; those found stay."),
        ("addresses", "c", "range", "Change the addresses to search: 1-31, or 1,3,5-7."),
        ("type_line", "n", "line", "Type a line: serial, TCP, RTU over TCP, sim."),
        ("stop_scan", "escape", "", "Out of a field, then end the search for drives."),
        ("scan_settings", "", "", SCAN_SETTINGS),
        ("refresh_lines", "", "", "Look for serial ports again."),
        ("disconnect", "", "", "Close the line; asks where a drive acts on that."),
    ),
    *on((MONITOR, SOURCES, PARAMETERS, BLOCKS, FAULTS), ("arm", "a", "arm", ARM)),
    *on((MONITOR, SOURCES, PARAMETERS, BLOCKS, FAULTS), ("disarm", "A", "", "End arming.")),
    *on((MONITOR, SOURCES, PARAMETERS, BLOCKS, FAULTS), ("answer_request", "G", "", GIVE_DRIVE)),
    *COMMAND_ACTIONS,
    *on((SOURCES,), ("prove", "P", "prove", PROVE)),
    Action("write_chosen", "enter", "write", WRITE_SOURCE, (SOURCES,), bound=False),
    *on(
        (FAULTS,),
        ("open", "enter", "open", "Open the parameter, or look at that fault of the history."),
        ("move(-1)", "up", "", "One up."),
        ("move(1)", "down", "", "One down."),
        ("other_page", "tab", "trip", "The seconds before the trip, or the fault."),
        ("move_record(1)", "left", "", "Older values of the record."),
        ("move_record(-1)", "right", "", "Newer values of the record."),
        ("leave", "escape", "", "From a fault of the history to now, then to Monitor."),
    ),
    *on((SOURCES,), ("leave", "escape", "back", "Go back to Monitor.")),
    *PARAMETER_ACTIONS,
    *TEACH_ACTIONS,
    *BLOCK_ACTIONS,
    *WATCH_ACTIONS,
    *on(
        (FRAMES, LISTENING),
        ("hold", "h", "hold", "Pause or resume the list."),
        ("other_page", "tab", "page", "Codes and values, bytes, or what was counted."),
        ("only", "O", "only", "Show only frames of a drive, a function or errors: 2 read error."),
        ("find_frame", "j", "", "Find frames by drive, function, error, or what they say."),
        ("scroll(-1)", "up", "", "Older frames; the list is held."),
        ("scroll(1)", "down", "", "Newer frames."),
        ("scroll(-10)", "pageup", "", "Ten frames older."),
        ("scroll(10)", "pagedown", "", "Ten frames newer."),
    ),
    *on(
        (FRAMES,),
        ("reset_counters", "C", "", "Count from now on; what others see stays."),
        ("reset_drive_counters", "Z", "", "Set the drive's own counters to 0; armed, asks."),
        ("leave", "escape", "back", "Clear the filter, then return to Monitor."),
    ),
    *on((LISTENING,), ("leave", "escape", "end", "Clear the filter, then end listening.")),
    *on(
        (MESSAGES,),
        ("scroll(-1)", "up", "", "Newer messages."),
        ("scroll(1)", "down", "older", "Older messages."),
        ("scroll(-10)", "pageup", "", "Ten lines newer."),
        ("scroll(10)", "pagedown", "", "Ten lines older."),
        ("leave", "escape", "back", "Go back."),
    ),
    *on((OPENING,), ("leave", "escape", "Line", "Cancel the opening, or go to Line.")),
    *on(
        (WIRING,),
        ("scroll(-1)", "up", "", "One line up."),
        ("scroll(1)", "down", "scroll", "One line down."),
        ("page(-1)", "pageup", "", "A page up."),
        ("page(1)", "pagedown", "", "A page down."),
        ("section(1)", "tab", "next", "The next section."),
        ("section(-1)", "shift+tab", "", "The section before."),
        ("leave", "escape", "back", "Go back."),
    ),
    *(app_action(f"goto({place!r})", key, "", f"Go to {name}.") for place, key, name in PLACES),
    app_action("step_drive(-1)", "[", "", "The drive before on this line."),
    app_action("step_drive(1)", "]", "", "The next drive on this line."),
    app_action("find", "/", "", FIND),
    app_action("messages", "m", "", "Messages: everything that was said, with its time."),
    app_action("wiring", "I", "", WIRING_HELP),
    app_action("why", "N", "", WHY),
    app_action("hear", "H", "", HEAR),
    app_action("save_shown", "ctrl+s", "", SAVE),
    app_action("open_file", "ctrl+o", "", OPEN),
    app_action("eeprom", "S", "", EEPROM),
    app_action("command_palette", "ctrl+p", "all", "Find any action by its words."),
    app_action("help", "?,f1", "help", "Show every key."),
    app_action("bundle", "", "", BUNDLE),
    app_action("accept_line", "", "", ACCEPT),
    app_action("redraw", "ctrl+l", "", "Draw the screen again if it is garbled."),
    app_action("quit", "q,ctrl+q", "leave", "Leave the panel; asks where it matters."),
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
