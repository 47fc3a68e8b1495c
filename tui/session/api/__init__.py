"""A line and its drives for scripts: open, read, watch, write, stop. docs/api.md explains how.

Each call waits until it is done, in any thread or asyncio loop. Errors are raised: LineError by the
line, DriveError by the drive, its profile, or a check of this package.
"""

from tui.bus.errors import LineError
from tui.drive.errors import DriveError

from ..running.ending import MotorStopped, MotorTripped, NotStopped
from ..settings.typed import WouldRound
from .drive import AsyncDrive, Drive
from .line import AsyncDriveLine, DriveLine, open_drives, open_drives_async
from .running_motor import AsyncRunningMotor, RunningMotor
from .values import DriveValue, NotWritten, Sample

__all__ = [
    "AsyncDrive",
    "AsyncDriveLine",
    "AsyncRunningMotor",
    "Drive",
    "DriveError",
    "DriveLine",
    "DriveValue",
    "LineError",
    "MotorStopped",
    "MotorTripped",
    "NotStopped",
    "NotWritten",
    "RunningMotor",
    "Sample",
    "WouldRound",
    "open_drives",
    "open_drives_async",
]
