"""What the motors do now, for the question that is asked about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from tui.widgets.palette import FAINT

if TYPE_CHECKING:
    from tui.screens.panel import Panel
    from tui.session.console import DriveConsole

MOST = 4
"""Drives that are told of; more are counted."""


class MotorsNow:
    """Tells in a line a drive what its motor does, as known at the moment of the call."""

    def __init__(self, app: Panel, consoles: Sequence[DriveConsole]) -> None:
        self._app, self._consoles = app, list(consoles)

    @property
    def devices(self) -> frozenset[int]:
        """The drives that the question is about."""
        return frozenset(console.device for console in self._consoles)

    def __call__(self) -> Text:
        """The lines as they are now; where there are several drives, with their addresses."""
        # here: the app's first picture needs none of what tells the state of a drive
        from tui.widgets.motor_now import motor_now

        looks = self._app.fleet.keeper.looks if self._app.fleet else {}
        now = self._app.clock.monotonic()
        text = Text()
        for console in self._consoles[:MOST]:
            monitor, profile = console.monitor, console.session.profile
            which = f"Now {console.device:<3} " if len(self._consoles) > 1 else "Now  "
            text.append(which if not text else f"\n{which}", FAINT)
            look = looks.get(console.device)
            text.append_text(motor_now(profile, monitor.latest, monitor.period, look, now))
        if (more := len(self._consoles) - MOST) > 0:
            text.append(f"\nand {more} more", FAINT)
        return text
