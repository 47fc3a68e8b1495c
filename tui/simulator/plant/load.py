"""Load of the machine: slowly changing, with a varying supply voltage, and an operator who changes
the reference at intervals. Seeded, so that a run can be repeated."""

from __future__ import annotations

import math
from random import Random

REFERENCE_STEPS = (0.5, 0.65, 0.8, 0.9, 1.0)
"""Factors of the initial reference that a wandering one takes."""
REFERENCE_PAUSE = (12.0, 30.0)


class Load:
    """Load as a share of rated torque, and supply as a share of rated voltage, over time."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._base = random.uniform(0.5, 0.68)
        self._phases = [random.uniform(0, 2 * math.pi) for _ in range(3)]
        self._time = 0.0

    def step(self, dt: float) -> None:
        """Advance the time by `dt` seconds."""
        self._time += dt

    @property
    def torque(self) -> float:
        """Load torque, 1.0 at the motor's rated torque and speed."""
        slow = 0.16 * math.sin(2 * math.pi * self._time / 53 + self._phases[0])
        quick = 0.05 * math.sin(2 * math.pi * self._time / 11 + self._phases[1])
        return self._base + slow + quick

    @property
    def mains(self) -> float:
        """Mains voltage, 1.0 at its rated value."""
        return 1.0 + 0.008 * math.sin(2 * math.pi * self._time / 31 + self._phases[2])


class Wanderer:
    """Reference at the terminals that changes at intervals."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._first: float | None = None
        self._left = 0.0

    def begin(self, hz: float | None) -> None:
        """Start changes around a reference in Hz; None: no changes."""
        self._first = hz
        self._left = self._random.uniform(*REFERENCE_PAUSE)

    def step(self, dt: float) -> float | None:
        """Advance the time by `dt` seconds; return the new reference in Hz if it changes, else
        None."""
        if self._first is None:
            return None
        self._left -= dt
        if self._left > 0:
            return None
        self._left = self._random.uniform(*REFERENCE_PAUSE)
        return self._first * self._random.choice(REFERENCE_STEPS)
