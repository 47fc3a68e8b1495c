"""Errors of a run: its motor was stopped before the end, or could not be stopped."""

from __future__ import annotations

from tui.drive.errors import DriveError


class MotorStopped(DriveError):
    """A motor was stopped, but not by the end of its run; it is not started again."""


class MotorTripped(MotorStopped):
    """A motor was stopped by a fault of its drive."""


class NotStopped(DriveError):
    """A motor could not be stopped by this program: stop it at the machine."""
