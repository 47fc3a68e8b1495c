"""Steps that all commands share: read the conditions, write, wait for a state of the chart."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from tui.bus.api import Priority
from tui.bus.errors import DeviceException, ExchangeError, LineError
from tui.drive.chart import state_codes, state_now
from tui.drive.command_blocked import blocked_reason
from tui.drive.errors import DriveError
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    deciding_codes,
    interlock_codes,
    order_target,
    stop_in_any,
    with_options,
)
from tui.drive.profile.schema import Chart, Order, OrderId, OrderWait, State
from tui.drive.sentences import any_of, sentence
from tui.drive.values import hexadecimal
from tui.drive.words import raw_of_word
from tui.safety import STEP_TIME, STOP_TRIES

from ..drive import DriveSession
from ..read.order_check import check_byte_order
from ..read.reader import Reader
from ..reading import Reading
from ..settings.write import Writer
from ..work import OutcomeKind, Permit, Stopped
from .reference import Reference
from .unblock_hint import block_reason_text

NO_CHART = (
    "Drive Panel does not command this drive: the words that select its commands were not read."
)
STATE_POLL_INTERVAL = 0.05
LONG_WAIT = 1.0
"""Seconds from which a wait in a command is reported."""


NOT_STOPPED_AFTER: frozenset[OrderId] = frozenset({"hand-back"})
"""Commands that give the motor to another source: one that it runs must not stop.

Half of taking control is stopped: the line may have it, with an old run command in its word.
"""


class NotFollowed(OrderRefused):
    """A command was sent, but the drive did not reach its state."""


class HalfSent(NotFollowed):
    """A command of several words ended before its last one.

    `needs_stop` is False for a command that gives the motor to another source.
    """

    def __init__(self, text: str, *, needs_stop: bool) -> None:
        super().__init__(text)
        self.needs_stop = needs_stop


@dataclass(frozen=True, slots=True)
class CommandAccess(Writer):
    """Reads and writes of one command, as long as its permit holds."""

    permit: Permit
    given: CommandHistory

    @property
    def raws(self) -> Mapping[str, int]:
        """Last raw values by code, however old."""
        return self.session.image.raws

    async def read(self, codes: list[str]) -> Mapping[str, Reading]:
        """Read codes with the priority of an operator. Raises the line's errors."""
        reader = Reader(self.session)
        if self.session.byte_order.is_suspect:
            await check_byte_order(reader, Priority.OPERATOR_READ)
        profile = self.session.profile
        codes = [code for code in codes if profile[code].access != "w"]
        return await reader.read(codes, priority=Priority.OPERATOR_READ)

    async def chart(self, wanted: OrderId | None = None) -> Chart:
        """Read every word that a command depends on, and return the active chart.

        Raises OrderRefused if Drive Panel does not command this drive, or if an interlock
        blocks the wanted command.
        """
        session = self.session
        codes = deciding_codes(session.profile)
        for chart in session.profile.data.charts:
            codes += [*state_codes(session.profile, chart), chart.command, *interlock_codes(chart)]
        await self.read([code for code in dict.fromkeys(codes) if code])
        found = chart_in_force(session.profile, self.raws)
        if found is None or not found.orders:
            if found is None:
                raise OrderRefused(NO_CHART)
            raise OrderRefused(f"Drive Panel does not command this drive: {found.name}.")
        held = (
            blocked_reason(session.profile, found, wanted, self.raws)
            if wanted is not None
            else None
        )
        if held is not None:
            raise OrderRefused(block_reason_text(held))
        return found

    async def state(self, chart: Chart) -> State:
        """Read the drive's state, and its fault word if it has one."""
        await self.read(state_codes(self.session.profile, chart))
        return state_now(self.session.profile, chart, self.raws)

    async def wait_for(
        self, chart: Chart, goals: Collection[str], seconds: float = STEP_TIME
    ) -> State:
        """Read the state until it is one of the goals, for so long at most; return the last."""
        end = self.session.clock.monotonic() + seconds
        state = await self.state(chart)
        while state.id not in goals and self.session.clock.monotonic() < end:
            await self.session.clock.sleep(STATE_POLL_INTERVAL)
            state = await self.state(chart)
        return state

    async def send(self, chart: Chart, order: Order) -> None:
        """Write the words of a command in their order, with its waits.

        Raises HalfSent if a sequence ends after its first word: the drive was sent a stop then.
        """
        parameter, sent = order_target(self.session.profile, chart, order), 0
        try:
            for place, word in enumerate(with_options(chart, order, self.raws)):
                sent = place
                if parameter.code == chart.command:
                    await self.write_command(chart, word, order.name)
                else:
                    raw = raw_of_word(parameter, word)
                    await self.write_parameter(parameter, raw, why=order.name)
                sent = place + 1
                if place < len(order.waits):
                    await self._wait(chart, order, order.waits[place])
        except (LineError, DriveError) as error:
            # without a valid reply, the drive may have taken the word
            unsure = isinstance(error, ExchangeError) and not isinstance(error, DeviceException)
            if isinstance(error, Stopped) or not order.waits or not (sent or unsure):
                raise
            ended = f"{order.name} ended after word {max(sent, 1)} of {len(order.words)}."
            why = f"The next step failed: {sentence(str(error))}"
            parts = (ended, why, await self._stop_half(order))
            text, needs_stop = " ".join(filter(None, parts)), order.id not in NOT_STOPPED_AFTER
            raise HalfSent(text, needs_stop=needs_stop) from error

    async def _wait(self, chart: Chart, order: Order, wait: OrderWait) -> None:
        """Wait before the next word of a command. Raises NotFollowed, and the line's errors."""
        wanted = any_of([state.name for state in chart.states if state.id in wait.states])
        if wait.seconds >= LONG_WAIT:
            time = f"{wait.seconds:g} s"
            goal = f"for {wanted}, at most {time}" if wait.states else time
            self.session.work.report(OutcomeKind.WORKING, f"{order.name}: waiting {goal}")
        if not wait.states:
            await self.session.clock.sleep(wait.seconds)
            return
        state = await self.wait_for(chart, wait.states, wait.seconds)
        if state.id not in wait.states:
            raise NotFollowed(
                f"The drive did not reach {wanted} in {wait.seconds:g} s; it is in {state.name}."
            )

    async def _stop_half(self, order: Order) -> str:
        """Stop a drive after a half-sent command, armed or not; return the result as text."""
        if order.id in NOT_STOPPED_AFTER:
            return ""
        profile, writer = self.session.profile, Writer(self.session, self.journal, None)
        error: Exception | None = None
        for _ in range(STOP_TRIES):
            try:
                chart, stop = stop_in_any(profile, self.raws)
                target = order_target(profile, chart, stop)
                for word in with_options(chart, stop, self.raws):
                    raw, why = raw_of_word(target, word), f"{stop.name} after half of {order.name}"
                    await writer.write_parameter(
                        target, raw, why=why, priority=Priority.STOP, read_back=False
                    )
            except (LineError, DriveError) as failure:
                error = failure
            else:
                self.given.forget_words()
                return (
                    f"The drive was sent its stop ({stop.name}). Check that the motor has stopped."
                )
        return f"Its stop failed: {sentence(str(error))} The motor may run. Press Space."

    async def write_command(self, chart: Chart, word: int, why: str) -> None:
        """Write a command word, and poll it from then on."""
        parameter = self.session.profile[chart.command]
        # not compared: drives change their command word, and the state shows its effect
        await self.write_parameter(parameter, raw_of_word(parameter, word), why=why, check=0)
        self.session.note_command()
        self.given.note_command(parameter.code, word)


class CommandHistory:
    """Commands that this program has given to one drive: its reference and its command words."""

    def __init__(self, session: DriveSession) -> None:
        self._session = session
        self.wanted: Reference | None = None
        """The reference that was given last; None after the drive has reset it."""
        self.reference_text = ""
        """Result of the last reference, as shown to a person."""
        self._written: dict[str, int] = {}
        self._written_under = 0
        """Stop count of the drive when they were written."""

    def note_reference(self, reference: Reference, text: str) -> None:
        """Remember a reference; `text` is its result as shown to a person."""
        self.wanted, self.reference_text = reference, text

    def forget_reference(self) -> None:
        """Forget the reference after a reset by the drive, so that no start sends it again."""
        self.wanted = None

    def note_command(self, code: str, word: int) -> None:
        """Remember a command word that was written, and poll it from now on.

        A word that can only be written is neither polled nor compared.
        """
        readable = self._session.profile[code].access != "w"
        self._written = {code: word} if readable else {}
        self._written_under = self._session.work.stops
        self._session.followed = (code,) if readable else ()

    def note_option(self, code: str, word: int) -> None:
        """Remember a command word whose option bits were written."""
        if code in self._written:
            self._written[code] = word

    def forget_words(self) -> None:
        """Forget the words after a change of the control source: the drive ignores them now."""
        self._written = {}

    def lost_orders(self) -> str:
        """Describe command words that the drive no longer holds; empty if it holds them.

        Also empty after a stop by this program, which has written another word.
        """
        if self._written_under != self._session.work.stops:
            return ""
        lost = self.changed_words()
        return f"Reset, switched off or commanded by others: {lost}." if lost else ""

    def changed_words(self) -> str:
        """List command words that differ from the word that this program has written."""
        known, profile = self._session.image.raws, self._session.profile
        pairs = [
            (code, hexadecimal(profile[code], word), hexadecimal(profile[code], known[code]))
            for code, word in self._written.items()
            if code in known
        ]
        return ", ".join(f"{code} {own} is now {now}" for code, own, now in pairs if own != now)
