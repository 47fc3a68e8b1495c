"""Load of the machine: slowly changing, with a varying mains, and a person who changes the
reference now and then. Seeded, so that a run can be repeated."""

from __future__ import annotations

import math
from random import Random

REFERENCE_STEPS = (0.5, 0.65, 0.8, 0.9, 1.0)
"""Parts of the first reference that a wandering one takes."""
REFERENCE_PAUSE = (12.0, 30.0)


class Load:
    """Load in rated torque and mains in parts of the rated voltage, over time."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._base = random.uniform(0.5, 0.68)
        self._phases = [random.uniform(0, 2 * math.pi) for _ in range(3)]
        self._time = 0.0

    def step(self, dt: float) -> None:
        """Let time pass."""
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
    """A reference at the terminals that is changed now and then."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._first: float | None = None
        self._left = 0.0

    def begin(self, hz: float | None) -> None:
        """Wander around a reference in Hz; None: leave it alone."""
        self._first = hz
        self._left = self._random.uniform(*REFERENCE_PAUSE)

    def step(self, dt: float) -> float | None:
        """The new reference in Hz if it is changed now, else None."""
        if self._first is None:
            return None
        self._left -= dt
        if self._left > 0:
            return None
        self._left = self._random.uniform(*REFERENCE_PAUSE)
        return self._first * self._random.choice(REFERENCE_STEPS)
