"""Writing of staged edits: each value is read, written once, read back and recorded.

A value that another source has changed in the meantime is not overwritten. An edit that could not
be written stays staged. Nothing is printed: a screen or a command shows the results.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace

from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    LineError,
    LineLost,
    NoAnswer,
    RequestRefused,
    WrongReply,
    strip_outcome_note,
)
from tui.drive.errors import DriveError
from tui.drive.settings.edits import Edit, Edits
from tui.drive.settings.limits import builds_on, edit_problems, limit_sources
from tui.drive.settings.writable import cuts_line, option_code, waits_for_reset, write_refusal
from tui.drive.settings.write_sequence import ordered
from tui.drive.shown import shown

from ..arming import NotArmed
from ..drive import DriveSession
from ..journal import Journal
from ..read.retrying_reader import RetryingReader
from ..work import Permit, Stopped
from .applied import Applied, EditOutcome, LinkChange, Result, WriteProgress, link_change
from .wear import WearGate
from .write import NotTaken, Writer, device_refusal

LOST_ANSWERS = (NoAnswer, ChecksumFault, WrongReply)


async def apply_edits(
    session: DriveSession,
    journal: Journal,
    edits: Edits,
    *,
    permit: Permit,
    confirmed: Collection[str] = (),
    why: str = "setting",
    progress: WriteProgress | None = None,
    ask_after_failure: bool = False,
    gate: WearGate | None = None,
) -> Applied:
    """Write staged edits in their order, as long as the permit holds.

    If one fails, those that depend on it are not written. With `ask_after_failure` the others are
    not written either, but listed in `Applied.waits`, so that a person can be asked first.
    `confirmed` are codes of unverified parameters that the user has confirmed; `why` is the reason
    in the journal. `gate` decides about frequent writes to EEPROM (default: they are refused).
    Raises RequestRefused on a read-only line, and the line's errors as long as nothing was written.
    """
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    work = _Work(
        session, Writer(session, journal, permit), RetryingReader(session), edits, confirmed, why,
        gate or WearGate(journal.eeprom, confirmed),
    )  # fmt: skip
    await work.look_at_all()
    reported = edit_problems(session.profile, edits, work.retrying.raws)
    order = ordered(session.profile, edits, work.retrying.raws)
    for number, edit in enumerate(order, start=1):
        if work.stopped:
            result = work.not_sent(edit)
        elif (base := work.missed_base(edit)) != "":
            text = f"{edit.code} was not written: it depends on {base}, which was not written."
            result = Result(edit, EditOutcome.HELD_BACK, text, edit.old)
        elif ask_after_failure and work.missed:
            text = f"{edit.code} was not written yet, because {work.missed[0]} failed before it."
            result = Result(edit, EditOutcome.WAITS, text, edit.old)
        elif edit.code in reported:
            text = reported[edit.code]
            result = Result(edit, EditOutcome.REFUSED, text, edit.old, is_beyond_limit=True)
        else:
            result = await work.apply(edit)
        work.results.append(result)
        if progress is not None:
            progress(number, len(order), result)
    return work.summary()


@dataclass(slots=True)
class _Work:
    session: DriveSession
    writer: Writer
    retrying: RetryingReader
    edits: Edits
    confirmed: Collection[str]
    why: str
    gate: WearGate
    stopped: str = ""
    voided: bool = False
    """True if a stop or the end of arming has ended it."""
    results: list[Result] = field(default_factory=list)
    links: list[LinkChange] = field(default_factory=list)

    async def look_at_all(self) -> None:
        """Read every parameter that the edits and their limits depend on."""
        codes = {edit.code for edit in self.edits}
        codes |= limit_sources(self.session.profile, codes)
        await self.retrying.ask_many(self._with_sources(codes))

    def _with_sources(self, codes: Iterable[str]) -> list[str]:
        found = list(codes)
        for code in tuple(found):
            follows = self.session.profile[code].scale_source
            found += [follows] if follows else []
        return list(dict.fromkeys(found))

    @property
    def missed(self) -> list[str]:
        """Codes of the edits that were not written so far."""
        return [r.edit.code for r in self.results if not r.done]

    def missed_base(self, edit: Edit) -> str:
        """Return the earlier edit on which this one depends, if it was not written."""
        raws = self.retrying.raws
        return builds_on(self.session.profile, edit, self.missed, self.edits, raws)

    def not_sent(self, edit: Edit, held: int | None = None) -> Result:
        """Return the result of an edit that is not sent because the rest was ended."""
        why = self.stopped.removeprefix("Not sent: ")
        text = f"{edit.code} was not sent: {why}"
        return Result(edit, EditOutcome.NOT_SENT, text, held, self.voided)

    async def apply(self, edit: Edit) -> Result:
        """Read, write and compare one edit."""
        try:
            if (reason := await self._reason_against(edit)) is not None:
                return reason
        except LineError as error:
            self.stopped = str(error)
            return self.not_sent(edit)
        try:
            return await self._write(edit)
        except (Stopped, NotArmed) as error:
            self.stopped, self.voided = str(error), True
            return self.not_sent(edit, edit.old)
        except RequestRefused as error:
            if self.writer.permit is not None and self.writer.permit.refusal():
                self.stopped, self.voided = str(error), True
                return self.not_sent(edit, edit.old)
            return Result(edit, EditOutcome.REFUSED, str(error), edit.old)
        except (*LOST_ANSWERS, LineLost) as error:
            return await self._after_a_lost_answer(edit, error)
        except LineError as error:
            self.stopped = str(error)
            return self._unknown(edit, error)

    async def _reason_against(self, edit: Edit) -> Result | None:
        """Return why the edit must not be written, by fresh values; None if it may."""
        profile, retrying = self.session.profile, self.retrying
        parameter = profile[edit.code]
        state = await retrying.ask_state()
        if (against := write_refusal(profile, parameter, state, self.confirmed)) is not None:
            return Result(edit, EditOutcome.REFUSED, against.text, edit.old)
        option = option_code(profile, parameter)
        wanted = [edit.code, *([option.code] if option else [])]
        raws = await retrying.ask_raws(self._with_sources(wanted))
        if option is not None and raws.get(option.code) != option.factory:
            text = (
                f"{edit.code} was not written: {option.code} is not {option.factory}. So another"
                f" option is fitted, for which {edit.code} has another meaning."
            )
            return Result(edit, EditOutcome.REFUSED, text, edit.old)
        held = raws.get(edit.code)
        if held is None:
            message = retrying.why_absent(edit.code)
            return Result(
                edit,
                EditOutcome.REFUSED,
                f"{edit.code} was not written, because it cannot be read: {message}",
            )
        if held == edit.new and self._means(edit):
            unsaved = self.session.unsaved
            if profile[edit.code].storage == "ram-until-saved" and edit.code not in unsaved:
                # written by another source: whether it is saved is not known
                self.session.unsaved_settings.note_write(edit.code, None, held)
            text = f"{edit.code} already holds {edit.text}."
            return Result(edit, EditOutcome.DONE, text, held, unchanged=True)
        if not self._means(edit) or (edit.old is not None and held != edit.old):
            return Result(edit, EditOutcome.CHANGED, self._changed_text(edit, held), held)
        if worn := await self.gate.refusal(self.session, parameter, edit.new):
            return Result(edit, EditOutcome.REFUSED, worn, held)
        return None

    def _means(self, edit: Edit) -> bool:
        """Return True if the raw value still has the staged meaning: its scale may have changed."""
        parameter = self.session.profile[edit.code]
        if not parameter.scale_source:
            return True
        retrying = self.retrying
        now = shown(self.session.profile, parameter, edit.new, retrying.raws, retrying.lacking)
        return now.display == edit.text

    def _changed_text(self, edit: Edit, held: int) -> str:
        parameter = self.session.profile[edit.code]
        now = shown(
            self.session.profile, parameter, held, self.retrying.raws, self.retrying.lacking
        )
        if (source := parameter.scale_source) and not self._means(edit):
            return (
                f"{edit.code} was not written: {source}, which sets its scale, has changed. Check"
                " the value, and apply again."
            )
        return (
            f"{edit.code} was not written: another source changed it from {edit.old_text} to"
            f" {now.display}. It stays staged; apply again to overwrite it."
        )

    async def _write(self, edit: Edit) -> Result:
        profile, session = self.session.profile, self.session
        parameter = profile[edit.code]
        change = link_change(profile, session.line.link, session.device, edit)
        cut = cuts_line(profile, parameter)
        try:
            await self.writer.write_parameter(parameter, edit.new, why=self.why, read_back=not cut)
        except DeviceException as error:
            text = device_refusal(profile, parameter, error, self.retrying.headline)
            return Result(edit, EditOutcome.DRIVE_REFUSED, text, edit.old)
        except NotTaken as error:
            held = (await self.retrying.ask_raws([edit.code])).get(edit.code)
            return Result(edit, EditOutcome.NOT_TAKEN, str(error), held)
        except LOST_ANSWERS:
            if not cut:
                raise
            # a drive that changes its settings at once may answer with the new ones already
        if change is not None:
            self.links.append(change)
        if cut and change is not None:
            self.stopped = change.text
            return Result(edit, EditOutcome.SENT, f"{edit.code} was sent. {change.text}")
        return Result(
            edit, EditOutcome.DONE, f"{edit.code}: {edit.old_text} -> {edit.text}", edit.new
        )

    async def _after_a_lost_answer(self, edit: Edit, error: LineError) -> Result:
        """Find the result of a write without a reply, by reading.

        The line may be open again immediately: if its owner has ended, another program takes it
        over.
        """
        try:
            held = (await self.retrying.ask_raws([edit.code])).get(edit.code)
        except LineError as later:
            self.stopped = str(later)
            return self._unknown(edit, later)
        if held is not None:
            self.session.unsaved_settings.note_value(edit.code, held)
        if held == edit.new:
            text = f"{edit.code}: {edit.old_text} -> {edit.text} (verified; the reply was lost)"
            return Result(edit, EditOutcome.DONE, text, held)
        if isinstance(error, LineLost):
            text = f"{edit.code} was not written: {strip_outcome_note(error)}"
            return Result(edit, EditOutcome.NOT_SENT, text, held)
        answers = self.session.profile.data.exceptions
        silent = [] if answers else ["This family does not answer what it refuses."]
        text = f"{edit.code} was not accepted: {strip_outcome_note(error)}"
        text = " ".join([text, *silent, f"The drive is {self.retrying.headline}."])
        return Result(edit, EditOutcome.NOT_TAKEN, text, held)

    @staticmethod
    def _unknown(edit: Edit, error: LineError) -> Result:
        why = strip_outcome_note(error)
        text = f"{edit.code} may have been written: {why} Read it before you write it again."
        return Result(edit, EditOutcome.UNKNOWN, text)

    def summary(self) -> Applied:
        """Combine all results with the edits that remain."""
        profile = self.session.profile
        done = [result.edit.code for result in self.results if result.done]
        parameters = [profile[code] for code in done]
        return Applied(
            results=tuple(self.results),
            left=self._left(set(done)),
            links=tuple(self.links),
            after_reset=tuple(p.code for p in parameters if waits_for_reset(profile, p)),
            unsaved=tuple(code for code in done if code in self.session.unsaved),
            stopped=self.stopped,
            stamp=self.writer.permit.stamp if self.writer.permit is not None else 0,
            waits=tuple(r.edit.code for r in self.results if r.outcome is EditOutcome.WAITS),
        )

    def _left(self, done: set[str]) -> Edits:
        """Return the edits that stay staged, compared with the current values of the drive."""
        left = Edits(tuple(edit for edit in self.edits.requested if edit.code not in done))
        held = {r.edit.code: r.held for r in self.results if r.held is not None}
        raws = {**self.retrying.raws, **held}
        try:
            return left.now(self.session.profile, raws, self.retrying.lacking)
        except DriveError:
            # a value may not exist with the present scales: it stays as it was typed
            return Edits(tuple(replace(e, old=raws.get(e.code, e.old)) for e in left.requested))
