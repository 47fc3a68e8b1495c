"""Arming on every screen that gives orders to a drive or writes to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.drive.orders import OrderRefused
from tui.session.command.commander import Commander
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.work import Outcome

from ..base import PanelScreen

if TYPE_CHECKING:
    from ..dialogs.now import MotorsNow

NOT_ARMED = "Not armed: a arms this drive."


class ArmingKeys(PanelScreen):
    """Knows whether the drive is armed; where a refusal is told is up to the screen."""

    console: DriveConsole
    session: DriveSession
    passed: Outcome | None = None
    """What work had come to when a key led on from it: no longer shown."""

    @property
    def commander(self) -> Commander:
        """What arms and commands this drive."""
        return self.console.commander

    def _refuse(self, text: str) -> None:
        """Tell on this screen why something was not done."""
        raise NotImplementedError

    def motor_now(self) -> MotorsNow:
        """What the motor does now, for a question about this drive."""
        from ..dialogs.now import MotorsNow

        return MotorsNow(self.app, [self.session])

    def _ask(
        self, question: str, follows: str, yes: str, no: str, work: Callable[[int], object]
    ) -> None:
        """Ask with `y` before something is written or moved; refusals are told on this screen.

        `work` gets the drive's count of stops of the moment of asking: a stop since voids it.
        """
        from ..dialogs.confirm import Confirm

        stamp = self.session.work.stops

        def told(sure: bool | None) -> None:
            try:
                if sure:
                    work(stamp)
            except OrderRefused as refused:
                self._refuse(str(refused))
            self.look()

        now = self.motor_now()
        asked = Confirm(question, follows, yes=yes, no=no, loses=True, now=now)
        self.app.push_screen(asked, told)

    def _armed(self) -> bool:
        return self.commander.armed_for is not None

    def _armed_or_told(self) -> bool:
        """Whether the drive is armed; where it is not, that is told."""
        if not self._armed():
            self._refuse(NOT_ARMED)
        return self._armed()

    def action_arm(self) -> None:
        """Let commands and writes to this drive through for a minute, or for a minute more."""
        try:
            self.commander.arm()
        except OrderRefused as refused:
            self._refuse(str(refused))
        self.look()

    def action_disarm(self) -> None:
        """Let nothing through any more."""
        self.commander.disarm()
        self.look()
