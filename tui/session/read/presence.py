"""The read that every drive of a family answers.

It shows that the drive is present, and keeps its communication timeout from expiring.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.bus.keep_alive import KeepAlive
from tui.drive.chart import watched_codes
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import Parameter
from tui.drive.values import word_count

from ..drive import DriveSession

UNKNOWN_TIMEOUT = 2.0
"""Seconds assumed for a communication timeout that a drive refuses to report."""


@dataclass(frozen=True, slots=True)
class PresenceRead:
    """Read that shows whether a drive is present."""

    address: int
    count: int
    function: Literal[1, 2, 3, 4]


def presence_read(profile: Profile) -> PresenceRead | None:
    """Return the read that every drive of the family answers; None if none is known.

    If the family does not answer reads of missing words, it covers two words of the monitoring
    set. A late reply to a one-word read has another length, so it cannot be taken for this reply.
    """
    pair = _neighbors(profile) if meets_silence(profile) else None
    if pair is not None:
        return PresenceRead(pair.address, 2, pair.function)
    code = next(iter(watched_codes(profile)), profile.data.faults.parameter)
    word = profile[code] if code else profile.quantity("status_word")
    return None if word is None else PresenceRead(word.address, 1, word.function)


def alive_read(session: DriveSession, timeout: float) -> KeepAlive | None:
    """Return the keep-alive read for a timeout in seconds; None if no read is known."""
    ask = presence_read(session.profile)
    if ask is None:
        return None
    return KeepAlive(session.device, timeout, ask.address, ask.count, ask.function)


async def look_for_drive(session: DriveSession, met: NoAnswer) -> None:
    """Check whether the drive is present, after another read met no answer (`met`).

    If it answers, the line keeps polling it. Raises the line's errors, and `met` if the family
    has no such read.
    """
    ask = presence_read(session.profile)
    if ask is None:
        raise met
    await session.line.read(
        session.device,
        ask.address,
        ask.count,
        priority=Priority.OPERATOR_READ,
        function=ask.function,
    )


def meets_silence(profile: Profile) -> bool:
    """Return True if a read of a word that a drive does not have is not answered at all."""
    function = profile.function(3)
    return function is not None and function.past_limit == "silence"


def _neighbors(profile: Profile) -> Parameter | None:
    """Return the first of two adjacent, documented words of the monitoring set; None if none."""
    codes = [value.parameter for value in profile.data.monitoring.values]
    words = {
        parameter.place: parameter
        for parameter in (profile[code] for code in codes)
        if word_count(parameter) == 1 and is_verified(parameter)
    }
    pairs = ((word, words.get(word.place + 1)) for word in words.values())
    found = (
        parameter
        for parameter, next_to in pairs
        if next_to and next_to.function == parameter.function
    )
    return next(found, None)
