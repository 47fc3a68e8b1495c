"""The list of screens, and every action: those of each screen, and those that all screens have.

Bindings, the key bar, the help screen and the palette are made from this table.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, partial
from importlib import import_module

from textual.binding import Binding, BindingType

from tui.terminal.names import UNSHIFTED_DIGITS
from tui.widgets.drawing import KeyLabel, fitting
from tui.widgets.replay_bar import NO_MOTOR

from .action import START_UP, Action, Registration

PACKAGES = (
    "connection",
    "monitor",
    "parameters",
    "blocks",
    "faults",
    "control",
    "frames",
    "trend",
    "messages",
    "startup",
    "wiring",
)
"""Packages of tui.screens, in the order in which their screens are listed."""


def _registered() -> Iterator[Registration]:
    for package in PACKAGES:
        # by name: this package is a layer below the screens, and must not import them
        yield from import_module(f"tui.screens.{package}.registration").REGISTERED


SCREENS: tuple[Registration, ...] = tuple(_registered())
TABBED = tuple(screen for screen in SCREENS if screen.digit)
"""Screens with a digit key and a tab."""
EVERYWHERE = tuple(screen.name for screen in SCREENS)
"""Names of all screens."""


app_action = partial(Action, screens=EVERYWHERE, app=True)
stops = partial(Action, screens=EVERYWHERE, app=True, first=True)
STOP = "Stop the open drive on its ramp; all drives if none is open. Not while typing text."
STOP_ANYWHERE = "Stop the open drive on its ramp, even while typing text."
STOP_ALL = "Stop all drives of all open lines on their ramps."
WHILE_OPENING: tuple[KeyLabel, ...] = (("leave", "Esc", "cancel"), ("help", "?", "help"))
"""Keys that work while a line is being opened, besides the stop keys."""
NEVER_DROPPED = ("stop_by_space", "no_motor", "help")
"""Actions that stay in the key bar in the narrowest terminal."""
WHILE_TYPING: tuple[KeyLabel, ...] = (
    ("command_palette", "^p", "more"),
    ("help", "F1", "help"),
    ("quit", "^q", "quit"),
)
"""Keys of the panel that work while text is typed."""
IN_REPLAY: tuple[KeyLabel, ...] = (
    ("replay_hold", "0", "hold"),
    ("replay_step", ", ;", "5 s"),
    ("replay_speed", "{ }", "speed"),
    ("replay_event", "$ #", "event"),
    ("replay_time", "@", "time"),
    ("leave", "Esc", "back"),
    ("quit", "q", "quit"),
    ("help", "?", "help"),
)
"""Keys of every screen of a replay, after the stop key."""
STOPS_ALL, STOPS_NONE = "STOP ALL", "cannot stop here"
"""Labels of the stop key if it stops every drive, or none."""
STOPS_LIVE = "STOP LIVE ALL"
"""The same in a replay with live lines beside it; without any it is `NO_MOTOR`."""
SAVE = "Save to a file: a backup, an assignment, the frames, or the record of a trip."
BACK_UP = "Back up the open drive now, under a new name in this folder."
DIFFER = "Show what differs from the newest backup of the open drive."
OPEN = "Open a file: compare a parameter set, or stage an assignment."
REPORT_DRIVE = "Report on the open drive: read everything and write a file (Markdown)."
TYPE_ADDRESS = "Type the address of a drive on this line; Enter opens it."
FIND = "Find a parameter by code, name, address or value; works on every screen."
WIRING_HELP = "Show wiring and warnings of the family: pins, line rules, LEDs, commands, errata."
GUIDE = "Start up the open drive step by step: steps from a file, results on disk."
WHY = "Diagnose why a silent drive gives no answer; show the next steps."
HEAR = "Listen to a line with another master; send nothing. Asks first."
ACCEPT = "Accept the changed line: another adapter, or other drives. Asks first."
BUNDLE = "Bundle everything about the line in one file, for a colleague."
EEPROM = "Save the settings to EEPROM, if the drive needs that. Needs arming; asks first."


def _digit_keys(digit: str) -> str:
    """A digit, and what its key sends without Shift on a French keyboard."""
    return ",".join([digit, *(sent for sent, typed in UNSHIFTED_DIGITS.items() if typed == digit)])


STOP_ACTIONS: tuple[Action, ...] = (
    stops("stop_by_space", "space", "STOP", STOP),
    stops("stop", "f12", "", STOP_ANYWHERE),
    stops("stop_all", "f9", "", STOP_ALL),
)
APP_ACTIONS: tuple[Action, ...] = (
    *(
        app_action(
            f"goto({screen.name!r})", _digit_keys(screen.digit), "", f"Go to {screen.title}."
        )
        for screen in TABBED
    ),
    app_action("step_drive(-1)", "[", "", "Go to the previous drive on this line."),
    app_action("step_drive(1)", "]", "", "Go to the next drive on this line."),
    app_action("type_address", ".", "", TYPE_ADDRESS),
    app_action("find", "/", "", FIND),
    app_action("messages", "m", "", "Show all messages, with their times."),
    app_action("wiring", "I", "", WIRING_HELP),
    app_action(f"goto({START_UP!r})", "B", "", GUIDE),
    app_action("why", "N", "", WHY),
    app_action("hear", "H", "", HEAR),
    app_action("replay_hold", "0", "", "In a replay: hold it, or let it go on."),
    app_action("replay_step(-5)", "comma", "", "In a replay: go back by 5 s."),
    app_action("replay_step(5)", ";", "", "In a replay: go forward by 5 s."),
    app_action("replay_speed(-1)", "{", "", "In a replay: play slower."),
    app_action("replay_speed(1)", "}", "", "In a replay: play faster."),
    app_action("replay_event(1)", "#", "", "In a replay: go to the next event."),
    app_action("replay_event(-1)", "$", "", "In a replay: go to the event before."),
    app_action("replay_time", "@", "", "In a replay: type a time to go to."),
    app_action("save_shown", "ctrl+s", "", SAVE),
    app_action("open_file", "ctrl+o", "", OPEN),
    app_action("back_up", "ctrl+k", "", BACK_UP),
    app_action("differ", "ctrl+d", "", DIFFER),
    app_action("report", "ctrl+r", "", REPORT_DRIVE),
    app_action("eeprom", "S", "", EEPROM),
    app_action("command_palette", "ctrl+p", "more", "Find an action by typing words."),
    app_action("help", "?,f1", "help", "Show the keys of this screen."),
    app_action("bundle", "", "", BUNDLE),
    app_action("accept_line", "", "", ACCEPT),
    app_action("redraw", "ctrl+l", "", "Redraw the screen if it is garbled."),
    app_action("quit", "q,ctrl+q", "quit", "Quit the panel. Asks first if that has consequences."),
)
"""Actions that every screen has after its own."""


def _actions() -> Iterator[Action]:
    """Yield the actions of all screens, each once."""
    yield from STOP_ACTIONS
    where: dict[Action, list[str]] = {}
    for screen in SCREENS:
        for action in screen.actions:
            where.setdefault(action, []).append(screen.name)
    for action, screens in where.items():
        yield action._replace(screens=tuple(screens))
    yield from APP_ACTIONS


ACTIONS = tuple(_actions())
"""Every action of the panel."""


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
        for action in ((*STOP_ACTIONS, *APP_ACTIONS) if screen is None else _own(screen))
        if action.bound and action.keys
    ]


def screen_actions(screen: str) -> list[Action]:
    """Actions that work on a screen: the stop first, then the screen's own and the app's."""
    return [*STOP_ACTIONS, *_own(screen), *APP_ACTIONS]


def _own(screen: str) -> tuple[Action, ...]:
    return next(registered.actions for registered in SCREENS if registered.name == screen)


@cache
def key_meanings(screen: str) -> Mapping[str, bool]:
    """By key of a registered screen: True if it only moves a cursor or shows something."""
    actions = screen_actions(screen) if screen in EVERYWHERE else []
    return {
        key: action.only_shows for action in reversed(actions) for key in action.keys.split(",")
    }


def keys_line(screen: str, width: int, stops: str = "STOP") -> list[KeyLabel]:
    """The key bar of a screen, the stop first; the last keys are dropped if it is narrow.

    `stops` is the label of the stop key.
    """
    first = stop_keys(stops, typing=False)[0]
    if stops in (STOPS_LIVE, NO_MOTOR):
        return fitting([first, *IN_REPLAY], width, NEVER_DROPPED)
    keys = [
        (action.id, action.shown, action.label) for action in screen_actions(screen) if action.label
    ]
    named = [first if key[0] == first[0] else key for key in keys]
    return fitting(named, width, NEVER_DROPPED)


def typing_line(
    width: int, stops: str, own: Sequence[tuple[str, str]], *, spaces: bool
) -> list[KeyLabel]:
    """The key bar while a text is typed, when letters are text.

    `own` are the keys of the field with their labels; with `spaces` a space is text, too.
    """
    first = stop_keys(stops, typing=spaces)[0]
    keys = [first, *((f"typing {key}", key, does) for key, does in own), *WHILE_TYPING]
    return fitting(keys, width, NEVER_DROPPED)


def opening_line(width: int, stops: str) -> list[KeyLabel]:
    """The key bar while a line is being opened: all other keys are ignored."""
    return fitting([*stop_keys(stops, typing=False), *WHILE_OPENING], width, NEVER_DROPPED)


def stop_keys(stops: str, *, typing: bool) -> list[KeyLabel]:
    """The stop keys for a key bar: the one with the label `stops`, then the one for all drives.

    While a text is being typed (`typing`), Space is text and the key is F12.
    """
    if stops == NO_MOTOR:
        return [("no_motor", "", NO_MOTOR)]
    keys = [("stop_by_space", "F12" if typing else "Space", stops)]
    return (
        keys
        if stops in (STOPS_ALL, STOPS_NONE, STOPS_LIVE)
        else [*keys, ("stop_all", "F9", STOPS_ALL)]
    )


CAPS_LOCK = "Is Caps Lock on? {key} means: {help}"
SHELL_KEYS = {"ctrl+z": "Ctrl+Z", "ctrl+backslash": "Ctrl+\\"}
"""Keys by which a shell suspends or ends a program; Ctrl+C has its own action."""


def elsewhere(screen: str, key: str, character: str | None = None) -> str:
    """Return which screens use a key that this one does not; empty if none.

    The table has the `character` of a sign, such as `*`, not Textual's name for its key. If the
    small letter works here, the text asks if Caps Lock is on.
    """
    if shell_key := SHELL_KEYS.get(key):
        return f"{shell_key} does not end the panel. Press q to quit."
    keys = {key, character}
    found = [a for a in ACTIONS if keys & {*a.keys.split(",")} and screen not in a.screens]
    texts = [_works_on(found)] if found else []
    small = key.lower()
    if key != small and len(key) == 1 and small in key_meanings(screen):
        action = next(a for a in screen_actions(screen) if small in a.keys.split(","))
        texts.append(CAPS_LOCK.format(key=small, help=action.help))
    return " ".join(texts)


def _works_on(found: Sequence[Action]) -> str:
    """The screens on which a key works, by its actions."""
    first = found[0]
    names = {page.name: _named(page) for page in SCREENS if page.digit or page.key}
    where = [names[a.screens[0]] for a in found if a.screens[0] in names] or ["another screen"]
    if len(set(where)) == 1:
        return f"{first.shown} works on {where[0]}: {first.help}"
    *most, last = sorted(set(where), key=lambda name: name[-2])
    return f"{first.shown} works on {', '.join(most)} and {last}."


def _named(page: Registration) -> str:
    """The title of a screen with the key that shows it."""
    return f"{page.title} ({page.digit or page.key})"


def once_closed(screen: str, key: str, character: str | None = None) -> str:
    """Return where a key works that the dialog over a screen does not use; empty if nowhere."""
    keys = {key, character}
    here = next((a for a in screen_actions(screen) if keys & {*a.keys.split(",")}), None)
    if here is not None:
        return f"Press Esc to close this first, then {here.shown}: {here.help}"
    return elsewhere(screen, key, character)
