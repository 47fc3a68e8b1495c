"""Registration of a screen: its names, its key, its actions."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

from tui.drive.sentences import MAY_START

if TYPE_CHECKING:
    from textual.screen import Screen

    from tui.session.console import DriveConsole

CONNECTION, MONITOR, FRAMES = "line", "monitor", "frames"
SOURCES, FAULTS, PARAMETERS = "control", "faults", "parameters"
BLOCKS, MESSAGES, WIRING = "scanner", "messages", "wiring"
START_UP = "start-up"
OPENING = "opening"
"""Monitor before its drive is known."""
MAP = "map"
"""The communication map, a page of Control."""
LISTENING = "listening"
"""The mode of Frames for a monitored line, on which nothing is sent."""

KEY_NAMES = {
    "escape": "Esc",
    "ctrl+p": "^p",
    "ctrl+l": "^l",
    "ctrl+s": "^s",
    "ctrl+o": "^o",
    "ctrl+r": "^r",
    "ctrl+k": "^k",
    "ctrl+d": "^d",
    "shift+tab": "Shift+Tab",
    "pageup": "PgUp",
    "pagedown": "PgDn",
    "comma": ",",
}
"""Keys whose names on screens differ from Textual's, apart from capitals."""


SHOWING = frozenset(
    {
        *("goto", "find", "messages", "wiring", "command_palette", "help", "redraw"),
        *("move", "page", "end", "group", "scroll", "section", "move_record", "filter"),
        *(
            "other_page",
            "other_table",
            "next_word",
            "trend_window",
            "cursor",
            "move_cursor",
            "mark",
            "oldest",
            "newest",
            "turn_format",
            "replay_hold",
            "replay_speed",
            "replay_step",
            "replay_event",
            "replay_time",
        ),
    }
)
"""Actions that move a cursor or show something, and do nothing else: their keys act at once.

`step_drive` and `type_address` are not among them: they change which motor the stop key stops.
"""

NOT_IN_REPLAY = frozenset(
    {
        *(
            "arm",
            "answer_request",
            "run_line",
            "step_reference",
            "reference_by",
            "reset",
            "options",
        ),
        *(
            "take_control",
            "hand_back",
            "take_over",
            "inputs",
            "rehearse",
            "stop_as",
            "ask_stop_as",
            "prove",
        ),
        *("edit", "step_value", "factory", "confirm", "stage_set", "write", "write_one", "eeprom"),
        *("pick", "shift", "clear", "best", "exchange", "choose_word", "clear_word", "teach"),
        *("write_chosen", "reset_drive_counters", "verify"),
    }
)
"""Actions that command a drive, write to it, or prepare that: a replay refuses them."""
LINE_ONLY_IN_REPLAY = frozenset({"why", "hear", "bundle", "scan"})
"""Actions that send requests or open ports: in a replay, only for the line chosen on Line."""


class Action(NamedTuple):
    """One function of the panel."""

    id: str
    """Name of the method, with its arguments as Textual writes them."""
    keys: str
    """Keys as Textual names them, separated by commas."""
    label: str
    """One or two words for the key bar; empty if it is not in the key bar."""
    help: str
    """A sentence for the help screen and the palette."""
    screens: tuple[str, ...] = ()
    """Names of the screens on which it works; the table of actions fills them in."""
    app: bool = False
    """True for an action of the app, False for one of the screen."""
    first: bool = False
    """True if the key takes precedence over the focused widget."""
    bound: bool = True
    """False if the focused widget handles the key."""

    @property
    def only_shows(self) -> bool:
        """True if it only moves a cursor or shows something."""
        return self.id.partition("(")[0] in SHOWING

    @property
    def shown(self) -> str:
        """The first of its keys, as screens show it."""
        key = self.keys.partition(",")[0]
        return KEY_NAMES.get(key, key.capitalize() if len(key) > 1 else key)


ActionRow = tuple[str, str, str, str]
"""A row of an action table: id, keys, label, help."""


def key_rows(*actions: ActionRow) -> tuple[Action, ...]:
    """Make the actions of a screen, in the order of their rows."""
    return tuple(Action(*row) for row in actions)


ARMING = key_rows(
    ("arm", "a", "arm", "Arm this drive for 60 s; each key press restarts the 60 s."),
    ("disarm", "A", "", "Disarm this drive."),
    ("answer_request", "G", "", "Answer a program that requests this drive. Asks first."),
)
"""Actions of every screen that writes to the drive; its class derives from `ArmingKeys`."""
RESET_HELP = f"Reset the fault. Needs arming; asks first. {MAY_START}"
RESET_FAULT = Action("reset", "x", "reset", RESET_HELP)
TEACH = Action("teach", "L", "", "Learn the scale of a raw value from the drive's display.")


class Registration(NamedTuple):
    """One screen: tabs, keys, help, palette and pages of the docs are made from it.

    Its module does not import the screen, as the panel starts before most screens are needed.
    """

    title: str
    """Its name on the panel. In lowercase it is its name in the code and of its docs page."""
    actions: tuple[Action, ...]
    """Its own actions, in the order of the key bar and of the help."""
    about: str = ""
    """Its content in a few words, for docs/screens; empty for a screen that has no page."""
    digit: str = ""
    """The key that opens it from every screen; it then has a tab."""
    key: str = ""
    """The key that opens it, if it has no digit."""
    narrow: str = ""
    """Its name in the tabs of a narrow terminal."""
    tab: str = ""
    """The title of the screen whose tab is lit, for a page or a mode of it that has no digit."""
    screen: str = ""
    """Its class in `tui.screens`, as `package.module.Class`; a screen on a drive has one."""
    refusal: Callable[[DriveConsole], str] = lambda console: ""
    """Reason why it cannot be shown for a drive; empty if it can."""

    @property
    def name(self) -> str:
        """Its name in the code."""
        return self.title.lower()

    def create(self, console: DriveConsole) -> Screen[None]:
        """Import the screen, and create it on a drive."""
        module, _, name = self.screen.rpartition(".")
        made: Screen[None] = getattr(import_module(f"tui.screens.{module}"), name)(console)
        return made
