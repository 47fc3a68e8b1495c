"""Registration of Start-up: what the panel lists, and the keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..keys.action import Registration, key_rows

if TYPE_CHECKING:
    from tui.session.console import DriveConsole


def no_start_up(console: DriveConsole) -> str:
    """Return why a drive has no start-up; empty if it can have one."""
    from tui.session.record.replay_line import ReplayLine

    return "A replay has no start-up." if isinstance(console.session.line, ReplayLine) else ""


REGISTERED = (
    Registration(
        title="Start-up",
        about="the steps of a commissioning, with their results",
        key="B",
        screen="startup.screen.StartUpScreen",
        refusal=no_start_up,
        actions=key_rows(
            ("open", "enter", "open", "Do what the row says: record, or go where it is done."),
            ("move(-1)", "up", "", "Go to the previous row."),
            ("move(1)", "down", "", "Go to the next row."),
            ("section(1)", "tab", "next", "Go to the next step."),
            ("section(-1)", "shift+tab", "", "Go to the previous step."),
            ("begin_again", "", "", "Begin again, for another drive. Asks first."),
            ("leave", "escape", "back", "Go back."),
        ),
    ),
)
