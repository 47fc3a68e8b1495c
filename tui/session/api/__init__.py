"""A line and its drives for scripts: open, read, watch, write, stop. docs/api.md explains how.

Each call waits until it is done, from any thread. What goes wrong is raised: LineError by the
line, DriveError by the drive, its profile, or a check from here.
"""

from tui.bus.errors import LineError
from tui.drive.errors import DriveError

from ..settings.typed import WouldRound
from .drive import Drive
from .line import DriveLine, open_drives
from .values import DriveValue, NotStopped, NotWritten, Sample

__all__ = [
    "Drive",
    "DriveError",
    "DriveLine",
    "DriveValue",
    "LineError",
    "NotStopped",
    "NotWritten",
    "Sample",
    "WouldRound",
    "open_drives",
]
