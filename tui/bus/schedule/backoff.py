"""Growing pauses between tries."""

from __future__ import annotations


def pause(failures: int, first: float, longest: float) -> float:
    """Seconds to wait after so many failures in a row: `first`, doubled each time, capped."""
    if failures <= 0:
        return 0.0
    # the exponent is capped as well: a night of failures must not overflow
    return min(longest, first * float(2 ** min(failures - 1, 30)))
