"""Lengths of the silences of a test, and conclusions from those that were kept. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

COARSE = (0.25, 0.5, 0.7)
"""Silences well before the timeout, as shares of it: a shorter one shows up there."""
FINE_FROM, SILENCE_STEP = 0.82, 0.12
"""From here on they grow by so much, so that two are at most 300 ms apart at 2 s."""
LATEST_FINE = 1.3
PAST_TIMEOUT = (1.6, 2.2, 3.0)
"""Silences after the timeout should have run out; none longer is tried."""
LONGEST_SILENCE = 90.0
"""Seconds that no silence exceeds, unless the timeout itself needs longer ones."""
LONGEST_SHARE = 1.6
"""Of a long timeout, the longest silence."""
TIMEOUT_TOLERANCE, LEAST_TIMEOUT_TOLERANCE = 0.05, 0.05
"""Share of the timeout, and seconds, by which a drive may be earlier or later than set."""


def silences(timeout: float) -> Iterator[float]:
    """Seconds of each silence, growing around the timeout that is set."""
    shares = list(COARSE)
    share = FINE_FROM
    while share < LATEST_FINE:
        shares.append(round(share, 3))
        share += SILENCE_STEP
    longest = max(LONGEST_SILENCE, LONGEST_SHARE * timeout)
    yield from dict.fromkeys(min(value * timeout, longest) for value in (*shares, *PAST_TIMEOUT))


@dataclass(frozen=True, slots=True)
class Bracket:
    """Between which two silences a drive has reacted; seconds."""

    not_before: float = 0.0
    """The longest silence after which it had not."""
    not_after: float | None = None
    """The shortest after which it had; None where it never did."""

    def alive(self, silence: float) -> Bracket:
        """The drive was asked after so long a silence and had not reacted."""
        return Bracket(max(self.not_before, silence), self.not_after)

    def reacted(self, silence: float) -> Bracket:
        """The drive was asked after so long a silence and had reacted."""
        return Bracket(self.not_before, max(silence, self.not_before))

    @property
    def measured(self) -> float | None:
        """The middle of the bracket; None where the drive did not react."""
        return None if self.not_after is None else (self.not_before + self.not_after) / 2

    def holds(self, timeout: float) -> bool:
        """Return True if a timeout that is set agrees with what was seen."""
        if self.not_after is None:
            return False
        slack = max(TIMEOUT_TOLERANCE * timeout, LEAST_TIMEOUT_TOLERANCE)
        return self.not_before - slack <= timeout <= self.not_after + slack
