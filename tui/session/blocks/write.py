"""Write of an assignment to a drive, slot by slot, each read back.

Everything is read again before each write. A slot that another source has changed in the meantime
is not overwritten. A slot without a reply is read: it is written once, whatever the result.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tui.bus.errors import DeviceException, LineError, RequestRefused, strip_outcome_note
from tui.drive.blocks.assignment import Assignment, MappingError, SlotChange, describe, steps
from tui.drive.blocks.slot_rules import assignment_problems, refusing
from tui.drive.orders import OrderRefused
from tui.drive.profile.schema import Block
from tui.drive.settings.writable import AT_REST

from ..drive import DriveSession
from ..journal import Journal
from ..read.retrying_reader import RetryingReader
from ..settings.write import NotTaken, Writer, device_refusal
from ..work import Permit

_NOTHING_WRITTEN = "Nothing was written."
_NOTHING_BEFORE = "Nothing was written before it."


class AssignmentRefused(MappingError):
    """An assignment or an exchange was not written, or only a part; the text says which.

    If the drive or the line is the reason, their error is its cause.
    """


Sent = Callable[[SlotChange, bool], None]
"""Called with each slot before it is sent, and once more (True) when the drive holds it."""


@dataclass(frozen=True, slots=True)
class Written:
    """Written slots, in order."""

    changes: tuple[SlotChange, ...]
    after_reset: bool
    """True if it takes effect only after a reset of the drive."""
    unsaved: bool
    """True if it is lost at power-off until the drive saves it."""

    @property
    def text(self) -> str:
        """Result, and the steps that remain, for a person."""
        if not self.changes:
            return "Nothing to change: the drive already holds this assignment."
        codes = ", ".join(dict.fromkeys(change.slot for change in self.changes))
        text = f"Wrote {codes}, all verified."
        if self.after_reset:
            text = f"{text} Takes effect after the drive's next reset."
        if self.unsaved:
            text = f"{text} Lost at power-off until saved."
        return text


async def write_assignment(
    session: DriveSession,
    journal: Journal,
    plan: Assignment,
    *,
    permit: Permit,
    expected: Mapping[str, int] | None = None,
    sent: Sent = lambda _change, _held: None,
) -> Written:
    """Write an assignment, with the motor at rest.

    `expected` are the raw values by slot that the person saw. Raises AssignmentRefused if a check,
    the drive or the line prevents it, and RequestRefused on a read-only line.
    """
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    if wrong := refusing(assignment_problems(session.profile, plan)):
        raise AssignmentRefused(" ".join(problem.text for problem in wrong))
    writer, retrying = Writer(session, journal, permit), RetryingReader(session)
    work = _Writing(session, writer, retrying, plan, sent)
    try:
        return await work.carry_out(expected)
    except LineError as error:
        raise AssignmentRefused(work.so_far(str(error))) from error


def at_rest_only(block: Block, headline: str) -> str:
    """Return the reason that slots are not written in a state of that name."""
    return (
        f"{block.name}: slots can be changed only with the motor stopped; the drive is {headline}."
        " Stop it first."
    )


@dataclass(slots=True)
class _Writing:
    session: DriveSession
    writer: Writer
    retrying: RetryingReader
    plan: Assignment
    sent: Sent
    done: tuple[SlotChange, ...] = ()

    async def carry_out(self, expected: Mapping[str, int] | None) -> Written:
        block = self.plan.block
        held = await self._held()
        for slot, raw in (expected or {}).items():
            if held.get(slot, raw) != raw:
                raise self._changed(slot, raw, held[slot])
        for step in steps(held, self.plan):
            await self._may()
            now = (await self._held())[step.slot]
            if now != step.old:
                raise self._changed(step.slot, step.old, now)
            self.sent(step, False)
            await self._write(step)
            self.sent(step, True)
            self.done = (*self.done, step)
        held = await self._held()
        for slot, raw in self.plan.slots.items():
            if held[slot] != raw:
                raise self._changed(slot, raw, held[slot])
        unsaved = any(slot in self.session.unsaved for slot in block.slots)
        return Written(self.done, block.effective == "after-reset", unsaved)

    async def _held(self) -> dict[str, int]:
        held = await self.retrying.ask_raws(self.plan.block.slots)
        missing = [slot for slot in self.plan.block.slots if slot not in held]
        if missing:
            message = self.retrying.why_absent(missing[0])
            raise AssignmentRefused(self.so_far(f"{missing[0]} cannot be read: {message}"))
        return held

    async def _may(self) -> None:
        """Raise AssignmentRefused unless the motor is at standstill and the task may still
        write."""
        permit = self.writer.permit
        if permit is not None and (why := permit.refusal()):
            raise AssignmentRefused(self.so_far(why))
        if await self.retrying.ask_state() not in AT_REST:
            text = at_rest_only(self.plan.block, self.retrying.headline)
            raise AssignmentRefused(self.so_far(text))

    async def _write(self, step: SlotChange) -> None:
        profile = self.session.profile
        parameter = profile[step.slot]
        try:
            await self.writer.write_parameter(parameter, step.new, why=self.plan.block.name.lower())
        except DeviceException as error:
            text = device_refusal(profile, parameter, error, self.retrying.headline)
            raise AssignmentRefused(self.so_far(text)) from error
        except (NotTaken, OrderRefused, RequestRefused) as error:
            raise AssignmentRefused(self.so_far(str(error))) from error
        except LineError as error:
            await self._see_taken(step, error)

    async def _see_taken(self, step: SlotChange, lost: LineError) -> None:
        """Read the result of a write without a reply; raise AssignmentRefused if it is not held."""
        try:
            now = (await self.retrying.ask_raws([step.slot])).get(step.slot)
        except LineError:
            now = None
        if now is None:
            raise AssignmentRefused(self.so_far(str(lost), sent=step.slot)) from lost
        if now != step.new:
            text = f"{step.slot} was not accepted: {strip_outcome_note(lost)}"
            raise AssignmentRefused(self.so_far(text)) from lost

    def _changed(self, slot: str, old: int | None, now: int) -> AssignmentRefused:
        profile, block = self.session.profile, self.plan.block
        was, is_now = describe(profile, block, old), describe(profile, block, now)
        text = f"Another program changed {slot} from {was} to {is_now}."
        return AssignmentRefused(self.so_far(f"{text} Check it, then write again."))

    def so_far(self, text: str, *, sent: str = "") -> str:
        """Return a text with the slots that were written; `sent` may have been written too."""
        if sent:
            text = f"{sent} was sent, and may have been written: {text}"
        if not self.done:
            return f"{text} {_NOTHING_BEFORE if sent else _NOTHING_WRITTEN}"
        codes = ", ".join(dict.fromkeys(change.slot for change in self.done))
        return f"{text} Already written: {codes}."
