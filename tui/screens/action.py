"""What an action of the panel is, and the names of the screens."""

from __future__ import annotations

from dataclasses import dataclass

CONNECTION, MONITOR, FRAMES = "connection", "monitor", "frames"
SOURCES, FAULTS, PARAMETERS = "control source", "faults", "parameters"
BLOCKS = "blocks"
EVERYWHERE = (CONNECTION, MONITOR, FRAMES, SOURCES, FAULTS, PARAMETERS, BLOCKS)


@dataclass(frozen=True, slots=True)
class Action:
    """One thing a person can do."""

    id: str
    """Name of the method, with its arguments as Textual writes them."""
    keys: str
    """Keys as Textual names them, separated by commas; none where a widget takes the key."""
    shown: str
    """The key as a person reads it."""
    label: str
    """One or two words for the line of keys."""
    help: str
    """A sentence for the help screen and the palette."""
    screens: tuple[str, ...] = EVERYWHERE
    app: bool = False
    """True for an action of the app, False for one of the screen."""
    line: bool = True
    """Whether it stands in the line of keys."""
    both: str = ""
    """What the line of keys shows where one entry stands for a pair of keys."""
    first: bool = False
    """Whether the key counts before any widget that has the focus."""
