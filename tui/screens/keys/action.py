"""Actions of the panel, and the names of the screens."""

from __future__ import annotations

from typing import NamedTuple

CONNECTION, MONITOR, FRAMES = "line", "monitor", "frames"
SOURCES, FAULTS, PARAMETERS = "control", "faults", "parameters"
BLOCKS, MESSAGES, WIRING = "scanner", "messages", "wiring"
OPENING = "opening"
"""Monitor while its drive is not known yet."""
LISTENING = "listening"
"""Frames of others, on a line on which nothing is sent."""
EVERYWHERE = (
    CONNECTION,
    MONITOR,
    FRAMES,
    SOURCES,
    FAULTS,
    PARAMETERS,
    BLOCKS,
    MESSAGES,
    WIRING,
    OPENING,
    LISTENING,
)

KEY_NAMES = {
    "escape": "Esc",
    "ctrl+p": "^p",
    "ctrl+l": "^l",
    "ctrl+s": "^s",
    "ctrl+o": "^o",
    "shift+tab": "Shift+Tab",
    "pageup": "PgUp",
    "pagedown": "PgDn",
}
"""Keys that a person reads otherwise than Textual writes them, capitals aside."""


class Action(NamedTuple):
    """One thing a person can do."""

    id: str
    """Name of the method, with its arguments as Textual writes them."""
    keys: str
    """Keys as Textual names them, separated by commas."""
    label: str
    """One or two words for the line of keys; none if it is not in the line."""
    help: str
    """A sentence for the help screen and the palette."""
    screens: tuple[str, ...] = EVERYWHERE
    app: bool = False
    """True for an action of the app, False for one of the screen."""
    first: bool = False
    """True if the key counts before any widget that has the focus."""
    bound: bool = True
    """False where the widget that has the focus takes the key."""

    @property
    def shown(self) -> str:
        """The first of its keys, as a person reads it."""
        key = self.keys.partition(",")[0]
        return KEY_NAMES.get(key, key.capitalize() if len(key) > 1 else key)


ActionRow = tuple[str, str, str, str]
"""An action as its table writes it: id, keys, label, help."""


def on(screens: tuple[str, ...], *rows: ActionRow) -> tuple[Action, ...]:
    """The actions of some screens, in the order of their rows."""
    return tuple(Action(*row, screens=screens) for row in rows)
