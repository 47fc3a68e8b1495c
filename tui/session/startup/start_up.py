"""One start-up of one drive: its steps, its results, what has changed; sends nothing."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from getpass import getuser
from pathlib import Path

from tui.drive.settings.writable import is_setting
from tui.drive.shown import shown

from ..drive import DriveSession
from .guide import Guide, find_guide, read_guide
from .judging import StepFacts, StepRow, setting_raws, step_rows, why_not_done
from .progress import (
    StartUpProgress,
    StepRecord,
    progress_file,
    read_progress,
    save_progress,
    set_aside,
)
from .steps import GuideStep


class SettingChanges:
    """Compares the settings of all steps before and after a gap: a restart, or a lost line."""

    def __init__(self, session: DriveSession) -> None:
        self.session = session
        self.texts: tuple[str, ...] = ()
        """Changed settings: code, old value, new value."""
        self._gap = True
        """True until all values are read again after a start or a lost line."""

    def lost(self) -> None:
        """Note that the drive does not answer: its settings may change unseen."""
        self._gap = True

    @property
    def needs_all(self) -> bool:
        """True if every value must be read, to find the changes."""
        return self._gap

    def take(self, seen: dict[str, int], raws: Mapping[str, int], *, whole: bool) -> bool:
        """Compare raw values with those in `seen`, and put them there; return True if it changed.

        After a gap, only a `whole` read of all steps counts.
        """
        profile = self.session.profile
        settings = {c: raw for c, raw in raws.items() if is_setting(profile, profile[c])}
        different = [code for code, raw in settings.items() if seen.get(code) != raw]
        if self._gap and not whole:
            return False
        if self._gap:
            self._gap = False
            known = (code for code in different if code in seen)
            self.texts += tuple(self._text(code, seen[code], settings) for code in known)
        seen |= settings
        return bool(different)

    def _text(self, code: str, old: int, raws: Mapping[str, int]) -> str:
        profile = self.session.profile
        before = shown(profile, profile[code], old, raws).display
        return f"{code} {before} → {shown(profile, profile[code], raws[code], raws).display}"


NOT_SAVED = "NOT SAVED: {error}. Results are kept while the panel runs."
DAMAGED = "The stored progress was damaged. It was kept as {name}; this start-up begins again."
BEGUN_AGAIN = "Begun again. The former results are kept as {name}."
DEFICIENCY_STAYS = "A deficiency stays open until it is tested again. Use the row 'Tested again'."
MOST_LOST = 1e9


class StartUp:
    """The present step, its rows, and all results; each change is saved at once.

    It is made and changed on one thread.
    """

    def __init__(self, session: DriveSession, line: str, guide: Guide, own: str = "") -> None:
        """`line` is as typed; `own` is the path of the steps if a person opened their file."""
        self.session = session
        self.guide = guide
        self.row = 0
        """Row under the cursor."""
        self.trouble = ""
        """Why results are not on disk; empty if they are."""
        self.notice = ""
        """A fact to report once, such as a damaged file."""
        self.changes = SettingChanges(session)
        self._file = progress_file(session, line)
        self.progress = self._stored() or self._new()
        self.progress.guide = own
        self.resumed = bool(self.progress.saved)

    def _stored(self) -> StartUpProgress | None:
        found = read_progress(self._file)
        if found is None:
            try:
                if (aside := set_aside(self._file, ".damaged")) is not None:
                    self.notice = DAMAGED.format(name=aside.name)
            except OSError as error:
                self.trouble = NOT_SAVED.format(error=error.strerror or error)
        return found

    def _new(self) -> StartUpProgress:
        identity = self.session.known_identity
        drive = identity.reference or self.session.profile.name
        return StartUpProgress(begun=self._now(), drive=drive)

    def _now(self) -> str:
        wall = self.session.clock.wall()
        return datetime.fromtimestamp(wall).astimezone().isoformat(timespec="milliseconds")

    # The present step

    @property
    def index(self) -> int:
        """Place of the present step; the first open one if the stored name is unknown."""
        names = [step.step for step in self.guide.steps]
        if self.progress.at in names:
            return names.index(self.progress.at)
        return 0

    @property
    def step(self) -> GuideStep:
        """The present step."""
        return self.guide.steps[self.index]

    @property
    def record(self) -> StepRecord:
        """Result of the present step."""
        return self.progress.record(self.step.step)

    @property
    def rows(self) -> list[StepRow]:
        """Rows of the present step."""
        return step_rows(self.step, self.record)

    @property
    def chosen(self) -> StepRow:
        """The row under the cursor."""
        rows = self.rows
        self.row = max(0, min(self.row, len(rows) - 1))
        return rows[self.row]

    @property
    def since(self) -> float:
        """Monotonic time from which a run counts: after the start, or after a deficiency."""
        record = self.record
        text = record.time if record.state == "deficient" else self.progress.begun
        clock = self.session.clock
        ago = clock.wall() - datetime.fromisoformat(text).timestamp()
        return clock.monotonic() - min(max(ago, 0.0), MOST_LOST)

    def newest_before(self) -> float:
        """Return when an earlier step or the start-up last changed, in seconds since 1970."""
        earlier = (self.progress.record(step.step).time for step in self.guide.steps[: self.index])
        times = [text for text in (self.progress.begun, *earlier) if text]
        return max(datetime.fromisoformat(text).timestamp() for text in times)

    def go(self, steps: int) -> None:
        """Go forward or back by so many steps."""
        at = max(0, min(len(self.guide.steps) - 1, self.index + steps))
        self._go_to(at)

    def go_on(self) -> None:
        """Go to the next step that is not done or skipped; stay if there is none."""
        count = len(self.guide.steps)
        following = [(self.index + offset) % count for offset in range(1, count)]
        states = {at: self.progress.record(self.guide.steps[at].step).state for at in following}
        at = next((at for at in following if states[at] in ("open", "deficient")), self.index)
        self._go_to(at)

    def _go_to(self, at: int) -> None:
        if at != self.index or not self.progress.at:
            self.progress.at, self.row = self.guide.steps[at].step, 0
            self._save()

    # Results

    def enter(self, key: str, text: str) -> None:
        """Record an entry; a step that was done or skipped is open again."""
        record = self._writable()
        record.entries[key] = text
        if record.state in ("done", "skipped"):
            record.past.append(f"{record.time} {record.state}, then changed: {key}")
            record.state, record.text = "open", ""
        self._stamp(record)

    def finish(self, facts: StepFacts) -> str:
        """Mark the step as done, or return what prevents that."""
        if why := why_not_done(self.step, self.record, facts):
            return why
        record = self._writable()
        record.state, record.text = "done", ""
        record.raws = setting_raws(self.step, facts)
        self._stamp(record)
        return ""

    def note_deficiency(self, text: str) -> None:
        """Record a deficiency; what was measured must be measured again."""
        record = self._writable()
        self._stamp(record, save=False)
        measured = ", ".join(f"{key} {entry}" for key, entry in record.entries.items())
        record.past.append(f"{record.time} deficient: {text} ({measured or 'no entries'})")
        record.state, record.text, record.entries = "deficient", text, {}
        self._save()

    def skip(self, reason: str) -> str:
        """Skip the step, or return why it cannot be skipped."""
        if self.record.state == "deficient":
            return DEFICIENCY_STAYS
        record = self._writable()
        record.state, record.text = "skipped", reason
        self._stamp(record)
        return ""

    def _writable(self) -> StepRecord:
        return self.progress.steps.setdefault(self.step.step, StepRecord())

    def _stamp(self, record: StepRecord, *, save: bool = True) -> None:
        record.time = self._now()
        try:
            record.by = getuser()
        except (KeyError, OSError):
            record.by = ""
        if save:
            self._save()

    def _save(self) -> None:
        self.progress.saved = self._now()
        try:
            save_progress(self._file, self.progress)
        except OSError as error:
            self.trouble = NOT_SAVED.format(error=error.strerror or error)
        else:
            self.trouble = ""

    def counts(self) -> dict[str, int]:
        """Return the number of steps by state."""
        found = dict.fromkeys(("done", "skipped", "deficient", "open"), 0)
        for step in self.guide.steps:
            found[self.progress.record(step.step).state] += 1
        return found

    def take(self, raws: Mapping[str, int], *, whole: bool) -> None:
        """Take current values; `whole` if every value of all steps was read."""
        changed = self.changes.take(self.progress.seen, raws, whole=whole)
        if changed and self.progress.steps:  # nothing is stored for a drive that was only shown
            self._save()


def open_start_up(session: DriveSession, line: str, own: Path | None = None) -> StartUp:
    """Begin or resume the start-up of a drive on a line as typed.

    A person's `own` file of steps replaces that of the family, and is kept when it is resumed.
    Reads the disk. Raises ProfileError.
    """
    stored = read_progress(progress_file(session, line))
    path = own or (Path(stored.guide) if stored is not None and stored.guide else None)
    if path is not None:
        return StartUp(session, line, read_guide(path, session.profile), str(path))
    return StartUp(session, line, find_guide(session.profile))


def begin_again(former: StartUp, line: str) -> StartUp:
    """Begin the same steps for another drive on a line as typed; keep the results so far.

    Raises OSError.
    """
    aside = set_aside(progress_file(former.session, line), ".past")
    again = StartUp(former.session, line, former.guide, former.progress.guide)
    if aside is not None:
        again.notice = BEGUN_AGAIN.format(name=aside.name)
    return again
