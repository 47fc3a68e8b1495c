"""Registration of Messages: what the panel lists, and the keys."""

from __future__ import annotations

from ..keys.action import Registration, key_rows

REGISTERED = (
    Registration(
        title="Messages",
        about="all messages, with their times",
        key="m",
        actions=key_rows(
            ("scroll(-1)", "up", "", "Show newer messages."),
            ("scroll(1)", "down", "older", "Show older messages."),
            ("scroll(-10)", "pageup", "", "Go to newer messages, ten lines."),
            ("scroll(10)", "pagedown", "", "Go to older messages, ten lines."),
            ("leave", "escape", "back", "Go back."),
        ),
    ),
)
