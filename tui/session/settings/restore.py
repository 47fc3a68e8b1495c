"""Restore of a parameter set to a drive: planned, written, and planned again.

Progress is known only from the drive, never from a file. So an interrupted restore is resumed by
starting it again. A mark in the state folder only shows that one was interrupted.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tui.bus.errors import LineError, RequestRefused
from tui.drive.profile.profile import Profile
from tui.drive.settings.edits import Edits
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.settings.restore_plan import NO_OPTIONS, Held, Options, RestorePlan
from tui.drive.settings.restore_planner import plan_restore
from tui.drive.settings.writable import waits_for_reset

from ..drive import DriveSession
from ..journal import Journal, now_text
from ..paths import state_folder
from ..read.upload import ReadProgress, Upload, setting_codes
from ..stored import store_json, stored_json
from ..work import Permit
from .applied import Applied, LinkChange, Result, WriteProgress
from .apply import apply_edits
from .wear import WearGate

PASSES = 5
"""Maximum number of planning passes: some settings change others when written."""


@dataclass(frozen=True, slots=True)
class Restored:
    """Result of a restore."""

    plan: RestorePlan
    """The plan at the beginning."""
    results: tuple[Result, ...]
    """The last result of each parameter, in the order of writing."""
    left: Edits
    """Settings that the drive does not hold yet."""
    links: tuple[LinkChange, ...]
    after_reset: tuple[str, ...]
    unsaved: tuple[str, ...]
    stopped: str
    """Why it ended early; empty if it finished."""
    unseen: str = ""
    """Why the drive could not be read again after writing; empty if it could."""

    @property
    def complete(self) -> bool:
        """True if the drive holds all planned values."""
        return not self.stopped and not len(self.left)


async def held_by(session: DriveSession, reading: ReadProgress | None = None) -> Held:
    """Read the settings of the set from the drive. Raises the line's errors."""
    upload = Upload(session, setting_codes(session.profile), reading)
    await upload.run()
    reference = session.identity.reference if session.identity is not None else ""
    return Held(upload.raws, upload.absent, session.image.lacking, reference)


async def restore_set(
    session: DriveSession,
    journal: Journal,
    source: ParameterSet,
    source_profile: Profile,
    options: Options = NO_OPTIONS,
    *,
    permit: Permit,
    progress: WriteProgress | None = None,
    reading: ReadProgress | None = None,
    gate: WearGate | None = None,
) -> Restored:
    """Write the settings that differ, read them back, and plan again until none differs.

    `gate` decides about frequent writes to EEPROM (default: they are refused).

    Raises the line's errors as long as nothing was written.
    """
    if session.line.read_only:
        raise RequestRefused("The line is read-only: nothing is written.")
    plan = await plan_for(session, source, source_profile, options, reading)
    first, results = plan, dict[str, Result]()
    links: list[LinkChange] = []
    mark = Mark.of(session)
    if len(plan.edits):
        mark.begin(source, len(plan.edits))
    stopped, unseen, left = "", "", plan.edits
    for number in range(PASSES):
        if not len(left):
            break
        try:
            applied = await _one_pass(session, journal, plan, options, permit, progress, gate)
            results.update({result.edit.code: result for result in applied.results})
            links += applied.links
            stopped, left = applied.stopped, applied.left
            if stopped or not applied.written:
                break
            plan = await plan_for(session, source, source_profile, options, reading)
        except LineError as error:
            if not number and not results:
                raise
            stopped = unseen = str(error)
            break
        left = plan.edits
    if not stopped and not len(left):
        mark.end()
    done = [code for code, result in results.items() if result.done]
    parameters = [session.profile[code] for code in done]
    return Restored(
        plan=first,
        results=tuple(results.values()),
        left=left,
        links=tuple(links),
        after_reset=tuple(p.code for p in parameters if waits_for_reset(session.profile, p)),
        unsaved=tuple(code for code in done if code in session.unsaved),
        stopped=stopped,
        unseen=unseen,
    )


async def plan_for(
    session: DriveSession,
    source: ParameterSet,
    source_profile: Profile,
    options: Options = NO_OPTIONS,
    reading: ReadProgress | None = None,
) -> RestorePlan:
    """Read the drive and plan a restore; write nothing."""
    held = await held_by(session, reading)
    return plan_restore(session.profile, held, source, source_profile, options)


async def _one_pass(
    session: DriveSession,
    journal: Journal,
    plan: RestorePlan,
    options: Options,
    permit: Permit,
    progress: WriteProgress | None,
    gate: WearGate | None,
) -> Applied:
    return await apply_edits(
        session,
        journal,
        plan.edits,
        confirmed=options.confirmed,
        permit=permit,
        why="restore",
        progress=progress,
        gate=gate,
    )


@dataclass(frozen=True, slots=True)
class Mark:
    """A file in the state folder that exists while a restore of a drive is not complete."""

    path: Path

    @classmethod
    def of(cls, session: DriveSession) -> Mark:
        """Return the mark of this drive on this line."""
        name = f"{session.line_text}-{session.device}-{session.profile.id}"
        safe = re.sub(r"[^A-Za-z0-9]+", "-", name)
        return cls(state_folder() / f"restore-{safe}.json")

    @property
    def interrupted(self) -> str:
        """Describe a restore that did not finish; empty if there is none."""
        reported = stored_json(self.path)
        if not isinstance(reported, dict) or not {"begun", "parameters", "set"} <= set(reported):
            return ""
        begun, of, taken = (str(reported[key])[:60] for key in ("begun", "parameters", "set"))
        return (
            f"A restore of {of} settings (parameter set of {taken}) began at {begun} and did not"
            " finish. The drive is read, and the missing values are written."
        )

    def begin(self, source: ParameterSet, count: int) -> None:
        """Create the mark; an error of the folder does not stop the restore."""
        reported = {
            "begun": now_text(),
            "parameters": count,
            "set": source.head.time or "unknown time",
        }
        with suppress(OSError):
            store_json(self.path, reported)

    def end(self) -> None:
        """Remove the mark."""
        try:
            self.path.unlink(missing_ok=True)
        except OSError:
            return
