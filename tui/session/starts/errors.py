"""Errors that prevent the record of a start, and so the start of the motor."""

from __future__ import annotations

from pathlib import Path

from tui.drive.errors import DriveError

OVERTAKEN = "a stop came first"


class StartNotRecorded(DriveError):
    """A start could not be put on record, so the motor is not to be started."""

    def __init__(self, device: int, folder: Path, reason: str) -> None:
        self.device, self.folder, self.reason = device, folder, reason
        super().__init__(
            f"The start of drive {device} was not recorded in {folder}: {reason}. Without a record "
            "it is not known after a crash which program started the motor. Make the folder "
            "writable, or name another one in DRIVEPANEL_STATE."
        )


class StartOvertaken(StartNotRecorded):
    """A stop came while the start was being recorded: the motor is not to be started at all."""

    def __init__(self, device: int, folder: Path) -> None:
        super().__init__(device, folder, OVERTAKEN)
        self.args = (f"A stop of drive {device} came before its start, which is not sent.",)
