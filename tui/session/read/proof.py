"""Evidence from the words of a block or scanner about the parameter in each place.

An indirect block takes over its slots at the drive's reset, and the slots in force cannot be read.
The words identify them: a place holds a parameter if its words match that parameter and no other
that the block can return. A parameter once identified stays valid until the drive is reset.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block, Parameter
from tui.drive.values import from_words, word_count

from ..reading import Reading

SURE = 3
"""Comparisons that must match one parameter and exclude each other one."""
BEYOND = 3
"""Factor: a word may differ by this many times the seen jitter, and still match."""
LEAST = 3
"""Jitter in raw units that is assumed for every value, even if none was seen."""


class SlotMatch(StrEnum):
    """Match of a slot's word with its parameter, which is read directly."""

    SAME = "same"
    MOVING = "moving"
    DIFFERS = "differs"
    CHANGED = "changed meanwhile"
    NONE = "no value"
    UNUSED = "unused"
    UNREAD = "not compared"


@dataclass(slots=True)
class SlotEvidence:
    """Evidence about one block. Pure; invalid after the drive's reset."""

    profile: Profile
    block: Block
    _sure: dict[str, str] = field(default_factory=dict)
    """Identified parameter code by slot."""
    _off: defaultdict[tuple[str, str], list[int]] = field(default_factory=lambda: defaultdict(list))
    """Distance of each word from the direct readings around it, by slot and code (raw units)."""
    _seen: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    """The raw values of each parameter, read directly."""

    def begin(self) -> None:
        """Discard unfinished evidence; old variation does not describe the present jitter."""
        self._off.clear()
        self._seen.clear()

    def note(
        self, words: Sequence[int], before: Mapping[str, Reading], after: Mapping[str, Reading]
    ) -> None:
        """Compare the block's words with direct readings taken before and after them."""
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
        """Return the match of a slot's words with a parameter.

        DIFFERS requires that all words so far differed.
        """
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
        """Store the places that the evidence identifies, for these slots and raw values."""
        for slot, raw in chosen.items():
            if self.holds(slot, raw):
                self._sure[slot] = self._code(raw)

    def returned_code(self, slot: str) -> str:
        """Return the parameter code identified for a place; empty if none yet."""
        if slot in self._sure:
            return self._sure[slot]
        left = [code for code in self.codes if not self._excluded(slot, code)]
        return left[0] if len(left) == 1 and self._confirmed(slot, left[0]) else ""

    def holds(self, slot: str, raw: int) -> bool:
        """Return True if a place certainly returns the parameter that its slot selects."""
        code = self._code(raw)
        return bool(code) and self.returned_code(slot) == code

    def excludes(self, slot: str, raw: int) -> bool:
        """Return True if a place certainly returns another parameter than its slot selects."""
        return not self.holds(slot, raw) and self._excluded(slot, self._code(raw))

    def open_codes(self, chosen: Mapping[str, int]) -> list[str]:
        """Return the parameters still to compare to identify every place of `chosen`."""
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
        """Return the codes of all parameters that the block can return."""
        return list(dict.fromkeys(choice.parameter for choice in self.block.choices))

    def _confirmed(self, slot: str, code: str) -> bool:
        return len(self._off[slot, code]) >= SURE and not self._against(slot, code)

    def _excluded(self, slot: str, code: str) -> bool:
        return self._against(slot, code) >= SURE

    def _against(self, slot: str, code: str) -> int:
        """Return how many words differ by more than the parameter's jitter."""
        may_be = LEAST + BEYOND * _tremble(self._seen[code])
        return sum(off > may_be for off in self._off[slot, code])

    def _code(self, raw: int) -> str:
        return next((c.parameter for c in self.block.choices if c.raw == raw), "")


def _off(parameter: Parameter, raw: int, first: int, second: int) -> int:
    """Return the distance of a raw value from the range of both direct readings (raw units)."""
    if parameter.bits:
        return FAR if (raw ^ first) & (raw ^ second) & 0xFFFF else 0
    low, high = sorted((first, second))
    # widened by its own span: the value may have turned between the readings
    span = high - low
    return max(0, low - span - raw, raw - high - span)


def _tremble(raws: Sequence[int]) -> int:
    """Return the jitter of a value: its distance from the line between its neighbors.

    In raw units, rounded up. A value that rises or falls evenly has none.
    """
    bends = [abs(a + c - 2 * b) for a, b, c in zip(raws, raws[1:], raws[2:], strict=False)]
    return (max(bends, default=0) + 1) // 2


FAR = 1 << 20
"""Larger than any distance between two raw values."""
