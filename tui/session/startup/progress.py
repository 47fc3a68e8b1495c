"""Results of a start-up on disk: one file per drive, complete or unchanged, nothing forgotten."""

from __future__ import annotations

import errno
import hashlib
import re
from datetime import datetime
from pathlib import Path
from typing import Literal

import msgspec

from ..connect.line_key import SIMULATED_PREFIX, line_key
from ..drive import DriveSession
from ..paths import state_folder
from ..stored import store_json, stored_json

PROGRESS_FOLDER = "startup"
BEGUN_ELSEWHERE = "another program has begun this start-up again"
StepState = Literal["open", "done", "skipped", "deficient"]


class StepRecord(msgspec.Struct, kw_only=True):
    """Result of one step."""

    state: StepState = "open"
    text: str = ""
    """Reason of a skip, or the deficiency."""
    by: str = ""
    """Login name of the user of the panel."""
    time: str = ""
    """Local time with its zone of the last change."""
    entries: dict[str, str] = {}
    """Typed or measured, by row."""
    raws: dict[str, int] = {}
    """Settings of the step, by code, at the time it was done."""
    past: list[str] = []
    """Former results, oldest first: each deficiency stays here."""


class StartUpProgress(msgspec.Struct, kw_only=True):
    """Progress of one drive."""

    begun: str
    """Local time with its zone."""
    drive: str
    guide: str = ""
    """File of the steps that a person opened; empty for the file of the family."""
    at: str = ""
    """Name of the present step."""
    seen: dict[str, int] = {}
    """Settings of all steps as they were last read, by code."""
    saved: str = ""
    steps: dict[str, StepRecord] = {}

    def record(self, step: str) -> StepRecord:
        """Return the result of a step; an open one if it has none."""
        return self.steps.get(step) or StepRecord()


def progress_file(session: DriveSession, typed: str) -> Path:
    """Return the file of a drive: by line, address, family and reported identity.

    `typed` is the line as it was opened: a simulated one has another port each time.
    """
    identity = session.known_identity
    simulated = typed.strip().casefold().startswith(SIMULATED_PREFIX)
    line = line_key(typed if simulated else session.line_text)
    parts = (line, str(session.device), session.profile.id, identity.reference, identity.name)
    digest = hashlib.sha256("\0".join(parts).encode("utf-8", "replace")).hexdigest()[:12]
    name = re.sub(r"[^A-Za-z0-9]+", "-", identity.reference or session.profile.id).strip("-")
    return state_folder() / PROGRESS_FOLDER / f"{session.device}-{name[:40]}-{digest}.json"


def read_progress(file: Path) -> StartUpProgress | None:
    """Return the progress in a file; None if there is none or it is damaged."""
    stored = stored_json(file)
    if stored is None:
        return None
    try:
        found = msgspec.convert(stored, StartUpProgress)
        for text in (found.begun, *(record.time for record in found.steps.values())):
            if text:
                datetime.fromisoformat(text)
    except (msgspec.ValidationError, ValueError):
        return None
    return found if found.begun else None


def set_aside(file: Path, suffix: str) -> Path | None:
    """Rename a file, so that it is not overwritten; None if there is none. Raises OSError."""
    if not file.exists():
        return None
    aside = file.with_suffix(suffix)
    for number in range(2, 100):
        if not aside.exists():
            break
        aside = file.with_suffix(f"{suffix}{number}")
    return file.rename(aside)


def save_progress(file: Path, progress: StartUpProgress) -> None:
    """Write the progress; keep newer results of another program.

    Raises OSError, also if another program has begun the start-up again.
    """
    if (other := read_progress(file)) is not None:
        if datetime.fromisoformat(other.begun) > datetime.fromisoformat(progress.begun):
            raise OSError(errno.EEXIST, BEGUN_ELSEWHERE)
        for name, theirs in other.steps.items() if other.begun == progress.begun else ():
            if theirs.time > progress.record(name).time:
                progress.steps[name] = theirs
    store_json(file, msgspec.to_builtins(progress))


RESULT_WORDS = {"open": "not done", "done": "done", "skipped": "skipped", "deficient": "DEFICIENT"}


def start_up_lines(session: DriveSession, line: str) -> list[str]:
    """Return the results of a drive's start-up as Markdown; empty if none is stored.

    `line` is the line as typed.
    """
    progress = read_progress(progress_file(session, line))
    if progress is None or not progress.steps:
        return []
    lines = ["## Start-up", "", f"- Begun: {progress.begun}"]
    lines += [f"- Steps: {progress.guide}"] if progress.guide else []
    for name, record in progress.steps.items():
        text = f": {record.text}" if record.text else ""
        by = f", {record.by}" if record.by else ""
        lines.append(f"- {name}: {RESULT_WORDS[record.state]}{text} ({record.time}{by})")
        lines += [f"  - {key}: {entry}" for key, entry in record.entries.items()]
        lines += [f"  - before: {past}" for past in record.past]
    return lines
