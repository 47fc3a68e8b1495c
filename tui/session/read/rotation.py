"""Rotation of slow values over the cycles; failed reads are retried in smaller parts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

Groups = Callable[[Iterable[str]], Sequence[tuple[str, ...]]]
"""Groups codes by the request that reads them."""


class Rotation:
    """Spreads the slow values of one drive over several cycles.

    `parts` is the number of cycles that read each of them once.
    """

    def __init__(self, parts: int) -> None:
        self._parts = parts
        self._cycle = 0
        self._owed: tuple[str, ...] = ()
        self._turn: tuple[str, ...] = ()
        self._most: int | None = None
        """Most requests in one cycle for overdue values; None for no limit."""

    def add(self, codes: Iterable[str]) -> None:
        """Mark values as overdue: they are read before the others."""
        self._owed = tuple(dict.fromkeys((*codes, *self._owed)))

    def turn(self, codes: Iterable[str], groups: Groups) -> tuple[str, ...]:
        """Return the values of this cycle: overdue ones first, else the next part of `codes`."""
        if self._owed:
            some = () if self._most is None else groups(self._owed)[: self._most]
            self._turn = _joined(some) or self._owed
        else:
            self._cycle += 1
            self._turn = self.turns(codes, groups)[self._cycle % self._parts]
        return self._turn

    @property
    def owes(self) -> bool:
        """True while values are overdue."""
        return bool(self._owed)

    def turns(self, codes: Iterable[str], groups: Groups) -> tuple[tuple[str, ...], ...]:
        """Split the values into parts, one for each cycle."""
        found = groups(codes)
        return tuple(_joined(found[part :: self._parts]) for part in range(self._parts))

    def set_turn(self, codes: tuple[str, ...]) -> tuple[str, ...]:
        """Set the values of the current cycle, as chosen by the keeper; return them."""
        self._turn = codes
        return codes

    def came(self) -> None:
        """Note that this turn was read; the limit for the overdue rest doubles."""
        self._owed = tuple(code for code in self._owed if code not in self._turn)
        if self._most is not None:
            self._most = self._most * 2 if self._owed else None

    def failed(self, groups: Groups) -> None:
        """Note that this turn failed: its values are overdue, with half as many requests.

        Fewer requests in a cycle make the loss of one less likely.
        """
        self._owed = tuple(dict.fromkeys((*self._turn, *self._owed)))
        self._most = max(1, len(groups(self._turn)) // 2)


def _joined(groups: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(code for group in groups for code in group)
