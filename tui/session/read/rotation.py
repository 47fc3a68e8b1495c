"""Which of the seldom values are read in a cycle; what failed comes again, in smaller parts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

Groups = Callable[[Iterable[str]], Sequence[tuple[str, ...]]]
"""Codes in groups that come in one request each."""


class Rotation:
    """Deals out the seldom values of one drive: a part of their requests in each cycle.

    `parts` is the number of cycles in which all of them have had their turn.
    """

    def __init__(self, parts: int) -> None:
        self._parts = parts
        self._cycle = 0
        self._owed: tuple[str, ...] = ()
        self._turn: tuple[str, ...] = ()
        self._most: int | None = None
        """Requests for what is owed in one cycle; None while all are made at once."""

    def add(self, codes: Iterable[str]) -> None:
        """Owe these values; they come before the others have their turn."""
        self._owed = tuple(dict.fromkeys((*codes, *self._owed)))

    def turn(self, codes: Iterable[str], groups: Groups) -> tuple[str, ...]:
        """The values to be read in this cycle: some of those owed, else the next of `codes`."""
        if self._owed:
            some = () if self._most is None else groups(self._owed)[: self._most]
            self._turn = _joined(some) or self._owed
        else:
            self._cycle += 1
            self._turn = self.turns(codes, groups)[self._cycle % self._parts]
        return self._turn

    @property
    def owes(self) -> bool:
        """True while values are owed."""
        return bool(self._owed)

    def turns(self, codes: Iterable[str], groups: Groups) -> tuple[tuple[str, ...], ...]:
        """The values of each of the cycles in which all of them have their turn."""
        found = groups(codes)
        return tuple(_joined(found[part :: self._parts]) for part in range(self._parts))

    def set_turn(self, codes: tuple[str, ...]) -> tuple[str, ...]:
        """These values have their turn, unless some are owed."""
        self._turn = codes
        return codes

    def came(self) -> None:
        """The values of this turn were read; of what is owed yet comes twice as much."""
        self._owed = tuple(code for code in self._owed if code not in self._turn)
        if self._most is not None:
            self._most = self._most * 2 if self._owed else None

    def failed(self, groups: Groups) -> None:
        """This turn failed: its values are owed, and asked for with half as many requests.

        A cycle of many requests is more likely to lose one than a cycle of few.
        """
        self._owed = tuple(dict.fromkeys((*self._turn, *self._owed)))
        self._most = max(1, len(groups(self._turn)) // 2)


def _joined(groups: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    return tuple(code for group in groups for code in group)
