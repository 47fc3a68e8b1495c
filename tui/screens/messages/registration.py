"""Registration of Messages: what the panel lists, and the keys."""

from __future__ import annotations

from ..keys.action import Registration, key_rows

SINCE_HELP = "Show what changed since a time: writes, trips, runs and lost links."

REGISTERED = (
    Registration(
        title="Messages",
        about="all messages, with their times; what changed since a time",
        key="m",
        actions=key_rows(
            ("scroll(-1)", "up", "", "Show newer messages."),
            ("scroll(1)", "down", "older", "Show older messages."),
            ("scroll(-10)", "pageup", "", "Go to newer messages, ten lines."),
            ("scroll(10)", "pagedown", "", "Go to older messages, ten lines."),
            ("since", "J", "since", SINCE_HELP),
            ("leave", "escape", "back", "Go back."),
        ),
    ),
)
