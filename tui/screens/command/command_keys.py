"""Keys that command the drive on the Monitor screen, and its options."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.widgets import OptionList

from tui.bus.errors import LineError
from tui.drive.fault_reset import no_fault, reset_codes, reset_follows
from tui.drive.hints import advice_now, codes_to_read
from tui.drive.orders import OrderRefused, chart_in_force
from tui.drive.profile.schema import CommandOption, FaultCode, OrderId
from tui.session.command.reference import no_place
from tui.session.starts.record import StartNotRecorded, StartOvertaken
from tui.session.work import Outcome
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain, entry

from ..dialogs.question import KeyQuestion, hint
from .control import Control, hindrance
from .teaching import PickWord, TeachKeys, words_to_teach

if TYPE_CHECKING:
    from ..dialogs.now import MotorStates

OPTION_HINT = hint(("Up, Down", "Choose"), ("y", "Write"), ("Esc or q", "Cancel"))


LIKELY_CAUSE = "{name}. Likely cause: {cause}."


class OptionsScreen(KeyQuestion[tuple[CommandOption, int] | None]):
    """A list of all choices; answers with the selected one for `y`, else with None."""

    BINDINGS: ClassVar = [Binding("y", "yes", show=False), Binding("o", "no", show=False)]

    def __init__(
        self,
        options: Sequence[CommandOption],
        raws: Mapping[str, int],
        now: MotorStates | None = None,
    ) -> None:
        super().__init__(now)
        self._choices = [
            (option, choice.bits, option_line(option, choice.bits, choice.name, raws))
            for option in options
            for choice in option.choices
        ]

    def dialog(self) -> ComposeResult:
        """The list and its keys."""
        with Vertical(id="dialog"):
            yield Plain("Command options", id="question")
            yield from self.now_lines()
            yield OptionList(
                *(entry(line, id=str(at)) for at, (_, _, line) in enumerate(self._choices)),
                id="choices",
                compact=True,
            )
            yield Plain(OPTION_HINT, id="hint")

    def on_option_list_option_selected(self) -> None:
        """Show which keys answer, as Enter writes nothing."""
        reported = Text().append("Press y or Esc.   ", ALARM)
        self.tell_keys(reported.append_text(OPTION_HINT))

    def action_yes(self) -> None:
        """Answer with the choice."""
        at = self.query_one(OptionList).highlighted
        if at is not None:
            option, bits, _ = self._choices[at]
            self.answer((option, bits))


def option_line(option: CommandOption, bits: int, name: str, raws: Mapping[str, int]) -> Text:
    """One choice, with a mark if it is the drive's present one."""
    raw = raws.get(option.parameter)
    held = raw is not None and raw & option.mask == bits
    text = Text(no_wrap=True)
    text.append(" ● " if held else " · ", STRONG if held else FAINT)
    text.append(f"{option.name:<18}", FAINT)
    text.append(f"{name:<16}", STRONG if held else PLAIN)
    text.append(f"{option.parameter}{'  at standstill' if option.stopped_only else ''}", FAINT)
    return text


SHOWN_DONE = 8.0
SHOWN_REFUSED = 20.0
"""Seconds for which the result of a command is shown."""
REMOVE_CAUSE = "Remove the cause first."


STOPS_THAT_ASK = {
    "freewheel": (
        "Coast to a stop?",
        "The output is switched off. Nothing brakes the motor; a hoist load falls.",
        "Coast",
    ),
    "dc-braking": (
        "Brake by direct current?",
        "Direct current heats the motor. It holds no load at standstill.",
        "Brake",
    ),
}
"""Question, consequence and label of yes, for stops that need no arming but ask first."""


class OrderKeys(TeachKeys):
    """Actions of the command keys; the commander does the work."""

    _requested: Outcome | None = None
    """The refusal that the last question was about."""

    def control(self, now: float) -> Control:
        """Return the state of this panel's control of the drive."""
        commander, raws = self.commander, self.session.image.raws
        outcome = commander.outcome
        if outcome is not None:
            shown = SHOWN_REFUSED if outcome.kind == "refused" else SHOWN_DONE
            outcome = outcome if now - outcome.time < shown else None
        return Control(
            armed_for=commander.armed_for,
            why_disarmed=self.session.arming.why_disarmed,
            outcome=outcome,
            hindrance=hindrance(self.session.profile, raws),
            offer=self._offer(),
            barred=self.session.arming.hindrance,
            lost=commander.given.lost_orders(),
        )

    def _offer(self) -> str:
        """A motor left running by an exited program, and the keys that stop it and take it over."""
        fleet = self.app.fleet
        text = fleet.left_behind(self.console) if fleet is not None else ""
        return f"{text} Space stops it, T takes it over." if text else ""

    def action_take_over(self) -> None:
        """Take over a motor left running by an exited program."""
        self._give(self.commander.take_over)

    def ask_unrecorded(self) -> None:
        """Ask once to run although the start cannot be recorded."""
        outcome, starts = self.commander.outcome, self.session.starts
        if outcome is None or outcome is self._requested or starts is None:
            return
        refused = isinstance(outcome.error, StartNotRecorded)
        if not refused or isinstance(outcome.error, StartOvertaken):
            return
        self._requested = outcome
        if (last := self.commander.last_run) is None:
            return
        order, reference = last

        def run(stamp: int) -> None:
            starts.unrecorded = True
            self.commander.run(order, reference, stamp)

        question, why = f"Run {order} without a record of the start?", str(outcome.error)
        self._ask(question, why, "Run", "Cancel", run, by_itself=True)

    def _refuse(self, text: str) -> None:
        self.commander.refuse(text)
        self.look()

    def action_reset(self) -> None:
        """Ask, then reset the fault; report if there is none."""
        profile, raws = self.session.profile, self.session.image.raws
        chart, latest = chart_in_force(profile, raws), self.console.latest
        if chart is not None and latest is not None and not latest.error:
            state = latest.state
            if nothing := no_fault(chart, state.id, state.kind, state.name):
                self._refuse(nothing)
                return
        if not self._require_armed():
            return
        follows = f"{REMOVE_CAUSE} {reset_follows(profile, raws, {})}"
        fault = latest.state.fault if latest is not None and not latest.error else None
        work = partial(self.commander.order, "reset")
        question = self._ask("Reset the fault?", follows, "Reset", "Cancel", work)

        async def look_at_inputs() -> None:
            try:
                found = await self.console.read(reset_codes(profile))
                now = {code: r.raw for code, r in found.items() if r.raw is not None}
                follows = reset_follows(profile, {**self.session.image.raws, **now}, now)
                question.tell_follows(f"{REMOVE_CAUSE} {follows}")
                cause = await self._likely_cause(fault)
            except LineError:
                return  # the question says that the inputs have not been read
            if cause:
                question.tell_follows(f"{cause} {REMOVE_CAUSE} {follows}")

        self.run_worker(look_at_inputs, exclusive=True, group="reset")  # type: ignore[arg-type]

    async def _likely_cause(self, fault: FaultCode | None) -> str:
        """Return the likeliest cause of a fault as a sentence; empty without help on it.

        Raises LineError.
        """
        profile = self.session.profile
        # away from the loop: the help is read from its file
        guide = await asyncio.to_thread(lambda: profile.guide)
        help_ = guide.fault(fault.raw if fault is not None else None)
        if help_ is None:
            return ""
        found = await self.console.read(codes_to_read(profile, help_))
        raws = {code: r.raw for code, r in found.items() if r.raw is not None}
        left = advice_now(profile, help_, {**self.session.image.raws, **raws}, present=True)
        name = f"{fault.code} {fault.name}" if fault is not None else help_.name
        return LIKELY_CAUSE.format(name=name, cause=left.probable[0]) if left.probable else ""

    def action_take_control(self) -> None:
        """Ask, then take control from the terminals."""
        if self._require_armed():
            follows = (
                "The stop of the terminals and the keypad will have no effect."
                " The drive must be locked."
            )
            work = partial(self.commander.order, "take-control")
            self._ask("Take control?", follows, "Take control", "Cancel", work)

    def action_step_reference(self, steps: int) -> None:
        """Raise or lower the reference by so many Hz; arrows that arrive together step once."""
        stroke = self.app.stroke
        if stroke is None or stroke.steps:
            self._give(lambda: self.commander.step(Decimal(steps)))

    def action_hand_back(self) -> None:
        """Ask, then return control to the terminals."""
        if self._require_armed():
            follows = (
                "This does not stop the motor. Command and reference go back to the terminals or"
                " the keypad. A run command active there starts the motor."
            )
            work = partial(self.commander.order, "hand-back")
            self._ask("Return control?", follows, "Return control", "Cancel", work)

    def action_stop_as(self, id: OrderId) -> None:
        """Stop the drive by another kind of stop than on its ramp; needs no arming."""
        self.app.stop_drive(self.console, id)
        self.look()

    def action_ask_stop_as(self, id: OrderId) -> None:
        """Ask, then let the motor coast or brake it; needs no arming."""
        charts = self.session.profile.data.charts
        if not any(order.id == id for chart in charts for order in chart.orders):
            name = {"freewheel": "let the motor coast", "dc-braking": "brake by direct current"}
            self._refuse(f"{self.session.profile.name} has no command to {name[id]}.")
            return
        question, follows, yes = STOPS_THAT_ASK[id]
        stop = partial(self.app.stop_drive, self.console, id)
        self._ask(question, follows, yes, "Cancel", lambda _stamp: stop())

    def action_teach(self) -> None:
        """Choose a raw value, and learn its scale from the drive's display."""
        profile = self.session.profile
        watched = [value.parameter for value in profile.data.monitoring.values]
        codes = words_to_teach(profile, watched)
        if not codes:
            self._refuse("No value here needs a learned scale: documents give all scales.")
            return

        def chosen(code: str | None) -> None:
            if code is not None:
                self.ask_look(code)

        self.app.push_screen(PickWord(self.console, codes, self.motor_state_text()), chosen)

    def action_reference_by(self) -> None:
        """Ask, then set the reference through a learned preset, or end that."""
        if code := self.teacher.reference:
            self.ask_no_reference(code)
        elif code := self.teacher.proposal():
            self.ask_reference(code)
        elif self.session.profile.data.teachable_references:
            self._refuse(no_place(self.session.profile, "Hz"))
        else:
            self._refuse(f"{self.session.profile.name} needs no learned scale for its reference.")

    def action_options(self) -> None:
        """Choose a ramp, a preset speed, a motor or an output."""

        if not self._require_armed():
            return
        raws = self.session.image.raws
        chart = chart_in_force(self.session.profile, raws)
        if chart is None or not chart.options:
            self._refuse("This drive has no command options.")
            return

        stamp = self.session.work.stops

        def chosen(choice: tuple[CommandOption, int] | None) -> None:
            if choice is not None:
                self._give(lambda: self.commander.choose_option(*choice, stamp))

        self.app.push_screen(OptionsScreen(chart.options, raws, self.motor_state_text()), chosen)

    def _give(self, order: Callable[[], object]) -> None:
        try:
            order()
        except OrderRefused as refused:
            self.commander.refuse(str(refused))
        self.look()
