"""Results of a start-up as lines of a report."""

from __future__ import annotations

from ..drive import DriveSession
from .progress import progress_file, read_progress

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
