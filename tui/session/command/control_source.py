"""Settings of a drive's control source: each is written and read back."""

from __future__ import annotations

from tui.bus.api import Priority
from tui.drive.control_source import source_changes, source_codes
from tui.drive.orders import OrderRefused
from tui.drive.profile.schema import ControlSource
from tui.drive.values import check_raw

from ..drive import DriveSession
from ..drive_state import drive_state
from ..monitor.rates import monitoring_codes
from ..read.reader import Reader
from ..settings.write import Writer


async def configure(session: DriveSession, writer: Writer, source: ControlSource) -> str:
    """Write the settings that differ from a control source; return the result as text.

    All are read again before each write, because one setting may change later ones, as the
    access level does. Raises OrderRefused unless the motor is known to be at rest, the line's
    errors, ValueRefused and NotTaken.
    """
    profile = session.profile
    written: list[str] = []
    for setting in source.settings:
        parameter = profile[setting.parameter]
        await _at_rest(session)
        raws = await _raws(session)
        todo = {change.parameter.code for change in source_changes(profile, source, raws)}
        if parameter.code not in todo:
            continue
        scale = profile.scale(parameter, raws)
        check_raw(parameter, setting.value, profile.names(parameter), scale)
        await writer.write_parameter(parameter, setting.value, why=f"control source: {source.name}")
        written.append(parameter.code)
    left = source_changes(profile, source, await _raws(session))
    if left:
        codes = ", ".join(change.parameter.code for change in left)
        raise OrderRefused(f"{source.name}: the drive has changed {codes} again.")
    done = f"wrote {', '.join(written)}" if written else "no change was necessary"
    return f"Control source {source.name}: {done}"


async def _raws(session: DriveSession) -> dict[str, int]:
    codes = source_codes(session.profile)
    readings = await Reader(session).read(codes, priority=Priority.OPERATOR_READ)
    unread = [code for code, reading in readings.items() if reading.raw is None]
    if unread:
        raise OrderRefused(f"{', '.join(unread)} cannot be read, so nothing was changed.")
    return {code: reading.raw for code, reading in readings.items() if reading.raw is not None}


async def _at_rest(session: DriveSession) -> None:
    readings = await Reader(session).read(
        monitoring_codes(session.profile), priority=Priority.OPERATOR_READ
    )
    state = drive_state(session.profile, readings)
    if state.motion in ("running", "stopping", "starting", "unknown"):
        raise OrderRefused(
            "Not written: the control source is changed with the motor stopped only."
            f" Now: {state.headline}."
        )
