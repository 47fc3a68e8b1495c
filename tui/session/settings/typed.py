"""Typed settings, staged with the current values of the drive."""

from __future__ import annotations

from collections.abc import Sequence

from tui.drive.errors import ValueRefused
from tui.drive.sentences import sentence
from tui.drive.settings.edits import Edits
from tui.drive.shown import scale_sources

from ..drive import DriveSession
from ..read.retrying_reader import RetryingReader


class WouldRound(ValueRefused):
    """The drive can hold a typed value only after rounding it."""


async def stage_typed(
    session: DriveSession, pairs: Sequence[tuple[str, str]], *, rounded: bool = False
) -> tuple[Edits, RetryingReader]:
    """Stage the values typed for codes; return the edits, and the reader with the values of the
    drive.

    Raises WouldRound if a value would be rounded and `rounded` is False. Raises ValueRefused,
    UnknownParameter, and the line's errors.
    """
    profile = session.profile
    codes = [code for code, _ in pairs]
    sources = scale_sources(profile)
    follow = [p.code for p in profile.parameters if p.scale_source and set(codes) & sources]
    retrying = RetryingReader(session)
    await retrying.ask_many(codes + sorted(sources) + follow)
    edits = Edits()
    # scale sources first: a typed ramp applies with the new scale
    for code, value in sorted(pairs, key=lambda pair: pair[0] not in sources):
        if profile[code].access == "r":
            raise ValueRefused(f"{code} can only be read.")
        edits = edits.stage(profile, code, value, retrying.raws, retrying.lacking)
    if not rounded and (losses := [edit.loss for edit in edits.requested if edit.loss]):
        raise WouldRound(" ".join(sentence(loss) for loss in losses))
    return edits, retrying
