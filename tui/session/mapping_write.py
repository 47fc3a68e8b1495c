"""Writing an assignment into a drive, slot by slot, each read back; and exchanging its words.

Everything is looked at anew before each write. What somebody else changed meanwhile is not
overwritten.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tui.bus.errors import DeviceException, LineError, RequestRefused
from tui.bus.line import Priority
from tui.drive.mapping import (
    UNUSED,
    Assignment,
    Change,
    MappingError,
    describe,
    problems,
    refusing,
    steps,
    target,
)
from tui.drive.orders import chart_in_force, deciding_codes, interlock, interlock_codes
from tui.drive.schema import Block, Parameter
from tui.drive.values import check_raw, decode, from_words, to_words
from tui.drive.writable import AT_REST, is_order

from .asking import Asker
from .drive_session import DriveSession
from .journal import Entry, Journal, now_text
from .refusals import device_refusal
from .writing import NotTaken, Writer

Allowed = Callable[[], bool]
"""Whether the drive is still armed."""


class AssignmentRefused(MappingError):
    """An assignment or an exchange that is not written, or only in part; the text says which."""


@dataclass(frozen=True, slots=True)
class Written:
    """What was written, in order."""

    changes: tuple[Change, ...]
    after_reset: bool
    """True where it counts only once the drive was reset."""
    unsaved: bool
    """True where it is lost at power-off until the drive is told to save."""

    @property
    def text(self) -> str:
        """What was done, and what is to be done yet, for a person."""
        if not self.changes:
            return "Nothing was to be changed."
        codes = ", ".join(dict.fromkeys(change.slot for change in self.changes))
        text = f"Written and read back: {codes}."
        if self.after_reset:
            text += " In force after the drive's next reset."
        if self.unsaved:
            text += " Lost at power-off until saved."
        return text


async def write_assignment(
    session: DriveSession,
    journal: Journal,
    plan: Assignment,
    *,
    expected: Mapping[str, int] | None = None,
    allowed: Allowed = lambda: True,
) -> Written:
    """Make the drive hold an assignment, with the motor at rest.

    `expected` are the raw values by slot that the person saw. Raises AssignmentRefused where
    something speaks against it or the drive does not do it, RequestRefused on a read-only line,
    and the line's other errors.
    """
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    if wrong := refusing(problems(session.profile, plan)):
        raise AssignmentRefused(" ".join(problem.text for problem in wrong))
    work = _Writing(session, Writer(session, journal), Asker(session), plan, allowed)
    try:
        return await work.carry_out(expected)
    finally:
        # the monitor learns what the block brings now
        session.monitor.refresh()


@dataclass(slots=True)
class _Writing:
    session: DriveSession
    writer: Writer
    asker: Asker
    plan: Assignment
    allowed: Allowed
    done: tuple[Change, ...] = ()

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
            await self._write(step)
            self.done = (*self.done, step)
        held = await self._held()
        for slot, raw in self.plan.slots.items():
            if held[slot] != raw:
                raise self._changed(slot, raw, held[slot])
        unsaved = any(
            self.session.profile[slot].storage == "ram-until-saved" for slot in block.slots
        )
        return Written(self.done, block.effective == "after-reset", unsaved)

    async def _held(self) -> dict[str, int]:
        held = await self.asker.ask_raws(self.plan.block.slots)
        missing = [slot for slot in self.plan.block.slots if slot not in held]
        if missing:
            said = self.asker.absent.get(missing[0], "")
            raise AssignmentRefused(self._so_far(f"{missing[0]} cannot be read: {said}"))
        return held

    async def _may(self) -> None:
        """Raise unless the drive is armed yet and its motor surely at rest."""
        if not self.allowed():
            raise AssignmentRefused(self._so_far("The drive is no longer armed."))
        if await self.asker.ask_state() not in AT_REST:
            text = (
                f"{self.plan.block.name} are changed with the motor stopped only; the drive is"
                f" {self.asker.headline}. Stop it first."
            )
            raise AssignmentRefused(self._so_far(text))

    async def _write(self, step: Change) -> None:
        profile = self.session.profile
        parameter = profile[step.slot]
        try:
            await self.writer.write(parameter, step.new, why=self.plan.block.name.lower())
        except DeviceException as error:
            text = device_refusal(profile, parameter, error, self.asker.headline)
            raise AssignmentRefused(self._so_far(text)) from error
        except NotTaken as error:
            raise AssignmentRefused(self._so_far(str(error))) from error

    def _changed(self, slot: str, old: int | None, now: int) -> AssignmentRefused:
        profile, block = self.session.profile, self.plan.block
        was, is_now = describe(profile, block, old), describe(profile, block, now)
        text = f"{slot} was changed meanwhile by somebody else: {was} is now {is_now}."
        return AssignmentRefused(self._so_far(f"{text} Look at it, then write again."))

    def _so_far(self, text: str) -> str:
        if not self.done:
            return f"{text} Nothing was written."
        codes = ", ".join(dict.fromkeys(change.slot for change in self.done))
        return f"{text} Written before: {codes}."


# Outputs


@dataclass(frozen=True, slots=True)
class Exchanged:
    """What one exchange has written through the outputs, and the inputs that came back."""

    outputs: dict[str, int]
    """Raw values by code of the parameter, as they were written."""
    inputs: dict[str, int]
    """Raw values by code, of the inputs whose slots still stand for the same afterwards."""


async def exchange(
    session: DriveSession,
    journal: Journal,
    outputs: Assignment,
    wanted: Mapping[str, int],
    inputs: Assignment | None = None,
    *,
    allowed: Allowed = lambda: True,
) -> Exchanged:
    """Write through the output slots, and read the inputs in the same exchange by function 23.

    `wanted` are raw values by code; slots that nobody names get what their parameter holds now.
    Commands pass through the same interlocks as a run order. Raises AssignmentRefused,
    ValueRefused, RequestRefused, NotTaken, and the line's errors.
    """
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    if not allowed():
        raise AssignmentRefused("The drive is not armed; nothing was written.")
    if outputs.block.effective == "after-reset":
        raise AssignmentRefused(
            f"What {outputs.block.name.lower()} stands for since the last reset cannot be read:"
            " nothing is written through it from here."
        )
    work = _Exchange(session, journal, Asker(session), outputs, inputs)
    return await work.carry_out(wanted)


@dataclass(slots=True)
class _Exchange:
    session: DriveSession
    journal: Journal
    asker: Asker
    outputs: Assignment
    inputs: Assignment | None

    async def carry_out(self, wanted: Mapping[str, int]) -> Exchanged:
        await self._check_slots("before")
        targets = self._targets()
        if foreign := [code for code in wanted if code not in {p.code for p in targets}]:
            raise AssignmentRefused(f"No output slot stands for {', '.join(foreign)}.")
        await self._interlocks(targets)
        codes = [p.code for p in targets if p.access != "w"]
        held = await self.asker.ask_raws(codes)
        raws = {p.code: wanted[p.code] for p in targets if p.code in wanted}
        raws |= {code: raw for code, raw in held.items() if code not in raws}
        if unknown := [p.code for p in targets if p.code not in raws]:
            raise AssignmentRefused(
                f"What {', '.join(unknown)} holds now is not known; give it a value as well."
            )
        for parameter in targets:
            if parameter.code in wanted:
                self._check(parameter, raws[parameter.code])
        words = self._send_words(targets, raws)
        reply = await self._send(targets, raws, held, words)
        await self._check_slots("after")
        return Exchanged(raws, self._read(reply))

    def _targets(self) -> list[Parameter]:
        """What the slots in use stand for; raises AssignmentRefused for a hole or a stranger."""
        found = []
        for slot, raw in list(self.outputs.slots.items())[: self.outputs.length]:
            parameter = target(self.session.profile, self.outputs.block, raw)
            if parameter is None:
                stands = describe(self.session.profile, self.outputs.block, raw)
                raise AssignmentRefused(f"{slot} is {stands}: nothing is written through it.")
            found.append(parameter)
        if not found:
            raise AssignmentRefused(f"{self.outputs.block.name}: no slot is in use.")
        if wrong := refusing(problems(self.session.profile, self.outputs)):
            raise AssignmentRefused(" ".join(problem.text for problem in wrong))
        return found

    async def _interlocks(self, targets: list[Parameter]) -> None:
        """The interlocks of a run order where an output is an order; rest where one needs it."""
        profile = self.session.profile
        state = await self.asker.ask_state()
        stopped = [p.code for p in targets if p.access == "rw-stopped"]
        if stopped and state not in AT_REST:
            raise AssignmentRefused(
                f"{', '.join(stopped)} are written with the motor stopped only; the drive is"
                f" {self.asker.headline}."
            )
        if not any(is_order(profile, parameter) for parameter in targets):
            return
        codes = deciding_codes(profile)
        for chart in profile.data.charts:
            codes += interlock_codes(chart)
        raws = self.session.monitor.known.raws() | await self.asker.ask_raws(codes)
        found = chart_in_force(profile, raws)
        if found is None or not found.orders:
            raise AssignmentRefused("This drive is not commanded from here.")
        if refused := interlock(found, "forward", raws):
            raise AssignmentRefused(refused)

    def _check(self, parameter: Parameter, raw: int) -> None:
        profile = self.session.profile
        scale = profile.scale(parameter, self.asker.raws, self.asker.lacking)
        check_raw(parameter, raw, profile.names(parameter), scale)

    def _send_words(self, targets: list[Parameter], raws: Mapping[str, int]) -> list[int]:
        return [to_words(parameter, raws[parameter.code])[0] for parameter in targets]

    async def _send(
        self,
        targets: list[Parameter],
        raws: Mapping[str, int],
        held: Mapping[str, int],
        words: list[int],
    ) -> tuple[int, ...]:
        session, block = self.session, self.outputs.block
        answer = "ok"
        reply: tuple[int, ...] = ()
        try:
            if self.inputs is not None and session.profile.function(23) is not None:
                both = await session.line.read_write(
                    session.device,
                    self.inputs.block.address,
                    len(self.inputs.raws),
                    block.address,
                    words,
                    priority=Priority.OPERATOR_WRITE,
                )
                reply = both.words
            else:
                await session.line.write(session.device, block.address, words, multiple=True)
        except LineError as error:
            answer = str(error)
            raise
        finally:
            session.note_command()
            back = await self._back(targets) if answer == "ok" else {}
            for parameter in targets:
                self._record(parameter, held, raws, answer, back)
        return reply

    async def _back(self, targets: list[Parameter]) -> dict[str, int]:
        return await self.asker.ask_raws(p.code for p in targets if p.access != "w")

    def _record(
        self,
        parameter: Parameter,
        held: Mapping[str, int],
        raws: Mapping[str, int],
        answer: str,
        back: Mapping[str, int],
    ) -> None:
        session, code = self.session, parameter.code
        old, new = held.get(code), raws[code]
        entry = Entry(
            time=now_text(),
            line=session.line_text,
            device=session.device,
            profile=session.profile.id,
            code=code,
            address=parameter.address,
            old_raw=old,
            old=self._text(parameter, old),
            new_raw=new,
            new=self._text(parameter, new),
            answer=answer,
            read_back=back.get(code),
            why=f"through {self.outputs.block.name.lower()}",
        )
        self.journal.add(entry)

    def _text(self, parameter: Parameter, raw: int | None) -> str:
        if raw is None:
            return ""
        profile = self.session.profile
        scale = profile.scale(parameter, self.asker.raws, self.asker.lacking)
        return decode(parameter, raw, profile.names(parameter), scale).display

    def _read(self, reply: tuple[int, ...]) -> dict[str, int]:
        found = {}
        unknown = self.session.profile.data.reading.unknown_word
        for raw, word in zip(self.inputs.raws if self.inputs else (), reply, strict=False):
            assert self.inputs is not None
            parameter = target(self.session.profile, self.inputs.block, raw)
            if raw != UNUSED and parameter is not None and word != unknown:
                found[parameter.code] = from_words(parameter, [word])
        return found

    async def _check_slots(self, when: str) -> None:
        """Raise unless the slots stand for what the person saw; afterwards it may be too late."""
        for plan in (self.outputs, self.inputs):
            if plan is None:
                continue
            block = plan.block
            held = await self.asker.ask_raws(block.slots)
            changed = [slot for slot, raw in plan.slots.items() if held.get(slot) != raw]
            if not changed:
                continue
            text = f"{', '.join(changed)} of {block.name.lower()} were changed by somebody else"
            if when == "before" or plan is self.inputs:
                raise AssignmentRefused(f"{text}: nothing is taken from it. Look at them first.")
            raise AssignmentRefused(
                f"{text} while words were written through them: look at {self._names(block, held)}."
            )

    def _names(self, block: Block, held: Mapping[str, int]) -> str:
        return ", ".join(describe(self.session.profile, block, raw) for raw in held.values() if raw)
