"""What the words of an indirect block have told of what each of its places brings.

What a block brings since its drive's last reset cannot be read. It is told by its words: a place
brings what was chosen for it when nothing else that the block can bring has fitted, and the
chosen parameter has. What was told once stays true until the drive is reset.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tui.drive.profile import Profile
from tui.drive.schema import Block, Parameter
from tui.drive.values import from_words

from .readings import Reading

SURE = 3
"""Comparisons that must speak for the chosen parameter, and against each other one."""
BEYOND = 3
"""So many times as far as it was seen to tremble, a word may be off and still be its own."""
LEAST = 3
"""Raw units by which any value may tremble unseen."""


@dataclass(slots=True)
class Proof:
    """Evidence about one indirect block; pure, and worthless after the drive's reset."""

    profile: Profile
    block: Block
    _sure: dict[str, str] = field(default_factory=dict)
    """The code that a slot surely brings."""
    _off: defaultdict[tuple[str, str], list[int]] = field(default_factory=lambda: defaultdict(list))
    """By how much each word was off the direct readings around it, by slot and code."""
    _seen: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    """The raw values of each parameter, read directly."""

    def begin(self) -> None:
        """Forget what led to no proof; how a value trembled long ago says nothing of now."""
        self._off.clear()
        self._seen.clear()

    def note(
        self, words: Sequence[int], before: Mapping[str, Reading], after: Mapping[str, Reading]
    ) -> None:
        """Take the block's words with direct readings of some of what it could bring."""
        for code in before:
            first, second = before[code].raw, after[code].raw
            if first is None or second is None:
                continue
            self._seen[code] += [first, second]
            parameter = self.profile[code]
            for slot, word in zip(self.block.slots, words, strict=False):
                raw = from_words(parameter, [word])
                self._off[slot, code].append(_off(parameter, raw, first, second))

    def conclude(self, chosen: Mapping[str, int]) -> None:
        """Keep what is sure by now of these slots and their raw values."""
        for slot, raw in chosen.items():
            code = self._code(raw)
            if code and not any(self._is_open(slot, one, code) for one in self.codes):
                self._sure[slot] = code

    def holds(self, slot: str, raw: int) -> bool:
        """Whether a place surely brings what its slot's raw value stands for."""
        return slot in self._sure and self._sure[slot] == self._code(raw)

    def open_codes(self, chosen: Mapping[str, int]) -> list[str]:
        """The parameters to be compared yet until every place of `chosen` is sure."""
        targets = {s: self._code(raw) for s, raw in chosen.items() if s not in self._sure}
        return [
            code
            for code in self.codes
            if any(self._is_open(slot, code, target) for slot, target in targets.items())
        ]

    @property
    def codes(self) -> list[str]:
        """Everything that the block can bring."""
        return list(dict.fromkeys(choice.parameter for choice in self.block.choices))

    def _is_open(self, slot: str, code: str, chosen: str) -> bool:
        may_be = LEAST + BEYOND * _tremble(self._seen[code])
        offs = self._off[slot, code]
        against = sum(off > may_be for off in offs)
        if code == chosen:
            return len(offs) - against < SURE or against > 0
        return against < SURE

    def _code(self, raw: int) -> str:
        return next((c.parameter for c in self.block.choices if c.raw == raw), "")


def _off(parameter: Parameter, raw: int, first: int, second: int) -> int:
    """How far a raw value is from what the parameter held before and after it, in raw units."""
    if parameter.bits:
        return FAR if (raw ^ first) & (raw ^ second) & 0xFFFF else 0
    low, high = sorted((first, second))
    # as far again as it went between them: it may have turned meanwhile
    span = high - low
    return max(0, low - span - raw, raw - high - span)


def _tremble(raws: Sequence[int]) -> int:
    """By how much a value left the straight way between its neighbours, in raw units, rounded up.

    A value that goes evenly up or down does not tremble.
    """
    bends = [abs(a + c - 2 * b) for a, b, c in zip(raws, raws[1:], raws[2:], strict=False)]
    return (max(bends, default=0) + 1) // 2


FAR = 1 << 20
"""Further than any raw value is from another one."""
