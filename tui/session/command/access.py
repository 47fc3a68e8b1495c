"""Steps that all commands share: read the conditions, write, wait for a state of the chart."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from tui.bus.api import Priority
from tui.drive.chart import state_codes, state_now
from tui.drive.command_blocked import blocked_reason
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    deciding_codes,
    interlock_codes,
    order_target,
    with_options,
)
from tui.drive.profile.schema import Chart, Order, OrderId, State
from tui.drive.values import hexadecimal
from tui.drive.words import raw_of_word
from tui.safety import STEP_TIME

from ..drive import DriveSession
from ..read.order_check import check_byte_order
from ..read.reader import Reader
from ..reading import Reading
from ..settings.write import Writer
from ..work import Permit
from .reference import Reference
from .unblock_hint import block_reason_text

NO_CHART = (
    "Drive Panel does not command this drive: the words that select its commands were not read."
)
STATE_POLL_INTERVAL = 0.05


class NotFollowed(OrderRefused):
    """A command was sent, but the drive did not reach its state."""


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

    async def wait_for(self, chart: Chart, goals: Collection[str]) -> State:
        """Read the state until it is one of the goals, for STEP_TIME at most; return the last."""
        end = self.session.clock.monotonic() + STEP_TIME
        state = await self.state(chart)
        while state.id not in goals and self.session.clock.monotonic() < end:
            await self.session.clock.sleep(STATE_POLL_INTERVAL)
            state = await self.state(chart)
        return state

    async def send(self, chart: Chart, order: Order) -> None:
        """Write the words of a command in their order."""
        parameter = order_target(self.session.profile, chart, order)
        for word in with_options(chart, order, self.raws):
            if parameter.code == chart.command:
                await self.write_command(chart, word, order.name)
            else:
                await self.write_parameter(parameter, raw_of_word(parameter, word), why=order.name)

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
