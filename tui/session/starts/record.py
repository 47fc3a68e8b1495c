"""Record of a motor start, and what a later program can report about the motor."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Literal

from tui.bus.program import pid_namespace

if TYPE_CHECKING:
    from ..connect.identify import DriveIdentity
from pathlib import Path

from tui.bus.program import ProcessKey
from tui.drive.errors import DriveError


@dataclass(frozen=True, slots=True)
class StartRecord:
    """A motor start: line, drive, program, time."""

    line: str
    """As it was typed; compare it by `line_key`."""
    device: int
    profile: str
    """Id of the profile with which it was started."""
    vendor: str
    reference: str
    version: str
    name: str
    """Name that the drive reports, as the three fields above; empty if none."""
    order: Literal["forward", "reverse"]
    boot_id: str
    pid: int
    started: str
    """Start time of the process, from `Processes.started`."""
    program: str
    """Such as `panel` or `run`."""
    left_running: bool
    """True if the motor must keep running when the program ends."""
    wall: str
    """Time of the start: ISO with zone, to the millisecond."""
    guessed: bool = False
    """True if the profile was a guess, so that it does not identify the drive's family."""
    acts_after: float | None = None
    """Seconds of the drive's communication timeout, if it was known."""

    space: str = ""
    """The PID namespace of `pid`; empty in older records, and if the system has none."""

    @property
    def process(self) -> ProcessKey:
        """PID namespace and PID of its program."""
        return self.space or pid_namespace(), self.pid

    @property
    def is_foreign(self) -> bool:
        """True if its program ran in another PID namespace, where this one cannot see it."""
        return self.process[0] != pid_namespace()

    @property
    def begun(self) -> datetime | None:
        """Time of the start in the local zone; None if the text is not a time."""
        try:
            return datetime.fromisoformat(self.wall).astimezone()
        except (ValueError, OverflowError):
            return None


RUNNING_SINCE = {
    (True, True): "Running since {since}.",
    (True, False): "Running.",
    (False, True): "May be running since {since}.",
    (False, False): "May be running.",
}
"""By whether it is seen to run, and whether the time of its start is known."""
STARTED_BY = {
    (False, False): "Started by {name}, process {pid}, which has exited.",
    (False, True): "Started by {name}, process {pid}, which does not answer on this line.",
    (True, False): "Left running on purpose by {name}, process {pid}, which has exited.",
    (True, True): "Left running on purpose by {name}, process {pid}, which does not answer on this"
    " line.",
}
"""By whether it was left running on purpose, and whether its program lives."""


def offer(
    record: StartRecord,
    identity: DriveIdentity | None,
    runs: bool | None,
    now: datetime | None = None,
    *,
    lives: bool = False,
) -> str:
    """Describe a motor whose program has exited, and that no program commands.

    `runs` is None if its state is not known. A program that `lives` is frozen, or has left the
    line. Empty if the motor does not run, or if another drive has its address now. A part of the
    identity that is missing on either side counts as equal.
    """
    if runs is False or (identity is not None and not _same(record, identity)):
        return ""
    since = _since(record.begun, now or datetime.now().astimezone())
    state = RUNNING_SINCE[bool(runs), bool(since)].format(since=since)
    program = STARTED_BY[record.left_running, lives].format(name=record.program, pid=record.pid)
    return f"{state} {program} No program commands it."


def _same(record: StartRecord, identity: DriveIdentity) -> bool:
    stated = (
        (record.vendor, identity.vendor),
        (record.reference, identity.reference),
        (record.version, identity.version),
        (record.name, identity.name),
    )
    if identity.device != record.device or any(a and b and a != b for a, b in stated):
        return False
    fitting = {*identity.candidates, identity.profile} - {None}
    return not fitting or not record.profile or record.profile in fitting


def _since(then: datetime | None, now: datetime) -> str:
    if then is None:
        return ""
    then = then.astimezone(now.tzinfo)
    return f"{then:%H:%M}" if then.date() == now.date() else f"{then:%Y-%m-%d %H:%M}"


OVERTAKEN = "a stop came first"


class StartNotRecorded(DriveError):
    """A start could not be recorded, so the motor must not be started."""

    def __init__(self, device: int, folder: Path, reason: str) -> None:
        self.device, self.folder, self.reason = device, folder, reason
        super().__init__(
            f"The start of drive {device} was not recorded in {folder}: {reason}. Without a record,"
            " nothing shows after a crash which program started the motor. Make the folder"
            " writable, or name another one in DRIVEPANEL_STATE."
        )


class StartOvertaken(StartNotRecorded):
    """A stop arrived while the start was being recorded: the motor must not be started."""

    def __init__(self, device: int, folder: Path) -> None:
        super().__init__(device, folder, OVERTAKEN)
        self.args = (f"Not started: a stop of drive {device} came before its start.",)
