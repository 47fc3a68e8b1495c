"""Editor of the parameters of one drive: values, staged edits, writes.

The values of the drive are in `values`, the staged edits in `staging`. Writing is work on the
drive, in the line's loop. Everything else belongs to the thread of the screen.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from tui.bus.errors import LineError
from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.drive.profile.schema import StateKind
from tui.drive.sentences import first_of
from tui.drive.settings.edits import Edit
from tui.drive.settings.memory_orders import eeprom_use
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.settings.restore_plan import Options, RestorePlan
from tui.drive.settings.selection import FilterContext
from tui.drive.settings.writable import Refusal, write_refusal

from ..drive import DriveSession
from ..drive_state import DriveState
from ..eeprom_counts import DriveCounts
from ..journal import Journal
from ..paths import state_folder
from ..read.retrying_reader import RetryingReader
from ..stored import store_json, stored_json
from ..work import Outcome, OutcomeKind, Permit, Task
from .applied import Applied, LinkChange, Result, done_text
from .apply import apply_edits
from .eeprom import factory_reset, save_to_eeprom
from .staging import Staging
from .watched_values import WatchedValues
from .wear import WearGate, agreed, read_counts, wear_of

RECENT_KEPT = 30
STORED_KEYS = {"favorites": "favourites", "confirmed": "confirmed", "recent": "recent"}
"""Key in the stored file by field; files of earlier versions have the same keys."""


@dataclass(frozen=True, slots=True)
class Marks:
    """Marked codes of one drive family."""

    favorites: tuple[str, ...] = ()
    confirmed: tuple[str, ...] = ()
    """Unverified parameters whose address a person has compared with the keypad."""
    recent: tuple[str, ...] = ()
    """The last edited first."""

    def toggled(self, code: str) -> Marks:
        """Return marks with a code added to the favorites, or removed."""
        if code in self.favorites:
            return replace(self, favorites=tuple(c for c in self.favorites if c != code))
        return replace(self, favorites=(*self.favorites, code))

    def with_confirmed(self, code: str) -> Marks:
        """Return marks with a code added to the confirmed ones."""
        return replace(self, confirmed=tuple(dict.fromkeys((*self.confirmed, code))))

    def edited(self, codes: Iterable[str]) -> Marks:
        """Return marks with these codes as the ones edited last."""
        return replace(self, recent=tuple(dict.fromkeys((*codes, *self.recent)))[:RECENT_KEPT])


def load_marks(profile_id: str) -> Marks:
    """Return the stored marks; empty if the file is missing or damaged."""
    reported = stored_json(_file(profile_id))
    stored = reported if isinstance(reported, dict) else {}
    return Marks(**{name: _texts(stored.get(key)) for name, key in STORED_KEYS.items()})


def _texts(found: object) -> tuple[str, ...]:
    return tuple(item for item in found if isinstance(item, str)) if isinstance(found, list) else ()


def save_marks(profile_id: str, marks: Marks) -> None:
    """Store the marks; errors of the folder are ignored."""
    with suppress(OSError):
        fields = asdict(marks)
        store_json(_file(profile_id), {key: fields[name] for name, key in STORED_KEYS.items()})


def _file(profile_id: str) -> Path:
    return state_folder() / f"marks-{profile_id}.json"


LEFT_NAMED = 8
"""Number of staged codes that a text names; the others are counted."""


@dataclass(slots=True)
class Editor:
    """Values, staged edits and writes of one drive."""

    session: DriveSession
    journal: Journal
    watched: Callable[[], DriveState | None]
    """The monitored state of the drive; None if it is not known."""
    values: WatchedValues = field(init=False)
    staging: Staging = field(init=False)
    waits_for_reset: set[str] = field(default_factory=set)
    applied: Applied | None = None
    """Result of the last write, until a screen has shown it."""
    moved: LinkChange | None = None
    """Address of the drive after a write of its own address; None without one."""
    marks: Marks = field(init=False)
    other: Mapping[str, int] = field(default_factory=dict)
    other_label: str = "factory"
    eeprom: DriveCounts | None = None
    """Writes to its EEPROM; None until they are read."""
    source: ParameterSet | None = None
    """The parameter set with which the drive is compared; None without one."""

    def __post_init__(self) -> None:
        self.marks = load_marks(self.session.profile.id)
        self.staging = Staging(self.session, lambda: self.busy)
        self.values = WatchedValues(self.session, lambda: self.state, self._was_reset)

    @property
    def unsaved(self) -> frozenset[str]:
        """Codes written to the drive, also as slots of a block, that are not saved."""
        return self.session.unsaved

    @property
    def message(self) -> Outcome | None:
        """Result of the last work on the drive."""
        return self.session.work.outcome

    @property
    def facts(self) -> FilterContext:
        """Facts that filters of the list use."""
        return FilterContext(
            self.session.profile,
            self.session.image.raws,
            self.staging.edits,
            self.unsaved,
            self.marks.favorites,
            self.marks.recent,
            self.other,
            self.session.image.lacking,
        )

    @property
    def state(self) -> StateKind | None:
        """The monitored kind of state by the motor's motion; None if it is not known."""
        state = self.watched()
        return state.motion if state is not None else None

    @property
    def busy(self) -> bool:
        """True if something is being written."""
        return self.session.work.busy_for(self)

    def refusal(self, code: str) -> Refusal | None:
        """Return why a parameter cannot be written now; empty if it can."""
        profile = self.session.profile
        return write_refusal(profile, profile[code], self.state, self.marks.confirmed)

    async def plan(self) -> RestorePlan:
        """Read the drive, and plan the writes for the set. Raises the line's errors."""
        from tui.drive.settings.restore_planner import plan_restore

        from .restore import held_by

        assert self.source is not None
        profile = library.load(self.source.head.profile)
        options = Options(confirmed=frozenset(self.marks.confirmed))
        held = await held_by(self.session)
        return plan_restore(self.session.profile, held, self.source, profile, options)

    # Marks

    def toggle_favorite(self, code: str) -> None:
        """Add a parameter to the favorites, or remove it."""
        self._mark(self.marks.toggled(code))

    def confirm(self, code: str) -> None:
        """Note that a person has compared an unverified parameter with the keypad."""
        self._mark(self.marks.with_confirmed(code))

    def _mark(self, marks: Marks) -> None:
        self.marks = marks
        save_marks(self.session.profile.id, marks)

    # Writing

    async def recount(self) -> None:
        """Read how often the drive's EEPROM was written; a file that cannot be read is ignored."""
        with suppress(OSError, ValueError):
            self.eeprom = await read_counts(self.session, self.journal.eeprom)

    def wear_text(self, edits: Sequence[Edit] | None = None) -> str:
        """Return how often the EEPROM was written, for a question: by saves, or by these edits.

        Of edits, only those that go to EEPROM frequently are reported.
        """
        if self.eeprom is None:
            return ""
        profile = self.session.profile
        if edits is not None:
            used = (e.code for e in edits if eeprom_use(profile, profile[e.code], e.new) == "write")
            codes = list(used)
        elif any(parameter.eeprom_address is not None for parameter in profile.parameters):
            codes = sorted(self.unsaved)
        else:
            wear = wear_of(self.session, self.eeprom, "")
            return f"EEPROM: {wear.text}" if wear.count else ""
        wears = {code: wear_of(self.session, self.eeprom, code) for code in codes}
        return "\n".join(
            f"EEPROM, {c}: {wear.text}" for c, wear in wears.items() if wear.is_frequent
        )

    def _count_again(self) -> None:
        """Read the counts once the journal has them; nothing waits for that."""

        async def work() -> None:
            await asyncio.to_thread(self.journal.flush)
            await self.recount()

        with suppress(LineError):
            self.session.line.spawn(work, f"EEPROM writes {self.session.device}")

    @property
    def _gate(self) -> WearGate:
        return WearGate(self.journal.eeprom, ask=agreed)

    def apply(self, codes: tuple[str, ...] = (), stamp: int | None = None) -> None:
        """Write the staged edits (default: all); return immediately."""
        staging = self.staging
        edits, held_back = staging.only(codes)
        staging.begin_write()
        self.applied = None

        async def work(permit: Permit) -> str:
            applied = await apply_edits(
                self.session,
                self.journal,
                edits,
                permit=permit,
                confirmed=self.marks.confirmed,
                progress=self._progress,
                ask_after_failure=True,
                gate=self._gate,
            )
            staging.take_left((*applied.left.requested, *held_back))
            self.applied = applied
            self._applied(applied)
            self._count_again()
            return _summary(applied, [edit.code for edit in staging.edits])

        self._run(work, stamp, self._cut_short)

    def _progress(self, done: int, count: int, result: Result) -> None:
        self.staging.take_result(result)
        self._say(f"{done} of {count}: {result.edit.code} {result.outcome}", OutcomeKind.WORKING)

    def _applied(self, applied: Applied) -> None:
        self._mark(self.marks.edited([result.edit.code for result in applied.written]))
        self.waits_for_reset |= set(applied.after_reset)
        self.moved = next((link for link in applied.links if link.at_once), None)

    def _cut_short(self) -> str:
        """After a stop, unstage what the drive holds, and keep the rest."""
        done = self.staging.drop_written()
        self._mark(self.marks.edited([result.edit.code for result in done]))
        with suppress(LineError):
            self.session.line.spawn(self._see_what_is_held, f"edits {self.session.device}")
        left = len(self.staging.edits)
        return f"{done_text(done) or 'Nothing written.'} {left} still staged." if left else ""

    async def _see_what_is_held(self) -> None:
        """Read the edit that a stop has interrupted: its result is not known."""
        with suppress(LineError, DriveError):
            codes = [edit.code for edit in self.staging.edits]
            await RetryingReader(self.session).ask(codes)
            self.staging.drop_held()

    def _was_reset(self) -> None:
        """Clear the lists of values that wait for a reset or for saving."""
        if self.waits_for_reset or self.unsaved:
            lost = ", ".join(sorted(self.unsaved))
            unsaved = [f"These settings were not saved, so check them: {lost}."] if lost else []
            text = " ".join(["The drive was reset or switched off.", *unsaved])
            self._say(text, OutcomeKind.DONE)
        self.waits_for_reset = set()
        self.session.unsaved_settings.clear()

    def save(self, stamp: int | None = None) -> None:
        """Copy the settings to the EEPROM, if the family needs that."""

        async def work(permit: Permit) -> str:
            done = await save_to_eeprom(self.session, self.journal, permit, self._gate)
            self.session.unsaved_settings.clear()
            self._count_again()
            return done

        self._run(work, stamp)

    def factory(self, stamp: int | None = None) -> None:
        """Restore the factory settings."""

        async def work(permit: Permit) -> str:
            confirmed = self.marks.confirmed
            self.session.unsaved_settings.forget_values()
            done = await factory_reset(self.session, self.journal, permit, confirmed=confirmed)
            self.values.start()
            return done

        self._run(work, stamp)

    def _run(
        self,
        work: Callable[[Permit], Coroutine[Any, Any, str]],
        stamp: int | None,
        given_up: Callable[[], str] | None = None,
    ) -> None:
        """Queue work on the drive; report a refusal as the outcome."""
        queue = self.session.work
        if queue.busy:
            self._say("Another command is in progress. Wait until it ends.", OutcomeKind.REFUSED)
            return
        try:
            queue.put(Task(work, owner=self, given_up=given_up), stamp)
        except OrderRefused as refused:
            self._say(str(refused), OutcomeKind.REFUSED)

    def _say(self, text: str, kind: OutcomeKind) -> None:
        self.session.work.report(kind, text)


def _summary(applied: Applied, staged: Sequence[str]) -> str:
    """Describe the result of all edits, and the edits that stay staged."""
    failed = [result.edit.code for result in applied.results if not result.done]
    nothing = "Not known if written." if applied.unknown else "Nothing written."
    parts = [done_text(applied.written) or nothing]
    if left := list(dict.fromkeys((*failed, *staged))):
        parts.append(f"{len(left)} still staged: {first_of(left, LEFT_NAMED)}.")
    parts += [link.text for link in applied.links]
    if applied.after_reset:
        parts.append(f"Takes effect after a reset of the drive: {', '.join(applied.after_reset)}.")
    return " ".join(parts)
