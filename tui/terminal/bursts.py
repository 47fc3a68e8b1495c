"""Which keys came alone, which together, and which because a key is held down.

A person types one key after another; a paste without brackets, or a link that hung, brings many at
once. A key that can do no harm in a burst does not wait, but counts as one of its keys. Times are
seconds of one clock, given with each key; nothing here looks at a clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from tui.safety import BURST_GAP

from .stroke import Pressed, Stroke
from .tokens import KeyToken, Paste

SHORTEST_REPEAT: Final = 0.005
"""Seconds between two keys below which no keyboard repeats."""

UNEVEN: Final = 0.02
"""Seconds by which the times between repeats of a held key differ at most."""

REPEATS: Final = 3
"""Keys at an even pace that make a held key."""

HELD_LONGEST: Final = 0.15
"""Seconds after which keys that are known not to be alone are held back no longer."""

STEPPING: Final = frozenset({"up", "down", "left", "right", "pageup", "pagedown"})
"""Keys that a person holds down to go on."""


class Bursts:
    """Holds keys back until it is known whether they came alone."""

    def __init__(self) -> None:
        self._waiting: list[KeyToken] = []
        self._last = float("-inf")
        self._members = 0
        self._names: set[str] = set()
        self._reads: list[list[KeyToken]] = []
        self._repeating: str | None = None
        self._stepped = False
        self._given: list[Pressed | Paste] = []

    def begins(self, key: KeyToken) -> bool:
        """Return True if this key would be the first of its burst."""
        return key.began - self._last > BURST_GAP

    @property
    def holds_back(self) -> bool:
        """True if a key waits: a later one must not overtake it."""
        return bool(self._waiting)

    def key(self, key: KeyToken, *, at_once: bool = False) -> None:
        """Add a key: `given` decides about it, or returns it in any case if it acts `at_once`."""
        self._join(key.began, key.at)
        if not self._reads or self._reads[-1][-1].at != key.at:
            self._reads = [*self._reads[1 - REPEATS :], []]
        self._reads[-1].append(key)
        self._names.add(key.name)
        if at_once:
            stroke = Stroke(key.began, key.mark, alone=False, steps=False, at_once=True)
            self._given.append(Pressed(key.name, key.character, stroke))
        else:
            self._waiting.append(key)

    def stop(self, key: KeyToken) -> None:
        """A stop key was taken: whatever was typed before it and still waits is void."""
        self._waiting.clear()
        self._given = [given for given in self._given if isinstance(given, Paste)]
        self._join(key.began, key.at)
        self._repeating, self._stepped, self._reads = None, True, []

    def paste(self, paste: Paste) -> None:
        """A paste keeps its place among the keys; those beside it are not alone."""
        self._join(paste.at, paste.at)
        self._give_parts()
        self._given.append(paste)

    def given(self, now: float, pending: float | None = None) -> list[Pressed | Paste]:
        """Return the known keys; `pending` is when a sequence began that may become a key."""
        self._give_repeats()
        if not self._hangs_on(pending):
            if now - self._last > BURST_GAP:
                self._close()
            elif self._members > 1 and self._waiting and now - self._waiting[0].at > HELD_LONGEST:
                self._give_parts()
        found, self._given = self._given, []
        return found

    def deadline(self, pending: float | None = None) -> float | None:
        """When it will be known whether what waits is alone; None if time shows nothing."""
        return self._last + BURST_GAP if self._waiting and not self._hangs_on(pending) else None

    def _hangs_on(self, pending: float | None) -> bool:
        return pending is not None and pending - self._last <= BURST_GAP

    def _join(self, began: float, at: float) -> None:
        """One more member of the piece; a new piece where the last is over."""
        if began - self._last > BURST_GAP:
            self._close()
        self._members += 1
        self._last = at

    def _close(self) -> None:
        """The piece is over."""
        if self._members == 1 and self._waiting:
            self._give(self._waiting.pop(), alone=True, steps=True)
        self._give_parts()
        self._members, self._names, self._reads = 0, set(), []
        self._repeating, self._stepped = None, False

    def _give(
        self, key: KeyToken, *, steps: bool, alone: bool = False, held: bool = False, piece: int = 1
    ) -> None:
        stroke = Stroke(key.began, key.mark, alone=alone, held=held, steps=steps, piece=piece)
        self._given.append(Pressed(key.name, key.character, stroke))

    def _give_parts(self) -> None:
        """Give out what waits as parts of a piece; of arrows, the first steps once."""
        steps = not self._stepped and len(self._names) == 1 and self._names <= STEPPING
        for key in self._waiting:
            self._give(key, steps=steps, piece=self._members)
            self._stepped, steps = self._stepped or steps, False
        self._waiting.clear()

    def _give_repeats(self) -> None:
        """Give out what a held key repeats, one a read."""
        if not self._waiting or not self._reads:
            return
        last = self._reads[-1]
        if all(key.name == self._repeating for key in last):
            self._give_held(1, len(last))
        elif _even(self._reads):
            self._repeating = last[0].name
            self._give_held(REPEATS, REPEATS)
        else:
            self._repeating = None

    def _give_held(self, count: int, run: int) -> None:
        """Of the last keys that wait, give so many as held; the others as parts."""
        first = max(0, len(self._waiting) - run)
        ahead, held = self._waiting[:first], self._waiting[first : first + count]
        behind = self._waiting[first + count :]
        self._waiting = ahead
        self._give_parts()
        self._stepped = True
        for key in held:
            self._give(key, held=True, steps=True, piece=self._members)
        self._waiting = behind
        self._give_parts()


def _even(reads: Sequence[Sequence[KeyToken]]) -> bool:
    """Return True if each of these reads is the same key, at an even pace."""
    names = {key.name for read in reads for key in read}
    if len(reads) < REPEATS or len(names) != 1 or not names <= STEPPING:
        return False
    times = [read[0].at for read in reads]
    between = [later - earlier for earlier, later in pairwise(times)]
    alone = all(len(read) == 1 for read in reads)
    return alone and min(between) >= SHORTEST_REPEAT and max(between) - min(between) <= UNEVEN
