"""Recent share of a line's time, by program."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping

from .bounds import MOST_PROGRAMS
from .program import KEEPER, Program

USE_WINDOW = 10.0
"""Seconds over which shares are averaged; older use has less and less weight."""
LEAST_USE = 0.002
"""A share below which a program counts as idle."""


class ProgramUse:
    """Counted in the line's loop, looked at from any thread: the mapping is replaced as a whole."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._shares: Mapping[str, float] = {}
        self._when = clock()

    def count(self, program: str, seconds: float) -> None:
        """Count the seconds that a request of a program kept the line; without an id, nothing."""
        if not program:
            return  # a stop that is repeated for a program that may be gone
        faded = dict(self.shares)
        faded[program] = faded.get(program, 0.0) + seconds / USE_WINDOW
        most = sorted(faded, key=faded.__getitem__, reverse=True)[:MOST_PROGRAMS]
        self._shares, self._when = {text: faded[text] for text in most}, self._clock()

    @property
    def shares(self) -> dict[str, float]:
        """The present shares, by the programs' ids."""
        fades = math.exp(-max(0.0, self._clock() - self._when) / USE_WINDOW)
        now = ((text, share * fades) for text, share in self._shares.items())
        return {text: min(share, 1.0) for text, share in now if share >= LEAST_USE}


def use_by_program(
    programs: Iterable[Program], shares: Mapping[str, float]
) -> list[tuple[Program, float]]:
    """The programs on a line without its keeper; their order stays while shares change."""
    found = [
        (program, shares.get(program.id, 0.0)) for program in programs if program.name != KEEPER
    ]
    return sorted(found, key=lambda pair: (pair[0].pid, pair[0].id))
