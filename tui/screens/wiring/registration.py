"""Registration of Wiring: what the panel lists, and the keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..keys.action import Registration, key_rows

if TYPE_CHECKING:
    from textual.screen import Screen

    from tui.session.console import DriveConsole


def create_wiring(console: DriveConsole) -> Screen[None]:
    """Create the screen on a drive."""
    from .screen import WiringScreen

    return WiringScreen(console)


REGISTERED = (
    Registration(
        title="Wiring",
        about="pins, line rules, warnings and errata of the family",
        key="I",
        create=create_wiring,
        actions=key_rows(
            ("scroll(-1)", "up", "", "Scroll up one line."),
            ("scroll(1)", "down", "scroll", "Scroll down one line."),
            ("page(-1)", "pageup", "", "Scroll up one page."),
            ("page(1)", "pagedown", "", "Scroll down one page."),
            ("section(1)", "tab", "next", "Go to the next section."),
            ("section(-1)", "shift+tab", "", "Go to the previous section."),
            ("leave", "escape", "back", "Go back."),
        ),
    ),
)
