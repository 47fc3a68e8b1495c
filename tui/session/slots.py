"""What stands in the places of a drive's indirect block or scanner, as far as it is sure.

A scanner's slots count as soon as they are written: they are read, and read again after each
use (the read plan sees to that). An indirect block's slots count from the drive's next reset
on, so what they hold now may not be what the block brings: the block is compared with direct
reads of everything that could stand in it, until only one parameter fits each place.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field

from tui.bus.errors import DeviceException
from tui.bus.line import Line, Priority
from tui.drive.profile import Profile
from tui.drive.schema import Block

from .readings import Reading

ROUNDS = 2
"""Comparisons that must all tell the same of a place."""
TRY_AGAIN = 30.0
"""Seconds after which a block that could not be proved is compared again."""
ASLEEP = 0.8
"""Seconds without an answer in which a drive may have been switched off and on."""

Ask = Callable[[Iterable[str]], Awaitable[Mapping[str, Reading]]]


@dataclass(slots=True)
class Slots:
    """The slots of one drive's read blocks; `ask` reads parameters at the priority of polls."""

    line: Line
    device: int
    profile: Profile
    _known: dict[str, int] = field(default_factory=dict)
    _proved: dict[str, int] = field(default_factory=dict)
    _heard: float = 0.0
    _tried: dict[str, int] = field(default_factory=dict)
    """The places of the last proof, whatever came of it."""
    _next_proof: float = 0.0

    def in_force(self) -> dict[str, int]:
        """Raw values by slot of what surely stands in each place now."""
        awake = time.monotonic() - self._heard <= ASLEEP
        return self._known | self._proved if awake else dict(self._known)

    def heard(self) -> None:
        """The drive has answered: it was not switched off since it did so before, or long ago."""
        now = time.monotonic()
        if now - self._heard > ASLEEP:
            self._proved.clear()
        self._heard = now

    def distrust(self) -> None:
        """The drive may be reset now: what counts from then on is not what was proved."""
        self._proved.clear()

    def forget(self) -> None:
        """Nothing is sure any more: the drive was silent, or another one answers now."""
        self._known.clear()
        self._proved.clear()

    async def learn(self, ask: Ask) -> None:
        """Read the slots of every read block, and prove those that count after a reset only."""
        for block in self.profile.data.blocks:
            if block.direction != "read":
                continue
            readings = await ask(block.slots)
            raws = {c: r.raw for c, r in readings.items() if r.raw is not None}
            if block.effective == "at-once":
                self._known.update(raws)
            else:
                await self._prove(block, raws, ask)

    async def _prove(self, block: Block, slots: Mapping[str, int], ask: Ask) -> None:
        places = _filled(block, slots)
        if places == self._tried and self._proved:
            return
        self._proved.clear()
        now = time.monotonic()
        if len(places) < block.min_words or (places == self._tried and now < self._next_proof):
            return
        self._tried, self._next_proof = dict(places), now + TRY_AGAIN
        for _ in range(ROUNDS):
            places = await self._compare(block, places, ask)
            if len(places) < block.min_words:
                return
        self._proved = dict(places)

    async def _compare(self, block: Block, places: Mapping[str, int], ask: Ask) -> dict[str, int]:
        """The places, from the first on, whose word only the chosen parameter can have brought."""
        codes = list(dict.fromkeys(choice.parameter for choice in block.choices))
        before = await ask(codes)
        try:
            reply = await self.line.read(
                self.device, block.address, len(places), priority=Priority.POLL
            )
        except DeviceException:
            return {}
        after = await ask(codes)
        sure: dict[str, int] = {}
        for (slot, raw), word in zip(places.items(), reply.words, strict=True):
            fits = {
                choice.raw
                for choice in block.choices
                if _between(word, before[choice.parameter].raw, after[choice.parameter].raw)
            }
            if fits != {raw}:
                break
            sure[slot] = raw
        return sure


def _filled(block: Block, slots: Mapping[str, int]) -> dict[str, int]:
    """The slots from the first on that hold one of the block's choices."""
    known = {choice.raw for choice in block.choices}
    filled: dict[str, int] = {}
    for slot in block.slots:
        if slots.get(slot) not in known:
            break
        filled[slot] = slots[slot]
    return filled


def _between(word: int, before: int | None, after: int | None) -> bool:
    """Whether a parameter that went from one raw value to another can have been this word."""
    if before is None or after is None:
        return True
    low, high = sorted((before & 0xFFFF, after & 0xFFFF))
    return low <= word <= high
