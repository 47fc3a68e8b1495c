"""Lengths of the pauses of a test, and conclusions from the completed ones. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

COARSE = (0.25, 0.5, 0.7)
"""Pauses well below the timeout, as shares of it: a shorter timeout shows there."""
FINE_FROM, SILENCE_STEP = 0.82, 0.12
"""Share of the timeout from which pauses grow by the step, so that two differ by at most 300 ms at
2 s."""
LATEST_FINE = 1.3
PAST_TIMEOUT = (1.6, 2.2, 3.0)
"""Pauses longer than the timeout, as shares of it; none longer is tried."""
LONGEST_SILENCE = 90.0
"""Longest pause in seconds, unless the timeout itself requires a longer one."""
LONGEST_SHARE = 1.6
"""Longest pause as a share of a long timeout."""
TIMEOUT_TOLERANCE, LEAST_TIMEOUT_TOLERANCE = 0.05, 0.05
"""Share of the timeout, and seconds, by which a drive may react earlier or later."""


def silences(timeout: float) -> Iterator[float]:
    """Seconds of each pause, growing around the configured timeout."""
    shares = list(COARSE)
    share = FINE_FROM
    while share < LATEST_FINE:
        shares.append(round(share, 3))
        share += SILENCE_STEP
    longest = max(LONGEST_SILENCE, LONGEST_SHARE * timeout)
    yield from dict.fromkeys(min(value * timeout, longest) for value in (*shares, *PAST_TIMEOUT))


@dataclass(frozen=True, slots=True)
class Bracket:
    """The two pauses, in seconds, between which a drive reacted."""

    not_before: float = 0.0
    """The longest pause without a reaction."""
    not_after: float | None = None
    """The shortest pause with a reaction; None if it never reacted."""

    def alive(self, silence: float) -> Bracket:
        """Return the bracket with a pause of so many seconds that caused no reaction."""
        return Bracket(max(self.not_before, silence), self.not_after)

    def reacted(self, silence: float) -> Bracket:
        """Return the bracket with a pause of so many seconds that caused a reaction."""
        return Bracket(self.not_before, max(silence, self.not_before))

    @property
    def measured(self) -> float | None:
        """The middle of the bracket; None if the drive did not react."""
        return None if self.not_after is None else (self.not_before + self.not_after) / 2

    def holds(self, timeout: float) -> bool:
        """Return True if a configured timeout agrees with the measurement."""
        if self.not_after is None:
            return False
        slack = max(TIMEOUT_TOLERANCE * timeout, LEAST_TIMEOUT_TOLERANCE)
        return self.not_before - slack <= timeout <= self.not_after + slack
