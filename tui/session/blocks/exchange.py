"""Writes through the outputs of a block or scanner, with the inputs in the same exchange.

Only the places from the first to the last named parameter are written. Their slots are read before
and after, and each parameter is read back.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from tui.bus.api import Priority
from tui.bus.errors import DeviceException, LineError, RequestRefused
from tui.drive.blocks.assignment import UNUSED, Assignment, describe, slot_target
from tui.drive.blocks.slot_rules import assignment_problems, refusing
from tui.drive.blocks.wire_cost import reach, span
from tui.drive.command_blocked import blocked_reason
from tui.drive.orders import chart_in_force, deciding_codes, interlock_codes
from tui.drive.profile.schema import Parameter
from tui.drive.settings.writable import AT_REST, is_order
from tui.drive.shown import depends_on
from tui.drive.values import check_raw, from_words, to_words

from ..drive import DriveSession, unproved_text
from ..journal import Entry, Journal
from ..read.retrying_reader import RetryingReader
from ..settings.write import CUT_SHORT, NotTaken, Writer, parameter_entry, raw_text
from ..starts.keeper import record_start
from ..work import Permit
from .write import AssignmentRefused


@dataclass(frozen=True, slots=True)
class Exchanged:
    """Result of one exchange: values written through the outputs, and the inputs."""

    outputs: dict[str, int]
    """Raw values by code, as they were written."""
    inputs: dict[str, int]
    """Raw values by code, of inputs whose slots are unchanged after the exchange."""


async def exchange(
    session: DriveSession,
    journal: Journal,
    outputs: Assignment,
    wanted: Mapping[str, int],
    inputs: Assignment | None = None,
    *,
    permit: Permit,
    in_force: bool = False,
) -> Exchanged:
    """Write through the output slots, and read the inputs in the same exchange by function 23.

    `wanted` are raw values by code; a slot between two named ones gets the current value of its
    parameter. Commands are checked by the same interlocks as a run command. `in_force` is a
    person's statement that the slots of an indirect block were set before the drive's last reset,
    which cannot be read; without it nothing is written through such a block. Raises
    AssignmentRefused, ValueRefused, RequestRefused, NotTaken, and the line's errors.
    """
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    if why := permit.refusal() or (unproved_text(session) if session.is_unconfirmed else ""):
        raise AssignmentRefused(f"{why} Nothing was written.")
    if outputs.block.effective == "after-reset" and not in_force:
        raise AssignmentRefused(
            f"Nothing was written: the mapping that {outputs.block.name} has had since"
            " the last reset cannot be read, and was not confirmed."
        )
    retrying = RetryingReader(session)
    checks = ExchangeChecks(session, retrying, outputs, inputs, wanted)
    checks.check_named()
    writer = Writer(session, journal, permit)
    work = _Exchange(session, writer, retrying, outputs, inputs, wanted, checks)
    return await work.carry_out(permit)


@dataclass(slots=True)
class _Exchange:
    session: DriveSession
    writer: Writer
    retrying: RetryingReader
    outputs: Assignment
    inputs: Assignment | None
    wanted: Mapping[str, int]
    checks: ExchangeChecks

    @property
    def targets(self) -> list[Parameter]:
        """Parameters of the written places, in their order."""
        return self.checks.targets

    async def carry_out(self, permit: Permit) -> Exchanged:
        await self.checks.check_slots("before")
        await self.checks.check_state()
        await self._read_scales()
        held = await self._held()
        raws = {p.code: self.wanted.get(p.code, held.get(p.code)) for p in self.targets}
        if unknown := [code for code, raw in raws.items() if raw is None]:
            raise AssignmentRefused(
                f"Nothing was written: the value of {', '.join(unknown)} is unknown. Enter a value"
                " for it as well."
            )
        known = {code: raw for code, raw in raws.items() if raw is not None}
        self.checks.check_values(known)
        permit.check()
        recorded = await self._record_start(permit)
        try:
            reply, back = await self._send(known, held)
        finally:
            # not earlier: if standstill is read before the frame is sent, the record would end
            if recorded and self.session.starts is not None:
                self.session.starts.sent(self.session)
        await self.checks.check_slots("after")
        self._see_taken(known, held, back)
        return Exchanged(known, self._read(reply))

    async def _record_start(self, permit: Permit) -> bool:
        """Record a start if a command word is among the outputs; return True if it is."""
        commands = {chart.command for chart in self.session.profile.data.charts}
        if commands.isdisjoint(parameter.code for parameter in self.targets):
            return False
        await record_start(self.session, "forward", permit)
        return True

    async def _read_scales(self) -> None:
        """Read the sources of scales and units: errors and the journal show engineering values."""
        sources = [code for parameter in self.targets for code in depends_on(parameter)]
        await self.retrying.ask_raws(dict.fromkeys(sources))

    async def _held(self) -> dict[str, int]:
        """Return the current outputs, with all targets of an indirect block."""
        codes = [p.code for p in self.targets]
        if self.outputs.block.effective == "after-reset":
            codes += [choice.parameter for choice in self.outputs.block.choices]
        profile = self.session.profile
        return await self.retrying.ask_raws(
            code for code in dict.fromkeys(codes) if profile[code].access != "w"
        )

    async def _send(
        self, raws: Mapping[str, int], held: Mapping[str, int]
    ) -> tuple[tuple[int, ...], dict[str, int]]:
        """Exchange the words, read the parameters back, and record both in the journal."""
        words = [to_words(parameter, raws[parameter.code])[0] for parameter in self.targets]
        answer, back, lost, sent = "ok", dict[str, int](), False, True
        refused = False
        image = self.session.image
        before = {p.code: image.get(p.code) for p in self.targets}
        for code in before:
            image.doubt(code)
        try:
            reply = await self._transmit(words)
            back = await self._held()
        except RequestRefused as error:
            answer, sent = str(error), False
            for code, held_before in before.items():
                image.believe(code, held_before)
            raise
        except LineError as error:
            refused = isinstance(error, DeviceException)
            answer, lost = str(error), not refused
            raise
        except asyncio.CancelledError:
            answer, lost = CUT_SHORT, True
            raise
        finally:
            self.session.note_command()
            for parameter in self.targets:
                entry = self._record(parameter, held, raws, answer, back)
                if refused:
                    entry = replace(entry, eeprom="")
                self.writer.journal.add(entry, sent=sent)
                if lost:
                    self.writer.complete_later(entry, parameter)
        return reply, back

    async def _transmit(self, words: list[int]) -> tuple[int, ...]:
        session, block = self.session, self.outputs.block
        address = block.address + self.checks.places.start
        read = span(self.inputs) if self.inputs is not None else None
        if read is None or session.profile.function(23) is None:
            await session.line.write(
                session.device, address, words, multiple=True, forbidden=self._forbidden
            )
            return ()
        both = await session.line.read_write(
            session.device,
            *read,
            address,
            words,
            priority=Priority.OPERATOR_WRITE,
            forbidden=self._forbidden,
        )
        return both.words

    def _see_taken(
        self, raws: Mapping[str, int], held: Mapping[str, int], back: Mapping[str, int]
    ) -> None:
        """Raise NotTaken if the drive holds another value than was written, or in another place."""
        profile = self.session.profile
        moved = [c for c in back if c not in raws and c in held and back[c] != held[c]]
        if moved:
            texts = [f"{c} changed to {self._text(profile[c], back[c])}" for c in moved]
            raise NotTaken(
                f"{self.outputs.block.name}: the mapping is not that of its slots, because"
                f" {', '.join(texts)}. Check the drive, and reset it before you try again."
            )
        if wrong := self._not_held(raws, back):
            texts = [
                f"{c} was written as {self._text(profile[c], raws[c])}, but the drive holds"
                f" {self._text(profile[c], back[c])}."
                for c in wrong
            ]
            raise NotTaken(" ".join(texts))

    def _not_held(self, raws: Mapping[str, int], back: Mapping[str, int]) -> list[str]:
        """Return named codes whose value differs; not commands, because the state shows their
        effect."""
        commands = {chart.command for chart in self.session.profile.data.charts}
        named = [code for code in self.wanted if code in back and code not in commands]
        return [code for code in named if back[code] != raws[code]]

    def _record(
        self,
        parameter: Parameter,
        held: Mapping[str, int],
        raws: Mapping[str, int],
        answer: str,
        back: Mapping[str, int],
    ) -> Entry:
        code = parameter.code
        if code in self._not_held(raws, back):
            answer = "holds another value"
        return parameter_entry(
            self.session,
            parameter,
            old=held.get(code),
            new=raws[code],
            answer=answer,
            why=f"through {self.outputs.block.name.lower()}",
            read_back=back.get(code),
        )

    def _text(self, parameter: Parameter, raw: int | None) -> str:
        return raw_text(self.session, parameter, raw)

    def _forbidden(self) -> str:
        """Return why the frame must not be sent any more; empty if it may."""
        return self.writer.permit.refusal() if self.writer.permit is not None else ""

    def _read(self, reply: tuple[int, ...]) -> dict[str, int]:
        found = {}
        unknown = self.session.profile.data.reading.unknown_word
        for raw, word in zip(self.inputs.raws if self.inputs else (), reply, strict=False):
            assert self.inputs is not None
            parameter = slot_target(self.session.profile, self.inputs.block, raw)
            if raw != UNUSED and parameter is not None and word != unknown:
                found[parameter.code] = from_words(parameter, [word])
        return found


@dataclass(slots=True)
class ExchangeChecks:
    """Checks of one exchange; each raises AssignmentRefused with the reason."""

    session: DriveSession
    retrying: RetryingReader
    outputs: Assignment
    inputs: Assignment | None
    wanted: Mapping[str, int]
    places: range = field(init=False)
    """The slots from the first to the last that a person names."""
    targets: list[Parameter] = field(init=False)
    """Parameters of the written places, in their order."""

    def __post_init__(self) -> None:
        profile, block = self.session.profile, self.outputs.block
        self.places = reach(profile, self.outputs, self.wanted)
        found = [slot_target(profile, block, self.outputs.raws[place]) for place in self.places]
        self.targets = [parameter for parameter in found if parameter is not None]

    def check_named(self) -> None:
        """Raise AssignmentRefused for an unknown code, a gap, or a slot that must not be used."""
        profile, block = self.session.profile, self.outputs.block
        known = {p.code for p in self.targets}
        if foreign := [code for code in self.wanted if code not in known]:
            raise AssignmentRefused(
                f"Nothing was written: no output slot is mapped to {', '.join(foreign)}."
            )
        if not self.wanted:
            raise AssignmentRefused("Nothing was written: no output was named.")
        for place in self.places:
            if slot_target(profile, block, self.outputs.raws[place]) is None:
                content = describe(profile, block, self.outputs.raws[place])
                raise AssignmentRefused(f"Nothing was written: {block.slots[place]} is {content}.")
        if wrong := refusing(assignment_problems(profile, self.outputs)):
            raise AssignmentRefused(" ".join(problem.text for problem in wrong))

    async def check_state(self) -> None:
        """Check the interlocks of a run command, if an output is a command, and standstill if
        required."""
        profile = self.session.profile
        state = await self.retrying.ask_state()
        stopped = [p.code for p in self.targets if p.access == "rw-stopped"]
        if stopped and state not in AT_REST:
            raise AssignmentRefused(
                f"Nothing was written: {', '.join(stopped)} can be written only with the motor"
                f" stopped; the drive is {self.retrying.headline}. Stop it first."
            )
        if not any(is_order(profile, parameter) for parameter in self.targets):
            return
        codes = deciding_codes(profile)
        for chart in profile.data.charts:
            codes += interlock_codes(chart)
        await self.retrying.ask_raws(codes)
        raws = self.session.image.raws
        found = chart_in_force(profile, raws)
        if found is None or not found.orders:
            raise AssignmentRefused("Nothing was written: Drive Panel does not command this drive.")
        if (held := blocked_reason(profile, found, "forward", raws)) is not None:
            raise AssignmentRefused(f"{held.text} {held.remedy}".strip())

    def check_values(self, raws: Mapping[str, int]) -> None:
        """Raise ValueRefused for a value outside the range of its parameter."""
        profile = self.session.profile
        for parameter in self.targets:
            if parameter.code in self.wanted:
                scale = profile.scale(parameter, self.retrying.raws, self.retrying.lacking)
                raw = raws[parameter.code]
                check_raw(parameter, raw, profile.names(parameter), scale)

    async def check_slots(self, when: str) -> None:
        """Raise AssignmentRefused if the slots have changed since the person saw them."""
        for plan in (self.outputs, self.inputs):
            if plan is None:
                continue
            block = plan.block
            held = await self.retrying.ask_raws(block.slots)
            changed = [slot for slot, raw in plan.slots.items() if held.get(slot) != raw]
            if not changed:
                continue
            text = f"another program changed {', '.join(changed)} of {block.name}."
            if when == "before":
                raise AssignmentRefused(f"Nothing was written: {text} Check the slots first.")
            if plan is self.inputs:
                raise AssignmentRefused(
                    f"The outputs were written, but the returned values are ignored: {text}"
                )
            raise AssignmentRefused(
                f"Values may have been written to other parameters: {text} Check"
                f" {self._names(held)}."
            )

    def _names(self, held: Mapping[str, int]) -> str:
        profile, block = self.session.profile, self.outputs.block
        return ", ".join(describe(profile, block, raw) for raw in held.values() if raw)
