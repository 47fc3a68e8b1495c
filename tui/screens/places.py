"""The way from any screen to any other, over Connection and Monitor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .action import BLOCKS, CONNECTION, FAULTS, FRAMES, MONITOR, PARAMETERS, SOURCES

if TYPE_CHECKING:
    from .panel import Panel

FROM_MONITOR = {
    PARAMETERS: "parameters",
    BLOCKS: "blocks",
    FAULTS: "faults",
    FRAMES: "frames",
    SOURCES: "control_source",
}
"""The action of Monitor that leads to a screen."""
PLACE_OF = {action: screen for screen, action in FROM_MONITOR.items()}
"""The screen to which an action of Monitor leads."""


def place(app: Panel) -> str:
    """The name of the screen on top, as the table of actions has it."""
    return (app.screen.TITLE or CONNECTION).lower()


def go_to(app: Panel, screen: str) -> None:
    """Go to a screen; from Connection to Monitor of the chosen drive, whatever lies behind it."""
    if place(app) == screen:
        return
    if place(app) == CONNECTION:
        app.screen.action_watch_chosen()  # type: ignore[attr-defined]
        return
    while place(app) not in (MONITOR, CONNECTION) or (
        screen == CONNECTION and place(app) == MONITOR
    ):
        app.pop_screen()
    if screen in FROM_MONITOR:
        getattr(app.screen, f"action_{FROM_MONITOR[screen]}")()
