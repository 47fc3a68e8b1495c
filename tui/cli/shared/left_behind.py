"""Motors whose program has exited and that no program commands, by the records of starts."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, NamedTuple, TypedDict

if TYPE_CHECKING:
    from tui.drive.profile.schema import StateKind
    from tui.session.drive import DriveSession
    from tui.session.starts.record import StartRecord


class LeftBehindFields(TypedDict):
    """The fields that `status` and `lines` print."""

    program: str
    pid: int
    exited: bool
    left_running: bool
    since: str
    text: str


class LeftBehind(NamedTuple):
    """A recorded start, and its meaning now."""

    record: StartRecord
    exited: bool
    """False if its program is frozen, or has left the line."""
    text: str
    """Sentences about the motor and its program."""

    def advice(self, line_text: str) -> str:
        """Both ways to deal with it, as commands for a line."""
        drive = f"{shlex.quote(line_text)} -d {self.record.device}"
        return (
            f"Stop it: drivepanel stop {drive}. Take it over: drivepanel {drive}, then a, and T on"
            " Monitor."
        )

    def sentence(self, line_text: str) -> str:
        """Return the program that started it, and the advice."""
        return f"{self.text} {self.advice(line_text)}"

    def fields(self) -> LeftBehindFields:
        """The fields of a document."""
        record = self.record
        return {
            "program": record.program,
            "pid": record.pid,
            "exited": self.exited,
            "left_running": record.left_running,
            "since": record.wall,
            "text": self.text,
        }


def left_behind(session: DriveSession, motion: StateKind) -> LeftBehind | None:
    """The motor of a drive, if its program has exited and no program commands it; reads files.

    If the drive is in a state of standstill, the start is recorded no longer.
    """
    from tui.drive.chart import ENABLED_KINDS
    from tui.session.starts.keeper import pids_absent
    from tui.session.starts.record import offer
    from tui.session.starts.starts import Starts

    facts, starts = session.line.facts, Starts()
    runs = None if motion == "unknown" else motion in ENABLED_KINDS
    if runs is False:
        forget_start(session)
        return None
    if facts.commander(session.device) is not None:
        return None
    record = starts.found(session.line_text, session.device, pids_absent(facts))
    if record is None:
        return None
    lives = starts.is_alive(record)
    text = offer(record, session.identity, runs, lives=lives)
    return LeftBehind(record, not lives, text) if text else None


def forget_start(session: DriveSession) -> None:
    """Remove the record of a start whose program has exited: the motor was seen at standstill."""
    from tui.session.starts.starts import Starts

    starts = Starts()
    starts.end(session.line_text, session.device)
    starts.close()


def left_on_lines() -> list[LeftBehind]:
    """Every motor that may run so, on any line but simulated ones; reads files, asks no drive."""
    from tui.session.connect.line_key import SIMULATED_PREFIX, line_key
    from tui.session.starts.files import start_records
    from tui.session.starts.record import offer
    from tui.session.starts.starts import Starts

    starts = Starts()
    lines = {line_key(item.line): item.line for item in start_records(None).records()}
    found = [
        record
        for _, line in sorted(lines.items())
        if not line.casefold().startswith(SIMULATED_PREFIX)
        for record in starts.all_found(line)
    ]
    return [LeftBehind(item, True, offer(item, None, None)) for item in found]
