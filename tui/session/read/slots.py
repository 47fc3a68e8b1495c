"""Contents of a drive's indirect block or scanner, as far as they are certain.

A scanner's slots take effect when they are written, so the read plan reads them again after each
use. An indirect block's slots take effect at the drive's next reset, so the block may return other
parameters than its slots select. Comparisons with direct reads, a few parameters at a time,
identify them.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field

from tui.bus.api import ModbusLine, Priority
from tui.bus.errors import DeviceException
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block
from tui.safety import ASLEEP

from ..clock import Clock
from ..reading import Reading
from .proof import SURE, SlotEvidence

COMPARED_AT_ONCE = 2
"""Most parameters compared between two cycles, to keep the delay of a cycle short."""
ROUNDS = SURE + 1
"""Comparisons of each parameter before a pause."""
TRY_AGAIN = 15.0
"""Seconds after which an uncertain block is compared again."""
CALM = 1.0
"""Seconds to wait after a possible reset before a block is compared."""

ReadCodes = Callable[[Iterable[str]], Awaitable[Mapping[str, Reading]]]


@dataclass(slots=True)
class _Comparison:
    """Comparison of one indirect block: its selected slots, the evidence, and what is left."""

    block: Block
    proof: SlotEvidence
    chosen: dict[str, int] = field(default_factory=dict)
    """Last read raw values by slot, for slots that select one of the block's choices."""
    todo: deque[str] = field(default_factory=deque)
    next_time: float = 0.0

    def choose(self, slots: Mapping[str, int], now: float) -> None:
        """Take the slots that were read; begin a comparison if they changed or it is due."""
        known = {choice.raw for choice in self.block.choices}
        chosen = {s: slots[s] for s in self.block.slots if slots.get(s) in known}
        if chosen == self.chosen and (self.todo or now < self.next_time):
            return
        self.chosen, self.next_time = chosen, now + TRY_AGAIN
        self.proof.begin()
        self.todo = deque(self.proof.open_codes(chosen) * ROUNDS)

    @property
    def length(self) -> int:
        """Words up to the last selected place; 0 if the block cannot be read that short."""
        last = max((self.block.slots.index(slot) for slot in self.chosen), default=-1)
        return last + 1 if last + 1 >= self.block.min_words else 0

    def take(self) -> list[str]:
        """Remove and return the next parameters to compare."""
        still_open = self.proof.open_codes(self.chosen)
        codes: list[str] = []
        while self.todo and len(codes) < COMPARED_AT_ONCE:
            if (code := self.todo.popleft()) in still_open and code not in codes:
                codes.append(code)
        return codes

    def in_force(self) -> dict[str, int]:
        """Return the raw values by slot of the identified places."""
        return {slot: raw for slot, raw in self.chosen.items() if self.proof.holds(slot, raw)}


@dataclass(slots=True)
class Slots:
    """Slots of one drive's read blocks. `ask` arguments read parameters at poll priority."""

    line: ModbusLine
    device: int
    profile: Profile
    clock: Clock
    learned: float = -math.inf
    """When the slots of a scanner were read last (session's clock)."""
    _known: dict[str, int] = field(default_factory=dict)
    _comparisons: dict[str, _Comparison] = field(default_factory=dict)
    """By the block's id; cleared when the drive may have been reset."""
    _in_force: dict[str, int] = field(default_factory=dict)
    """Slots that comparisons have confirmed."""
    _heard: float = 0.0
    _doubted: float = 0.0

    def in_force(self) -> dict[str, int]:
        """Return the raw values by slot that are certainly in force."""
        awake = self.clock.monotonic() - self._heard <= ASLEEP
        return self._known | self._in_force if awake else dict(self._known)

    def heard(self) -> None:
        """Note an answer; after a gap above ASLEEP the drive may have been switched off."""
        now = self.clock.monotonic()
        if now - self._heard > ASLEEP:
            self._drop_proofs()
        self._heard = now

    def distrust(self) -> None:
        """Discard the comparisons: the drive may be reset now, and then uses other slots."""
        self._drop_proofs()
        self._doubted = self.clock.monotonic()

    def forget(self) -> None:
        """Discard everything: the drive did not answer, or another one answers now."""
        self._known.clear()
        self._drop_proofs()

    def compare_soon(self) -> None:
        """Compare again soon: parameters with equal values may differ now."""
        for comparison in self._comparisons.values():
            comparison.next_time = 0.0

    async def learn(self, ask: ReadCodes) -> None:
        """Read the slots of every read block."""
        for block in self.profile.data.blocks:
            if block.direction != "read":
                continue
            readings = await ask(block.slots)
            raws = {c: r.raw for c, r in readings.items() if r.raw is not None}
            if block.effective == "at-once":
                self._known.update(raws)
                self.learned = max((r.time for r in readings.values()), default=self.learned)
            elif self.clock.monotonic() - self._doubted > CALM:
                fresh = _Comparison(block, SlotEvidence(self.profile, block))
                self._comparisons.setdefault(block.id, fresh).choose(raws, self.clock.monotonic())
        self._conclude()

    async def compare(self, ask: ReadCodes) -> None:
        """Compare a few parameters with the block's words, for places not identified yet."""
        for comparison in list(self._comparisons.values()):
            codes = comparison.take() if comparison.length else []
            if not codes:
                continue
            before = await ask(codes)
            try:
                reply = await self.line.read(
                    self.device, comparison.block.address, comparison.length, priority=Priority.POLL
                )
            except DeviceException:
                comparison.todo.clear()
                continue
            self.heard()
            after = await ask(codes)
            comparison.proof.note(reply.words, before, after)
            comparison.proof.conclude(comparison.chosen)
        self._conclude()

    def _conclude(self) -> None:
        found: dict[str, int] = {}
        for comparison in self._comparisons.values():
            found |= comparison.in_force()
        self._in_force = found

    def _drop_proofs(self) -> None:
        # a comparison in progress continues, but its evidence is no longer used
        self._comparisons.clear()
        self._in_force = {}
