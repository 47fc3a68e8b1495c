"""Keys that command the drive on the Monitor screen."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal

from tui.drive.errors import ValueRefused
from tui.drive.orders import OrderRefused, chart_in_force, interlock
from tui.drive.schema import CommandOption, OrderId
from tui.session.reference import parse_reference
from tui.session.work import Outcome
from tui.widgets.monitor_view import Control

from .arming import Arming

SHOWN = 8.0
SHOWN_REFUSED = 20.0
"""Seconds for which it is shown what became of an order."""


class OrderKeys(Arming):
    """The actions of the keys; everything else is the commander's."""

    _asked: Outcome | None = None
    """The refusal that a person was asked about last."""

    def control(self, now: float) -> Control:
        """Whether and how the drive is commanded from here, for the screen."""
        commander, raws = self.commander, self.session.image.raws
        chart = chart_in_force(self.session.profile, raws)
        outcome = commander.outcome
        if outcome is not None:
            shown = SHOWN_REFUSED if outcome.kind == "refused" else SHOWN
            outcome = outcome if now - outcome.time < shown else None
        return Control(
            armed_for=commander.armed_for,
            why_disarmed=self.session.arming.why_disarmed,
            outcome=outcome,
            no_effect=interlock(chart, "forward", raws) if chart else "",
            offer=self._offer(),
            lost=commander.lost_orders(),
        )

    def _offer(self) -> str:
        """A motor that runs by a command of an earlier program, and the key that takes it over."""
        starts, latest = self.session.starts, self.console.latest
        if starts is None or latest is None or latest.error:
            return ""
        said = starts.offered(self.session, runs=latest.state.kind == "running")
        return f"{said[0].upper()}{said[1:]}. T takes over." if said else ""

    def action_take_over(self) -> None:
        """Look after a motor that an earlier program has started."""
        self._give(self.commander.take_over)

    def ask_unrecorded(self) -> None:
        """Where a start could not be put on record, ask once whether to run all the same."""
        from tui.session.starts import StartNotRecorded, StartOvertaken

        outcome, starts = self.commander.outcome, self.session.starts
        if outcome is None or outcome is self._asked or starts is None:
            return
        refused = isinstance(outcome.error, StartNotRecorded)
        if not refused or isinstance(outcome.error, StartOvertaken):
            return
        self._asked = outcome
        order = self.commander.last_order
        if order not in ("forward", "reverse"):
            return
        from .dialogs.confirm import Confirm

        def told(sure: bool | None) -> None:
            if sure:
                starts.unrecorded = True
                self._give(lambda: self.commander.order(order))

        asked = Confirm(
            f"Run {order} unrecorded?",
            str(outcome.error),
            yes="runs it without a record",
            no="does not run it",
            loses=True,
            now=self.motor_now(),
        )
        self.app.push_screen(asked, told)

    def _refuse(self, text: str) -> None:
        self.commander.refuse(text)
        self.look()

    def action_order(self, id: OrderId) -> None:
        """Give an order to the drive."""
        self._give(lambda: self.commander.order(id))

    def action_step_reference(self, steps: int) -> None:
        """Raise or lower the reference by so many Hz."""
        self._give(lambda: self.commander.step(Decimal(steps)))

    def action_hand_back(self) -> None:
        """Give the control back, after saying what may start then."""
        from .dialogs.confirm import Confirm

        def told(sure: bool | None) -> None:
            if sure:
                self._give(lambda: self.commander.order("hand-back"))

        follows = (
            "This is no stop. Command and reference go back to the terminals or the keypad:"
            " a run order that waits there starts the motor."
        )
        asked = Confirm(
            "Give the control back?",
            follows,
            yes="gives it back",
            no="keeps it",
            loses=True,
            now=self.motor_now(),
        )
        self.app.push_screen(asked, told)

    def action_stop_as(self, id: OrderId) -> None:
        """Stop the drive in another way than on its ramp; needs no arming."""
        self.app.stop_drive(self.console, id)
        self.look()

    def action_reference(self) -> None:
        """Type a reference."""
        from .dialogs.ask import Ask

        def given(text: str | None) -> None:
            if text:
                self._give(lambda: self.commander.refer(text))

        profile, latest = self.session.profile, self.console.latest
        about = "In Hz or rpm: 30, 30.5Hz, 900rpm.\nUp and Down on Monitor change it by 1 Hz."

        def wrong(text: str) -> str:
            try:
                parse_reference(profile, text, latest.readings if latest else {})
            except ValueRefused as refused:
                return str(refused)
            return ""

        if self._armed_or_told():
            asked = Ask(
                "Reference",
                wrong,
                about=about,
                takes="writes it",
                number=True,
                now=self.motor_now(),
            )
            self.app.push_screen(asked, given)

    def action_options(self) -> None:
        """Choose a ramp, a preset speed, a motor, an output."""
        from .dialogs.options import OptionsScreen

        raws = self.session.image.raws
        chart = chart_in_force(self.session.profile, raws)
        if chart is None or not chart.options:
            self._refuse("This drive has no options of its commands.")
            return

        def chosen(choice: tuple[CommandOption, int] | None) -> None:
            if choice is not None:
                self._give(lambda: self.commander.choose_option(*choice))

        self.app.push_screen(OptionsScreen(chart.options, raws, self.motor_now()), chosen)

    def _give(self, order: Callable[[], None]) -> None:
        try:
            order()
        except OrderRefused as refused:
            self.commander.refuse(str(refused))
        self.look()
