"""Arming on every screen that gives orders to a drive or writes to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.drive.orders import OrderRefused
from tui.drive.profile.profile import proof_text
from tui.session.command.commander import Commander
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.work import Outcome

from ..base import PanelScreen

if TYPE_CHECKING:
    from tui.bus.program import Program

    from ..dialogs.confirm import Confirm
    from ..dialogs.now import MotorStates

NOT_ARMED = "Not armed. Press a to arm this drive."
ARMED_AFTER_ALL = "Armed for 60 s. Each key press restarts the 60 s."
"""Replaces the message that it is not, which would then be untrue."""


class ArmingKeys(PanelScreen):
    """Knows whether the drive is armed; the screen decides where a refusal is shown."""

    console: DriveConsole
    session: DriveSession
    passed: Outcome | None = None
    """Result of work at the time of a key that continued from it: no longer shown."""

    @property
    def commander(self) -> Commander:
        """Commander of this drive."""
        return self.console.commander

    def _refuse(self, text: str) -> None:
        """Show on this screen why something was not done."""
        raise NotImplementedError

    def motor_state_text(self) -> MotorStates:
        """Return the motor's present state, for a question about this drive."""
        from ..dialogs.now import MotorStates

        return MotorStates(self.app, [self.session])

    def _ask(
        self,
        question: str,
        follows: str,
        yes: str,
        no: str,
        work: Callable[[int], object],
        refused: Callable[[], object] = lambda: None,
        *,
        by_itself: bool = False,
    ) -> Confirm:
        """Ask for `y` before something is written or moved; refusals are shown on this screen.

        `work` gets the drive's stop count from the time of the question: a later stop cancels it.
        `refused` is called for a no. `by_itself`: no key opened the question.
        """
        from ..dialogs.confirm import Confirm

        stamp = self.session.work.stops

        def reported(sure: bool | None) -> None:
            try:
                if sure:
                    work(stamp)
                else:
                    refused()
            except OrderRefused as refusal:
                self._refuse(str(refusal))
            self.look()

        now = self.motor_state_text()
        requested = Confirm(
            question, follows, yes=yes, no=no, loses=True, now=now, by_itself=by_itself
        )
        self.app.push_screen(requested, reported)
        return requested

    def _armed(self) -> bool:
        return self.commander.armed_for is not None

    def _require_armed(self) -> bool:
        """Return True if the drive is armed; otherwise report how to arm it."""
        if not self._armed():
            self._refuse(self.session.arming.hindrance or self._how_to_arm())
        return self._armed()

    def _is_unproved(self) -> bool:
        return self.session.is_unconfirmed and not self.session.contradiction

    def _may_write(self) -> bool:
        """Return True if settings may be written; else report how to arm, or have a person confirm
        a profile of which only the commands are proved."""
        if not self._require_armed():
            return False
        if self._is_unproved():
            self._confirm_profile()
            return False
        return True

    def _how_to_arm(self) -> str:
        other = self.session.line.facts.commander(self.session.device)
        if other is None:
            return NOT_ARMED
        return f"Not armed: {other.text} commands this drive. Press a to request it."

    def how_to_write(self, what: str) -> str:
        """The keys that write staged values now; or why writing is not possible."""
        if why := self.session.arming.hindrance:
            return why
        if self._armed():
            return f"Press w to write {what}."
        return f"Press a to arm, then w to write {what}."

    def action_arm(self) -> None:
        """Arm the drive for 60 s, or restart the 60 s.

        If another program commands it, ask to request the drive instead.
        """
        if (other := self.session.line.facts.commander(self.session.device)) is not None:
            self._ask_for(other)
            return
        if self._is_unproved():
            opened, barred = self.app.opened, self.session.arming.barred
            if opened is None or opened.simulation is None or opened.line is not self.session.line:
                if barred:
                    self._confirm_profile()
                    return
            else:
                self.session.confirm_profile()
        stamp, stroke = self.session.work.stops, self.app.stroke
        if stroke is not None and stroke.stamp != self.app.stop_stamp():
            return  # a stop came while the key went through the screen
        try:
            self.commander.arm(stamp=stamp)
        except OrderRefused as refused:
            self._refuse(str(refused))
        newest = self.app.events.newest
        if self._armed() and newest is not None and newest.text == NOT_ARMED:
            self.app.tell(ARMED_AFTER_ALL)
        self.look()

    def _confirm_profile(self) -> None:
        """Ask, then allow arming by an unproved profile; the drive stays disarmed."""
        profile = self.session.profile

        def confirm(_stamp: int) -> None:
            self.session.confirm_profile()
            next_step = "" if self._armed() else f" {NOT_ARMED}"
            self.app.tell(f"Confirmed until this program ends.{next_step}")

        self._ask(
            f"Write to drive {self.session.device} by the unproved profile {profile.id}?",
            f"It is written from public documents, and {proof_text(profile)}. A wrong word may"
            " start the motor. Try it first without a motor.",
            "Confirm",
            "Cancel",
            confirm,
        )

    def _ask_for(self, other: Program) -> None:
        """Ask, then request the drive from the program that commands it."""
        fleet, device = self.app.fleet, self.session.device
        if fleet is None:
            return

        def ask(_stamp: int) -> None:
            fleet.handover.ask_for(device)

        self._ask(
            f"Request drive {device}?",
            f"{other.text} commands it and must agree. No answer means no while the motor runs.",
            "Request",
            "Cancel",
            ask,
        )

    def action_answer_request(self) -> None:
        """Answer a program that requests this drive."""
        fleet, device = self.app.fleet, self.session.device
        request = fleet.handover.requests.get(device) if fleet is not None else None
        if fleet is None or request is None:
            self._refuse("No program requests this drive.")
            return

        def give(_stamp: int) -> None:
            fleet.handover.answer(request, yes=True)

        self._ask(
            f"Hand drive {device} over?",
            f"{request.program.text} requests it and will command it. The motor continues"
            " unchanged.",
            "Hand over",
            "Cancel",
            give,
            refused=lambda: fleet.handover.answer(request, yes=False),
        )

    def action_disarm(self) -> None:
        """Disarm the drive."""
        self.session.arming.disarm()
        self.look()
