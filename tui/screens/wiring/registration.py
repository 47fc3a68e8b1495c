"""Registration of Wiring: what the panel lists, and the keys."""

from __future__ import annotations

from ..keys.action import Registration, key_rows

REGISTERED = (
    Registration(
        title="Wiring",
        about="pins, line rules, warnings and errata of the family",
        key="I",
        screen="wiring.screen.WiringScreen",
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
