"""Common steps of every command: read its conditions, write as long as permitted."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from tui.bus.api import Priority
from tui.drive.chart import state_codes, state_now
from tui.drive.command_blocked import held_back
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    deciding_codes,
    interlock_codes,
    order_target,
    with_options,
)
from tui.drive.profile.schema import Chart, Order, OrderId, State
from tui.drive.values import from_words
from tui.safety import STEP_TIME

from ..drive import DriveSession
from ..read.order_check import check_byte_order
from ..read.reader import Reader
from ..reading import Reading
from ..settings.write import Writer
from ..work import Permit
from .reference import Reference
from .unblock_hint import block_reason_text

STATE_POLL_INTERVAL = 0.05


class NotFollowed(OrderRefused):
    """A command that was sent, and whose state the drive did not reach."""


@dataclass(frozen=True, slots=True)
class CommandAccess(Writer):
    """Reads and writes of one command, as long as its permit holds."""

    permit: Permit
    given: CommandHistory

    @property
    def raws(self) -> Mapping[str, int]:
        """Raw values as last read."""
        return self.session.image.raws

    async def read(self, codes: list[str]) -> Mapping[str, Reading]:
        """Readings by code, as a person's request."""
        reader = Reader(self.session)
        if self.session.byte_order.is_suspect:
            await check_byte_order(reader, Priority.OPERATOR_READ)
        return await reader.read(codes, priority=Priority.OPERATOR_READ)

    async def chart(self, wanted: OrderId | None = None) -> Chart:
        """The chart in force, with every word read again that a command depends on.

        Raises OrderRefused where the drive is not commanded from here, or an interlock speaks
        against the wanted command.
        """
        session = self.session
        codes = deciding_codes(session.profile)
        for chart in session.profile.data.charts:
            codes += [*state_codes(session.profile, chart), chart.command, *interlock_codes(chart)]
        await self.read([code for code in dict.fromkeys(codes) if code])
        found = chart_in_force(session.profile, self.raws)
        if found is None or not found.orders:
            name = found.name if found else "what decides about its commands was not read"
            raise OrderRefused(f"Drive Panel does not command this drive: {name}.")
        held = held_back(session.profile, found, wanted, self.raws) if wanted is not None else None
        if held is not None:
            raise OrderRefused(block_reason_text(held))
        return found

    async def state(self, chart: Chart) -> State:
        """The drive's state, read now with the word of its present fault."""
        await self.read(state_codes(self.session.profile, chart))
        return state_now(self.session.profile, chart, self.raws)

    async def wait_for(self, chart: Chart, goals: Collection[str]) -> State:
        """The state, as soon as it is one of those, or when its time is up."""
        end = self.session.clock.monotonic() + STEP_TIME
        state = await self.state(chart)
        while state.id not in goals and self.session.clock.monotonic() < end:
            await self.session.clock.sleep(STATE_POLL_INTERVAL)
            state = await self.state(chart)
        return state

    async def send(self, chart: Chart, order: Order) -> None:
        """Write the words of a command, one after another."""
        parameter = order_target(self.session.profile, chart, order)
        for word in with_options(chart, order, self.raws):
            if parameter.code == chart.command:
                await self.write_command(chart, word, order.name)
            else:
                await self.write_parameter(parameter, from_words(parameter, [word]), why=order.name)

    async def write_command(self, chart: Chart, word: int, why: str) -> None:
        """Write a command word; it is watched from then on."""
        parameter = self.session.profile[chart.command]
        # the state of the drive tells whether it was taken; the word itself is kept on record
        await self.write_parameter(parameter, from_words(parameter, [word]), why=why, check=0)
        self.session.note_command()
        self.given.note_command(parameter.code, word)


class CommandHistory:
    """State kept from one command to the next."""

    def __init__(self, session: DriveSession) -> None:
        self._session = session
        self.wanted: Reference | None = None
        """The reference that was given last; None after the drive has reset it."""
        self.reference_text = ""
        """The result of the last reference that was given, for a person."""
        self._written: dict[str, int] = {}
        self._written_under = 0
        """The count of stops under which they were written."""

    def note_reference(self, reference: Reference, text: str) -> None:
        """A reference was given; `text` is the result, for a person."""
        self.wanted, self.reference_text = reference, text

    def forget_reference(self) -> None:
        """The drive has put it back: nothing may send it again."""
        self.wanted = None

    def note_command(self, code: str, word: int) -> None:
        """A command word was written: it is watched from now on."""
        self._written, self._written_under = {code: word}, self._session.work.stops
        self._session.followed = (code,)

    def note_option(self, code: str, word: int) -> None:
        """Option bits of a command word were written."""
        if code in self._written:
            self._written[code] = word

    def forget_words(self) -> None:
        """Others command the drive now: words of another channel say nothing any more."""
        self._written = {}

    def lost_orders(self) -> str:
        """Return the values written by this program that the drive no longer holds, or nothing.

        Nothing behind a stop from here, which wrote another word itself.
        """
        if self._written_under != self._session.work.stops:
            return ""
        lost = self.changed_words()
        return f"Reset, switched off or commanded by others: {lost}." if lost else ""

    def changed_words(self) -> str:
        """The command words that the drive holds otherwise than they were written from here."""
        known = self._session.image.raws
        return ", ".join(
            f"{code} 16#{raw:04X} is now 16#{known[code] & 0xFFFF:04X}"
            for code, raw in self._written.items()
            if code in known and known[code] & 0xFFFF != raw
        )
