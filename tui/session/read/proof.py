"""Evidence from a block's or scanner's words on the parameter of each place.

What an indirect block brings since its drive's last reset cannot be read. It is identified by its
words: a place holds a parameter when nothing else that the block can return has fitted, and this
one has. Facts once known about a chosen parameter stay true until the drive is reset.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block, Parameter
from tui.drive.values import from_words, word_count

from ..reading import Reading
from .verdict import SlotMatch

SURE = 3
"""Comparisons that must speak for a parameter, and against each other one."""
BEYOND = 3
"""So many times as far as it was seen to tremble, a word may be off and still be its own."""
LEAST = 3
"""Raw units by which any value may tremble unseen."""


@dataclass(slots=True)
class SlotEvidence:
    """Evidence about one block; pure, and worthless after the drive's reset."""

    profile: Profile
    block: Block
    _sure: dict[str, str] = field(default_factory=dict)
    """The code that a slot surely brings."""
    _off: defaultdict[tuple[str, str], list[int]] = field(default_factory=lambda: defaultdict(list))
    """By how much each word was off the direct readings around it, by slot and code."""
    _seen: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    """The raw values of each parameter, read directly."""

    def begin(self) -> None:
        """Forget what led to no proof; how a value varied long ago shows nothing about the
        present."""
        self._off.clear()
        self._seen.clear()

    def note(
        self, words: Sequence[int], before: Mapping[str, Reading], after: Mapping[str, Reading]
    ) -> None:
        """Take the block's words with direct readings of some of what it could bring."""
        for code in before:
            parameter = self.profile[code]
            first, second = before[code].raw, after[code].raw
            if first is None or second is None or word_count(parameter) != 1:
                continue
            self._seen[code] += [first, second]
            for slot, word in zip(self.block.slots, words, strict=False):
                raw = from_words(parameter, [word])
                self._off[slot, code].append(_off(parameter, raw, first, second))

    def verdict(self, slot: str, code: str) -> SlotMatch:
        """Return the match of a slot's words with a parameter: one that differs did so each
        time."""
        offs, seen = self._off[slot, code], self._seen[code]
        if not offs:
            return SlotMatch.UNREAD
        if all(offs):
            return SlotMatch.DIFFERS
        return SlotMatch.MOVING if any(offs) or seen[::2] != seen[1::2] else SlotMatch.SAME

    def fitted(self, slot: str, code: str) -> bool:
        """Return True if a slot's last word could be that of a parameter."""
        return self._off[slot, code][-1:] == [0]

    def conclude(self, chosen: Mapping[str, int]) -> None:
        """Keep what is sure by now of these slots and their raw values."""
        for slot, raw in chosen.items():
            if self.holds(slot, raw):
                self._sure[slot] = self._code(raw)

    def brings(self, slot: str) -> str:
        """The code of what a place surely brings; empty while that is not known."""
        if slot in self._sure:
            return self._sure[slot]
        left = [code for code in self.codes if not self._excluded(slot, code)]
        return left[0] if len(left) == 1 and self._confirmed(slot, left[0]) else ""

    def holds(self, slot: str, raw: int) -> bool:
        """Return True if a place surely brings what its slot's raw value means."""
        code = self._code(raw)
        return bool(code) and self.brings(slot) == code

    def excludes(self, slot: str, raw: int) -> bool:
        """Return True if a place surely returns another parameter than its slot's raw value
        selects."""
        return not self.holds(slot, raw) and self._excluded(slot, self._code(raw))

    def open_codes(self, chosen: Mapping[str, int]) -> list[str]:
        """The parameters to be compared yet until every place of `chosen` is sure."""
        targets = {s: self._code(raw) for s, raw in chosen.items() if s not in self._sure}
        return [
            code
            for code in self.codes
            if any(
                not (self._confirmed if code == target else self._excluded)(slot, code)
                for slot, target in targets.items()
            )
        ]

    @property
    def codes(self) -> list[str]:
        """Everything that the block can bring."""
        return list(dict.fromkeys(choice.parameter for choice in self.block.choices))

    def _confirmed(self, slot: str, code: str) -> bool:
        return len(self._off[slot, code]) >= SURE and not self._against(slot, code)

    def _excluded(self, slot: str, code: str) -> bool:
        return self._against(slot, code) >= SURE

    def _against(self, slot: str, code: str) -> int:
        """Return the number of words that were further off than the parameter varies."""
        may_be = LEAST + BEYOND * _tremble(self._seen[code])
        return sum(off > may_be for off in self._off[slot, code])

    def _code(self, raw: int) -> str:
        return next((c.parameter for c in self.block.choices if c.raw == raw), "")


def _off(parameter: Parameter, raw: int, first: int, second: int) -> int:
    """Return the distance between a raw value and the parameter before and after it, in raw
    units."""
    if parameter.bits:
        return FAR if (raw ^ first) & (raw ^ second) & 0xFFFF else 0
    low, high = sorted((first, second))
    # as far again as it went between them: it may have turned meanwhile
    span = high - low
    return max(0, low - span - raw, raw - high - span)


def _tremble(raws: Sequence[int]) -> int:
    """By how much a value left the straight way between its neighbors, in raw units, rounded up.

    A value that goes evenly up or down does not tremble.
    """
    bends = [abs(a + c - 2 * b) for a, b, c in zip(raws, raws[1:], raws[2:], strict=False)]
    return (max(bends, default=0) + 1) // 2


FAR = 1 << 20
"""Further than any raw value is from another one."""
