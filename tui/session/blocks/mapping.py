"""Slots of a drive's blocks, the values that they return, and a check of these values.

The value of a slot is compared with direct reads before and after. The slots of a scanner are read
again after each use: a word is valid only if its slot is unchanged. The effective slots of an
indirect block cannot be read until the drive's next reset. They are identified by the same
comparison, with every parameter that they may hold. `SlotEvidence` draws the conclusions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from tui.bus.api import Priority
from tui.bus.errors import DeviceException
from tui.bus.poll_plan import USUAL_TURNAROUND
from tui.drive.blocks.assignment import UNUSED, Assignment, assignment, slot_target
from tui.drive.blocks.wire_cost import span
from tui.drive.profile.schema import Block, Parameter
from tui.drive.read_plan import WireTiming
from tui.drive.shown import depends_on, shown
from tui.drive.values import NOT_AVAILABLE, from_words, word_count

from ..drive import DriveSession
from ..read.kept_plans import timing_on
from ..read.proof import SURE, SlotEvidence, SlotMatch
from ..read.retrying_reader import RetryingReader
from ..reading import Reading

COMPARISONS_MOST = 2 * SURE
"""Comparisons after which a slot stays unproved: equal values cannot be distinguished."""


class Force(StrEnum):
    """State of a slot: whether it already returns the chosen parameter."""

    ACTIVE = "active"
    PENDING = "pending"
    UNPROVED = "not proved"
    NOTHING = ""


@dataclass(frozen=True, slots=True)
class Slot:
    """One slot with everything that was read of it at one time."""

    code: str
    raw: int | None
    """Value of the slot in the drive; None if it could not be read."""
    parameter: Parameter | None = None
    """Mapped parameter; None if the slot is unused or holds an unknown address."""
    word: int | None = None
    """The raw value that the block returned."""
    text: str = NOT_AVAILABLE
    """The same as a person reads it, with its unit."""
    direct: Reading | None = None
    verdict: SlotMatch = SlotMatch.UNREAD
    force: Force = Force.NOTHING
    returned_code: str = ""
    """Code of the parameter that it returns instead of the chosen one, if that is certain."""

    @property
    def direct_text(self) -> str:
        """The parameter read directly, with its unit."""
        reading = self.direct
        return f"{reading.text} {reading.unit}".strip() if reading else NOT_AVAILABLE


@dataclass(frozen=True, slots=True)
class BlockView:
    """All slots of one block at one time."""

    block: Block
    slots: tuple[Slot, ...]
    trouble: str = ""
    """Why the block returned no value, or none that is certain; else empty."""

    @property
    def is_doubtful(self) -> bool:
        """True if a slot seems to return another value than its parameter."""
        read = self.slots if self.block.direction == "read" else ()
        return any(
            slot.verdict is SlotMatch.DIFFERS
            or (slot.verdict is SlotMatch.NONE and slot.force is Force.UNPROVED)
            for slot in read
        )

    @property
    def is_unproved(self) -> bool:
        """True if the parameter of a slot's value is not certain yet."""
        return any(s.word is not None and s.force is Force.UNPROVED for s in self.slots)

    @property
    def raws(self) -> dict[str, int]:
        """Raw values by slot, for slots that could be read."""
        return {slot.code: slot.raw for slot in self.slots if slot.raw is not None}

    @property
    def plan(self) -> Assignment | None:
        """The assignment that the drive holds; None if a slot could not be read."""
        return assignment(self.block, self.raws)


def wire_timing(session: DriveSession) -> WireTiming:
    """Return the time of an exchange, from the line's settings and measurements."""
    usual = session.line.device_state(session.device).usual_turnaround
    return timing_on(session.line.link, usual or USUAL_TURNAROUND)


@dataclass(slots=True)
class Mapper:
    """Reads the blocks of one drive. Raises the line's errors."""

    session: DriveSession
    in_force: Callable[[], Mapping[str, int]] = dict
    """Raw values by slot, which a monitor has confirmed for each place."""
    priority: Priority = Priority.OPERATOR_READ
    written: dict[str, int] = field(default_factory=dict)
    """Slots that this program has written and that take effect after a reset, not seen yet."""
    _asker: RetryingReader = field(init=False)

    def __post_init__(self) -> None:
        self._asker = RetryingReader(self.session, self.priority)

    def note_reset(self) -> None:
        """Note that the drive may have restarted, so that earlier slots may take effect now."""
        self.written = {}

    async def slots(self, block: Block) -> dict[str, int]:
        """Read the raw values of a block's slots."""
        return await self._asker.ask_raws(block.slots)

    async def look(self, block: Block, *, rounds: int = 1) -> BlockView:
        """Return the slots of a block with their values, direct reads, and the result of comparing
        them.

        More rounds increase the certainty. A slot differs only if it differs in every round, and is
        the same only if it is the same in every round. A slot that seems to differ is compared
        again in any case. With SURE rounds, so is a slot that is not identified yet.
        """
        proof, view = SlotEvidence(self.session.profile, block), BlockView(block, ())
        for number in range(1, COMPARISONS_MOST + 1):
            view = await self._round(proof, view)
            doubtful = view.is_doubtful if number < SURE else rounds >= SURE and view.is_unproved
            if number >= rounds and not doubtful:
                break
        return view

    async def verify(self, block: Block) -> BlockView:
        """Return the same, after several comparisons."""
        return await self.look(block, rounds=SURE)

    async def _round(self, proof: SlotEvidence, earlier: BlockView) -> BlockView:
        """Compare once: direct reads, the block, direct reads, and the slots again."""
        block, profile = proof.block, self.session.profile
        held = await self.slots(block)
        if held != earlier.raws:
            # earlier comparisons do not apply to these slots
            proof.begin()
        chosen = {
            slot: slot_target(profile, block, held[slot]) if slot in held else None
            for slot in block.slots
        }
        codes = self._to_ask(block, chosen.values())
        before = await self._direct(codes)
        words, trouble = await self._words(block, held)
        after = await self._direct(codes) if words else before
        still = held
        if words and block.effective == "at-once":
            still = await self.slots(block)
        if still != held:
            # one slot has changed: others may have changed and changed back
            proof.begin()
            changed = tuple(
                Slot(slot, still.get(slot), verdict=SlotMatch.CHANGED) for slot in block.slots
            )
            return BlockView(block, changed, "The slots changed while they were read.")
        proof.note(words, before, after)
        found = []
        for place, slot in enumerate(block.slots):
            was = earlier.slots[place] if earlier.slots else None
            word = words[place] if place < len(words) else None
            now = Slot(slot, held.get(slot), chosen[slot], word)
            found.append(self._slot(proof, now, was, after))
        return BlockView(block, tuple(found), trouble)

    def _to_ask(self, block: Block, chosen: Iterable[Parameter | None]) -> list[str]:
        """Return the codes to read directly: the chosen ones; for an indirect block all possible
        ones."""
        wanted = [p.code for p in chosen if p is not None]
        if block.effective == "after-reset" and block.direction == "read" and wanted:
            wanted += [choice.parameter for choice in block.choices]
        profile = self.session.profile
        for parameter in map(profile.__getitem__, tuple(wanted)):
            wanted += depends_on(parameter)
        return [code for code in dict.fromkeys(wanted) if profile[code].access != "w"]

    async def _direct(self, codes: Sequence[str]) -> dict[str, Reading]:
        return await self._asker.ask(codes) if codes else {}

    async def _words(self, block: Block, held: Mapping[str, int]) -> tuple[tuple[int, ...], str]:
        """Return the words of the block up to its last slot in use; else the reason why there are
        none."""
        plan = assignment(block, held)
        if plan is None:
            missing = ", ".join(slot for slot in block.slots if slot not in held)
            return (), f"{missing} cannot be read."
        stretch = span(plan)
        if stretch is None:
            return (), ""
        if block.direction == "write" and not block.values:
            return (), f"{block.name} can only be written: its words cannot be read."
        try:
            reply = await self.session.line.read(
                self.session.device, *stretch, priority=self.priority
            )
        except DeviceException as refusal:
            return (), f"The drive refuses reads of {block.name}: {refusal}"
        return reply.words, ""

    def _slot(
        self, proof: SlotEvidence, now: Slot, was: Slot | None, direct: Mapping[str, Reading]
    ) -> Slot:
        """Return a slot with its value and the result of the comparison."""
        slot, raw, parameter, word = now.code, now.raw, now.parameter, now.word
        if was is not None and was.raw != raw:
            return Slot(slot, raw, parameter, verdict=SlotMatch.CHANGED)
        if raw == UNUSED:
            return Slot(slot, raw, verdict=SlotMatch.UNUSED)
        if raw is None or parameter is None:
            return Slot(slot, raw, word=word, verdict=SlotMatch.NONE)
        force, returned = self._force(proof, slot, raw)
        reported = replace(
            now, direct=direct.get(parameter.code), force=force, returned_code=returned
        )
        if word is None or word_count(parameter) != 1:
            return replace(reported, word=None)
        if word == self.session.profile.data.reading.unknown_word:
            return replace(reported, verdict=SlotMatch.NONE)
        verdict, through = proof.verdict(slot, parameter.code), from_words(parameter, [word])
        if (
            verdict is SlotMatch.MOVING
            and was is not None
            and not proof.fitted(slot, parameter.code)
        ):
            # its value from the round in which it matched
            return replace(was, verdict=verdict, force=force, returned_code=returned)
        text = self._text(parameter, through)
        if verdict is SlotMatch.DIFFERS and proof.block.direction == "read":
            # it is not the value of this parameter, so it has neither its scale nor its unit
            text = f"raw {word}"
        return replace(reported, word=through, text=text, verdict=verdict)

    def _text(self, parameter: Parameter, raw: int) -> str:
        profile, retrying = self.session.profile, self._asker
        return shown(profile, parameter, raw, retrying.raws, retrying.lacking).display

    def _force(self, proof: SlotEvidence, slot: str, raw: int) -> tuple[Force, str]:
        """Return whether the slot is in force, and the value that it returns instead."""
        # the monitor compares continuously, and may have identified it
        known = proof.block.effective == "at-once" or self.in_force().get(slot) == raw
        if known or proof.holds(slot, raw):
            return Force.ACTIVE, ""
        if proof.excludes(slot, raw):
            return Force.PENDING, proof.returned_code(slot)
        return (Force.PENDING if self.written.get(slot) == raw else Force.UNPROVED), ""
