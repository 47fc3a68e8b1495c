"""Execution of an action that was chosen in the palette."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .base import PanelScreen
from .dialogs.palette import Palette

if TYPE_CHECKING:
    from .app_port import Panel
    from .keys.finding import FoundAction


def open_palette(app: Panel) -> None:
    """Ask for an action, and do it; one of another screen is shown where it lives."""
    below = app.screen
    if not isinstance(below, PanelScreen):
        return  # a question, or the help: it ends by its own keys

    def chosen(found: FoundAction | None) -> None:
        if found is None or app.screen is not below:
            return
        if found.here:
            app.call_later(app.run_action, found.action.id, app if found.action.app else below)
        else:
            app.action_goto(found.screen)
            key = found.action.shown or "^p"  # what has no key is chosen there once more
            app.tell(f"{found.name}: {key} on {found.screen.capitalize()}.")

    app.push_screen(Palette(app.place), chosen)
