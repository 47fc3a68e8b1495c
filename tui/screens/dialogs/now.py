"""Present state of the motors, for a question about them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from rich.text import Text

from tui.widgets.palette import FAINT

from ..state_words import state_words

if TYPE_CHECKING:
    from tui.screens.app_port import Panel
    from tui.session.drive import DriveSession

DRIVES_NAMED = 4
"""Drives that have a line; more are counted."""


class MotorStates:
    """Makes one line per drive with the state of its motor at the time of the call."""

    def __init__(self, app: Panel, sessions: Sequence[DriveSession]) -> None:
        self._app, self._sessions = app, list(sessions)

    @property
    def devices(self) -> frozenset[int]:
        """The drives that the question is about."""
        return frozenset(session.device for session in self._sessions)

    def __call__(self) -> Text:
        """The present lines; with addresses if there are several drives."""
        # imported here, as the app's first picture does not need it
        from tui.widgets.motor_state_text import motor_state_text

        text = Text()
        for session in self._sessions[:DRIVES_NAMED]:
            # a line that is not shown may have a drive of this address, too
            fleet = next((item for item in self._app.fleets if session in item.sessions), None)
            looks, now = fleet.line_watch.looks if fleet else {}, session.clock.monotonic()
            console = fleet.console(session.device) if fleet else None
            which = f"Now {session.device:<3} " if len(self._sessions) > 1 else "Now  "
            text.append(which if not text else f"\n{which}", FAINT)
            look = looks.get(session.device)
            latest = console.latest if console else None
            period = console.monitor.period if console else 0.0
            words = partial(state_words, session)
            profile = session.profile
            text.append_text(motor_state_text(profile, latest, period, look, now, words))
        if (more := len(self._sessions) - DRIVES_NAMED) > 0:
            text.append(f"\nand {more} more", FAINT)
        return text
