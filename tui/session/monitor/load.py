"""Motor current as a share of the rated current, from values of the drive."""

from __future__ import annotations

from tui.drive.profile.profile import Profile
from tui.drive.shown import number_of

from ..drive import DriveSession
from ..reading import reading_of
from ..shown import Shown


def _limit(profile: Profile) -> str:
    """Return the upper limit of the current: a number, or the code of its parameter."""
    current = profile.quantity("motor_current")
    values = profile.data.monitoring.values
    return next((v.high for v in values if current and v.parameter == current.code), "")


def unread_limit(session: DriveSession) -> list[str]:
    """Return the code of the rated current if it was neither read nor refused yet."""
    code, image = _limit(session.profile), session.image
    if session.profile.get(code) is None or code in image.raws or code in image.refused:
        return []
    return [code]


def share_of_limit(session: DriveSession, current: Shown | None) -> float | None:
    """Return the motor current divided by its limit; None if one of them is not known."""
    limit = _limit_number(session)
    if current is None or not limit:
        return None
    number = reading_of(current).number
    return None if number is None else number / limit


def _limit_number(session: DriveSession) -> float | None:
    profile, raws = session.profile, session.image.raws
    limit = _limit(profile)
    parameter = profile.get(limit)
    if parameter is None:
        try:
            return float(limit)
        except ValueError:
            return None
    raw = raws.get(parameter.code)
    if raw is None:
        return None
    number = number_of(profile, parameter, raw, raws)
    return None if number is None else float(number)
