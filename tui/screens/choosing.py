"""What becomes of an action that was chosen in the palette."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .base import PanelScreen
from .dialogs.palette import Palette
from .places import PLACE_OF, go_to, place

if TYPE_CHECKING:
    from .finding import Found
    from .panel import Panel


def open_palette(app: Panel) -> None:
    """Ask for an action, and do it; one of another screen is shown where it lives."""
    below = app.screen
    if not isinstance(below, PanelScreen):
        return  # a question, or the help: it ends by its own keys

    def chosen(found: Found | None) -> None:
        if found is None or app.screen is not below:
            return
        if found.here:
            app.call_later(app.run_action, found.action.id, app if found.action.app else below)
        elif found.action.id in PLACE_OF:
            go_to(app, PLACE_OF[found.action.id])
        else:
            go_to(app, found.screen)
            app.notify(f"{found.name}: {found.action.shown} on {found.screen.capitalize()}.")

    app.push_screen(Palette(place(app)), chosen)
