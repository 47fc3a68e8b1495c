"""Editing the parameters of one drive: what is read when, what is staged, what became of it.

The values come in through a worker of the line's loop: what is looked at first, the rest behind
everything else; then what is looked at again and again, so that another's change is noticed.
Everything else belongs to the thread of the screen.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from tui.bus.errors import LineError, NoAnswer
from tui.bus.line import Priority, Worker
from tui.drive.errors import DriveError, ValueRefused
from tui.drive.orders import OrderRefused
from tui.drive.profile.schema import Parameter, StateKind
from tui.drive.settings.edits import Edits
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.settings.restore_plan import RestorePlan
from tui.drive.settings.selection import FilterContext
from tui.drive.settings.writable import Refusal, write_refusal
from tui.drive.shown import scale_sources, shown
from tui.drive.values import Value

from ..drive import DriveSession
from ..drive_state import DriveState
from ..journal import Journal
from ..read.retrying_reader import RetryingReader, neighbours
from ..read.upload import readable_codes
from ..work import Outcome, OutcomeKind, Permit, Task
from .apply import Applied, Result, apply_edits
from .eeprom import factory_reset, save_to_eeprom
from .favourites import Marks, load_marks, save_marks
from .link_change import LinkChange

IDLE_POLL_INTERVAL = 0.1
"""Seconds between two turns of the reader that has nothing to do."""
REREAD_AFTER = 1.0
"""Seconds after which what is looked at is read again."""
REREAD_AFTER_ERROR = 1.0
WAS_OFF = 3.0
"""Seconds of silence after which a drive that answers again was switched off, not disturbed."""


@dataclass(slots=True)
class Editor:
    """The values, the staged edits and the work on one drive."""

    session: DriveSession
    journal: Journal
    watched: Callable[[], DriveState | None]
    """The drive's state as it is watched; None while it is not known."""
    edits: Edits = field(default_factory=Edits)
    results: dict[str, Result] = field(default_factory=dict)
    """What became of the last writing of each parameter."""
    unsaved: set[str] = field(default_factory=set)
    waits_for_reset: set[str] = field(default_factory=set)
    moved: LinkChange | None = None
    """Where the drive answers now, after a setting of the line itself was written."""
    trouble: str = ""
    """Why nothing can be read now; empty while that works."""
    marks: Marks = field(default_factory=Marks)
    other: Mapping[str, int] = field(default_factory=dict)
    other_label: str = "factory"
    source: ParameterSet | None = None
    """The parameter set that the drive is compared with, if it is one."""
    visible: tuple[str, ...] = ()
    version: int = 0
    """Counts every change, so that a screen knows when to look."""
    _reader: Worker | None = None
    _silent: float | None = None
    """Since when the drive does not answer."""
    _starting: bool = False
    """Whether the drive was starting up when it was last looked at."""
    _asked: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.marks = load_marks(self.session.profile.id)

    # What is known

    @property
    def raws(self) -> Mapping[str, int]:
        """Raw values as last read, by whomever."""
        return self.session.image.raws

    @property
    def absent(self) -> dict[str, str]:
        """Codes without a value, and what the drive or the line said instead."""
        return {code: one.error for code, one in self.session.image.refused.items()}

    @property
    def lacking(self) -> frozenset[str]:
        """Codes that the drive itself said it does not have."""
        return self.session.image.lacking

    @property
    def changed_elsewhere(self) -> dict[str, int]:
        """Staged codes that somebody else has changed since, with the value before."""
        if self.busy:
            return {}
        raws = self.raws
        return {
            edit.code: edit.old
            for edit in self.edits
            if edit.old is not None and raws.get(edit.code, edit.old) != edit.old
        }

    @property
    def said(self) -> Outcome | None:
        """What the last work on the drive has come to."""
        return self.session.work.outcome

    @property
    def facts(self) -> FilterContext:
        """What filters decide by."""
        return FilterContext(
            self.session.profile,
            self.raws,
            self.edits,
            self.unsaved,
            self.marks.favourites,
            self.marks.recent,
            self.other,
        )

    @property
    def progress(self) -> tuple[int, int]:
        """How many readable parameters were read, and how many there are."""
        codes = readable_codes(self.session.profile)
        return sum(code in self.raws or code in self.absent for code in codes), len(codes)

    @property
    def state(self) -> StateKind | None:
        """The kind of the drive's state as it is watched; None while it is not known."""
        state = self.watched()
        return state.kind if state is not None else None

    @property
    def busy(self) -> bool:
        """Whether something is being written."""
        return self.session.work.busy_for(self)

    def value(self, code: str, raw: int | None = None) -> Value | None:
        """A parameter's value as a person reads it: the held one, or another raw value's."""
        held = self.raws.get(code) if raw is None else raw
        if held is None:
            return None
        return shown(
            self.session.profile, self.session.profile[code], held, self.raws, self.lacking
        )

    def refusal(self, code: str) -> Refusal | None:
        """Why a parameter cannot be written now."""
        profile = self.session.profile
        return write_refusal(profile, profile[code], self.state, self.marks.confirmed)

    # Reading

    def start(self) -> None:
        """Begin to read."""
        self.stop()
        self._reader = self.session.line.spawn(self._read, f"editor {self.session.device}")

    def stop(self) -> None:
        """Read no more; what is being written goes on."""
        if self._reader is not None:
            self._reader.cancel()
            self._reader = None

    async def _read(self) -> None:
        profile = self.session.profile
        first = RetryingReader(self.session)
        later = RetryingReader(self.session, Priority.BACKGROUND)
        rest = [*sorted(scale_sources(profile)), *readable_codes(profile)]
        parts = iter(neighbours(profile, dict.fromkeys(rest)))
        waiting: list[tuple[str, ...]] = []
        while True:
            try:
                if due := self._due():
                    await first.ask(due)
                    self._asked |= dict.fromkeys(due, time.monotonic())
                    self.version += 1
                elif waiting:
                    await later.ask(waiting[0])
                    self._asked |= dict.fromkeys(waiting.pop(0), time.monotonic())
                    self.version += 1
                elif (part := next(parts, None)) is not None:
                    known, absent = self.raws, self.absent
                    left = [c for c in part if c not in known and c not in absent]
                    waiting = [tuple(group) for group in later.reader.groups(left)]
                else:
                    await asyncio.sleep(IDLE_POLL_INTERVAL)
                self.trouble = ""
                self._look_for_a_reset()
            except LineError as error:
                if isinstance(error, NoAnswer) and self._silent is None:
                    self._silent = time.monotonic()
                self.trouble = str(error)
                self.version += 1
                await asyncio.sleep(REREAD_AFTER_ERROR)

    def _look_for_a_reset(self) -> None:
        """A drive that was silent, or starts, was switched off: what waited for that is over."""
        since, self._silent = self._silent, None
        off = since is not None and time.monotonic() - since > WAS_OFF
        before, self._starting = self._starting, self.state == "starting"
        if not off and (before or not self._starting):
            return
        if self.waits_for_reset or self.unsaved:
            lost = ", ".join(sorted(self.unsaved))
            gone = f" Not saved before, so look at: {lost}." if lost else ""
            self._say(f"The drive was reset or switched off.{gone}", OutcomeKind.DONE)
        self.waits_for_reset, self.unsaved = set(), set()
        # everything may be another value now
        self._asked = {}
        self.session.image.forget()

    def _due(self) -> list[str]:
        """What is looked at and was not read lately."""
        oldest = time.monotonic() - REREAD_AFTER
        due = [code for code in self.visible if self._asked.get(code, 0.0) < oldest]
        if not due:
            return []
        follows = [p.scale_by.parameter for c in due if (p := self._parameter(c)) and p.scale_by]
        return list(dict.fromkeys((*follows, *due)))

    def _parameter(self, code: str) -> Parameter | None:
        parameter = self.session.profile.get(code)
        return parameter if parameter is not None and parameter.access != "w" else None

    # Staging

    def stage(self, code: str, typed: str) -> str:
        """Stage what was typed; returns what should be told at once. Raises ValueRefused."""
        edits = self.edits.stage(self.session.profile, code, typed, self.raws, self.lacking)
        return self._staged(code, edits)

    def stage_raw(self, code: str, raw: int) -> str:
        """Stage a raw value: a name of a list, a word of bits. Raises ValueRefused."""
        edits = self.edits.stage_raw(self.session.profile, code, raw, self.raws, self.lacking)
        return self._staged(code, edits)

    def _staged(self, code: str, edits: Edits) -> str:
        if self.busy:
            raise ValueRefused("Something is being written; wait until that is done.")
        self.edits = edits
        self.results.pop(code, None)
        self.version += 1
        edit = edits.get(code)
        return edit.remark if edit else ""

    def undo(self, code: str) -> None:
        """Take one edit back."""
        self.edits = self.edits.undo(code, self.session.profile, self.raws, self.lacking)
        self.results.pop(code, None)
        self.version += 1

    def stage_old(self) -> str:
        """Stage what the drive held before the last write; says what was staged."""
        done = [result.edit for result in self.results.values() if result.done]
        olds = [(edit.code, edit.old) for edit in done if edit.old is not None]
        staged = 0
        for code, old in olds:
            with suppress(ValueRefused):
                self.stage_raw(code, old)
                staged += 1
        if not olds:
            return "Nothing is staged, and nothing was written lately."
        return f"{staged} old values are staged; w writes them."

    def undo_all(self) -> None:
        """Take every edit back."""
        self.edits, self.results = Edits(), {}
        self.version += 1

    def accept_changes(self) -> None:
        """Take what others wrote for the value before, knowingly."""
        self.edits = self.edits.now(self.session.profile, self.raws, self.lacking)
        self.version += 1

    async def plan(self) -> RestorePlan:
        """What it takes to make the drive hold the set; reads it. Raises the line's errors."""
        from tui.drive.profile import library
        from tui.drive.settings.restore_plan import Options, plan_restore

        from .restore import held_by

        assert self.source is not None
        profile = library.load(self.source.head.profile)
        options = Options(confirmed=frozenset(self.marks.confirmed))
        held = await held_by(self.session)
        return plan_restore(self.session.profile, held, self.source, profile, options)

    def take_plan(self, plan: RestorePlan) -> None:
        """Stage what a plan would write."""
        profile = self.session.profile
        self.edits = self.edits.stage_many(profile, plan.edits.asked, self.raws, self.lacking)
        self.version += 1

    # Marks

    def toggle_favourite(self, code: str) -> None:
        """Mark a parameter, or take the mark away."""
        self._mark(self.marks.toggled(code))

    def confirm(self, code: str) -> None:
        """A person has compared an unverified parameter with the keypad."""
        self._mark(self.marks.with_confirmed(code))

    def _mark(self, marks: Marks) -> None:
        self.marks = marks
        save_marks(self.session.profile.id, marks)
        self.version += 1

    # Writing

    def apply(self, codes: tuple[str, ...] = (), stamp: int | None = None) -> None:
        """Write what is staged, or only these; returns at once."""
        edits = self.edits
        if codes:
            edits = Edits(tuple(edit for edit in edits.asked if edit.code in codes))
        held_back = tuple(edit for edit in self.edits.asked if codes and edit.code not in codes)
        self.results = {}

        async def work(permit: Permit) -> str:
            applied = await apply_edits(
                self.session,
                self.journal,
                edits,
                permit=permit,
                confirmed=self.marks.confirmed,
                progress=self._progress,
            )
            self._applied(applied, Edits((*applied.left.asked, *held_back)))
            return _summary(applied)

        self._run(work, stamp, self._cut_short)

    def _progress(self, done: int, count: int, result: Result) -> None:
        self.results = {**self.results, result.edit.code: result}
        self._say(f"{done} of {count}: {result.edit.code} {result.outcome}", OutcomeKind.WORKING)

    def _applied(self, applied: Applied, left: Edits) -> None:
        self.edits = left
        written = [result.edit.code for result in applied.written]
        self._mark(self.marks.edited(written))
        self.unsaved |= set(applied.unsaved)
        self.waits_for_reset |= set(applied.after_reset)
        self.moved = next((link for link in applied.links if link.at_once), None)

    def _cut_short(self) -> str:
        """A stop came: what the drive has is no longer staged, the rest is."""
        results = self.results.values()
        done = [result.edit.code for result in results if result.done]
        self.edits = Edits(tuple(edit for edit in self.edits.asked if edit.code not in done))
        self._mark(self.marks.edited(done))
        profile = self.session.profile
        self.unsaved |= {c for c in done if profile[c].storage == "ram-until-saved"}
        with suppress(LineError):
            self.session.line.spawn(self._see_what_is_held, f"edits {self.session.device}")
        left = len(self.edits)
        return f"{len(done)} written and read back, {left} still staged." if left else ""

    async def _see_what_is_held(self) -> None:
        """Of the edit that a stop cut short it is not known whether the drive took it: look."""
        with suppress(LineError, DriveError):
            await RetryingReader(self.session).ask([edit.code for edit in self.edits])
            raws = self.raws
            self.edits = Edits(tuple(e for e in self.edits.asked if raws.get(e.code) != e.new))
            self.version += 1

    def save(self, stamp: int | None = None) -> None:
        """Copy the settings to EEPROM, where the family needs that."""

        async def work(permit: Permit) -> str:
            done = await save_to_eeprom(self.session, self.journal, permit)
            self.unsaved = set()
            return done

        self._run(work, stamp)

    def factory(self, stamp: int | None = None) -> None:
        """Recall the factory settings."""

        async def work(permit: Permit) -> str:
            confirmed = self.marks.confirmed
            done = await factory_reset(self.session, self.journal, permit, confirmed=confirmed)
            self._asked = {}
            self.start()
            return done

        self._run(work, stamp)

    def _run(
        self,
        work: Callable[[Permit], Coroutine[Any, Any, str]],
        stamp: int | None,
        given_up: Callable[[], str] | None = None,
    ) -> None:
        """Do it as work on the drive; what speaks against it is told."""
        queue = self.session.work
        if queue.busy:
            self._say("Another command is still being carried out.", OutcomeKind.REFUSED)
            return
        try:
            queue.put(Task(work, owner=self, given_up=given_up), stamp)
        except OrderRefused as refused:
            self._say(str(refused), OutcomeKind.REFUSED)
        self.version += 1

    def _say(self, text: str, kind: OutcomeKind) -> None:
        self.session.work.tell(kind, text)
        self.version += 1


def _summary(applied: Applied) -> str:
    """What became of all edits, in a sentence or two."""
    done, failed = len(applied.written), len(applied.results) - len(applied.written)
    parts = [f"{done} written and read back" if done else "nothing written"]
    if failed:
        codes = ", ".join(r.edit.code for r in applied.results if not r.done)
        parts.append(f"{failed} still staged: {codes}")
    parts += [link.text for link in applied.links]
    if applied.after_reset:
        parts.append(f"in force after a reset of the drive: {', '.join(applied.after_reset)}")
    return "; ".join(parts)
