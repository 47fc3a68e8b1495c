"""Contents of a drive's indirect block or scanner, as far as they are certain.

A scanner's slots count as soon as they are written: they are read, and read again after each use
(the read plan sees to that). An indirect block's slots apply from the drive's next reset on, so
their present contents may not be what the block returns: the block is compared, a few parameters at
a time, with direct reads of every possible parameter.
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
"""Parameters compared between two cycles, so that no cycle waits long."""
ROUNDS = SURE + 1
"""Comparisons of each parameter, until they rest."""
TRY_AGAIN = 15.0
"""Seconds after which a block that is not sure yet is compared again."""
CALM = 1.0
"""Seconds without doubt about a reset before anything is proved."""

ReadCodes = Callable[[Iterable[str]], Awaitable[Mapping[str, Reading]]]


@dataclass(slots=True)
class _Comparison:
    """One indirect block: what is chosen for it, what is proved, what is to be compared yet."""

    block: Block
    proof: SlotEvidence
    chosen: dict[str, int] = field(default_factory=dict)
    """The slots that hold one of the block's choices, as last read."""
    todo: deque[str] = field(default_factory=deque)
    next_time: float = 0.0

    def choose(self, slots: Mapping[str, int], now: float) -> None:
        """Take the slots as they were read, and begin to compare where that is due."""
        known = {choice.raw for choice in self.block.choices}
        chosen = {s: slots[s] for s in self.block.slots if slots.get(s) in known}
        if chosen == self.chosen and (self.todo or now < self.next_time):
            return
        self.chosen, self.next_time = chosen, now + TRY_AGAIN
        self.proof.begin()
        self.todo = deque(self.proof.open_codes(chosen) * ROUNDS)

    @property
    def length(self) -> int:
        """Words up to the last place that something was chosen for; 0 where that is too few."""
        last = max((self.block.slots.index(slot) for slot in self.chosen), default=-1)
        return last + 1 if last + 1 >= self.block.min_words else 0

    def take(self) -> list[str]:
        """The parameters to compare now."""
        still_open = self.proof.open_codes(self.chosen)
        codes: list[str] = []
        while self.todo and len(codes) < COMPARED_AT_ONCE:
            if (code := self.todo.popleft()) in still_open and code not in codes:
                codes.append(code)
        return codes

    def in_force(self) -> dict[str, int]:
        """Raw values by slot of the places that are sure."""
        return {slot: raw for slot, raw in self.chosen.items() if self.proof.holds(slot, raw)}


@dataclass(slots=True)
class Slots:
    """The slots of one drive's read blocks; `ask` reads parameters at the priority of polls."""

    line: ModbusLine
    device: int
    profile: Profile
    clock: Clock
    learned: float = -math.inf
    """When the slots of a scanner were read last (session's clock)."""
    _known: dict[str, int] = field(default_factory=dict)
    _comparisons: dict[str, _Comparison] = field(default_factory=dict)
    """By the id of the block; forgotten whenever the drive may have been reset."""
    _in_force: dict[str, int] = field(default_factory=dict)
    """Slots that comparisons have confirmed."""
    _heard: float = 0.0
    _doubted: float = 0.0

    def in_force(self) -> dict[str, int]:
        """Raw values by slot that each place surely holds now."""
        awake = self.clock.monotonic() - self._heard <= ASLEEP
        return self._known | self._in_force if awake else dict(self._known)

    def heard(self) -> None:
        """The drive has answered: it was not switched off since it did so before, or long ago."""
        now = self.clock.monotonic()
        if now - self._heard > ASLEEP:
            self._drop_proofs()
        self._heard = now

    def distrust(self) -> None:
        """The drive may be reset now: what counts from then on is not what was proved."""
        self._drop_proofs()
        self._doubted = self.clock.monotonic()

    def forget(self) -> None:
        """Nothing is sure any more: the drive was silent, or another one answers now."""
        self._known.clear()
        self._drop_proofs()

    def compare_soon(self) -> None:
        """Compare again: parameters that looked alike may differ now."""
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
        """Compare a few parameters with what the block brings, where that is not sure yet."""
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
        # a comparison under way goes on with evidence that nobody looks at any more
        self._comparisons.clear()
        self._in_force = {}
