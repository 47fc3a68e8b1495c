"""Share of its rated current that a motor draws, from values of its drive."""

from __future__ import annotations

from tui.drive.profile.profile import Profile
from tui.drive.shown import number_of

from ..drive import DriveSession
from ..reading import reading_of
from ..shown import Shown


def _limit(profile: Profile) -> str:
    """The end of the current's bar: a number, or the code of the parameter that holds it."""
    current = profile.quantity("motor_current")
    values = profile.data.monitoring.values
    return next((v.high for v in values if current and v.parameter == current.code), "")


def unread_limit(session: DriveSession) -> list[str]:
    """The parameter that holds the rated current, while it was neither read nor refused."""
    code, image = _limit(session.profile), session.image
    if session.profile.get(code) is None or code in image.raws or code in image.refused:
        return []
    return [code]


def share_of_limit(session: DriveSession, current: Shown | None) -> float | None:
    """The motor current over its limit, 1 where they are the same; None where one is not known."""
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
