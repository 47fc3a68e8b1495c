"""How long an owner may take for granted that no other program sends stops past it.

A client that hears nothing of its owner for SILENT_OWNER seconds sends its stops on the port
itself. So an owner that has said nothing for nearly as long sends nothing but stops, until it knows
what was stopped meanwhile: what waits in it since before would start the motor again.
"""

from __future__ import annotations

from ..master import MonotonicClock

SILENT_OWNER = 1.0
"""Seconds without a sign of life after which an owner counts as frozen."""
LEASE = 0.7
"""Seconds from its last sign of life in which an owner may send; the rest is for one exchange."""

SILENT_CLIENT = 2.0
"""Seconds without a sign of life after which a client is let go: nobody is to wait for it."""

TOO_LATE = 2.0
"""Seconds after which a command is not sent any more: nobody expects it now."""


class Lease:
    """When the owner last gave a sign of life to all; for any thread."""

    def __init__(self, clock: MonotonicClock) -> None:
        self._clock = clock
        self._said = clock()

    @property
    def stood(self) -> float:
        """Seconds since the last sign of life."""
        return self._clock() - self._said

    @property
    def lapsed(self) -> bool:
        """Whether stops of others may be under way past this program."""
        return self.stood > LEASE

    def renew(self, said: float) -> None:
        """All were told at a moment that this program is well, and it knows what they did."""
        self._said = said


def stood_still(seconds: float) -> str:
    """Why a command is not sent, for a person."""
    return f"Not sent: the program that owns the line stood still for {seconds:.0f} s."
