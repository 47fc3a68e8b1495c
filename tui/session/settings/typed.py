"""Settings that were typed, staged against what the drive holds now."""

from __future__ import annotations

from collections.abc import Sequence

from tui.drive.errors import ValueRefused
from tui.drive.settings.edits import Edits
from tui.drive.shown import scale_sources

from ..drive import DriveSession
from ..read.retrying_reader import RetryingReader


class WouldRound(ValueRefused):
    """A value that the drive can hold only as another one."""


async def stage_typed(
    session: DriveSession, pairs: Sequence[tuple[str, str]], *, rounded: bool = False
) -> tuple[Edits, RetryingReader]:
    """The edits of codes with the values typed for them, and what was read of the drive for that.

    Raises WouldRound where a value would be rounded to another one and `rounded` is not given,
    ValueRefused, UnknownParameter, and the line's errors.
    """
    profile = session.profile
    codes = [code for code, _ in pairs]
    sources = scale_sources(profile)
    follow = [p.code for p in profile.parameters if p.scale_by and set(codes) & sources]
    retrying = RetryingReader(session)
    await retrying.ask_many(codes + sorted(sources) + follow)
    edits = Edits()
    # scale sources first: what is typed for a ramp holds under the new scale
    for code, value in sorted(pairs, key=lambda pair: pair[0] not in sources):
        if profile[code].access == "r":
            raise ValueRefused(f"{code} can only be read.")
        edits = edits.stage(profile, code, value, retrying.raws, retrying.lacking)
    if not rounded and (losses := [edit.loss for edit in edits.requested if edit.loss]):
        raise WouldRound(f"{'; '.join(losses)}.")
    return edits, retrying
