"""High speed of a drive: the highest reference that its own setting allows."""

from __future__ import annotations

from typing import NamedTuple

from ..command.reference import reference_codes, reference_limits
from ..console import DriveConsole


class HighSpeed(NamedTuple):
    """Highest reference of a drive in Hz, and the code of the setting."""

    hertz: float
    code: str


async def read_high_speed(console: DriveConsole) -> HighSpeed | None:
    """Return the high speed of a drive; None if it has none. Raises the line's errors."""
    profile = console.session.profile
    parameter = profile.quantity("command_frequency")
    if parameter is None:
        return None
    readings = await console.read(reference_codes(profile))
    _, high, code = reference_limits(profile, readings, parameter)
    return None if high is None else HighSpeed(float(high), code)
