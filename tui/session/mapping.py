"""What the slots of a drive's blocks stand for now, what they bring, and whether that is right.

What a slot brings is compared with direct reads before and after. The slots of a scanner are
read again after each use: a word counts only when its slot still stands for the same. What an
indirect block really brings until the drive's next reset cannot be read; it is told by the same
comparison, with every parameter that could stand in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from tui.bus.errors import DeviceException
from tui.bus.line import Priority
from tui.bus.link import TcpLink, character_time, silence
from tui.drive.mapping import UNUSED, Assignment, assignment, target
from tui.drive.mapping_wire import span
from tui.drive.read_plan import WireTiming
from tui.drive.schema import Block, Parameter
from tui.drive.shown import shown
from tui.drive.values import NOT_AVAILABLE, from_words, word_count

from .asking import Asker
from .drive import DriveSession
from .readings import Reading
from .verdict import Verdict, compare

ROUNDS = 3
"""Comparisons that must all fail before a slot is said to bring something else."""
USUAL_TURNAROUND = 0.005


class Force(StrEnum):
    """Whether a slot already brings what was chosen for it."""

    ACTIVE = "active"
    PENDING = "pending"
    UNPROVED = "not proved"
    NOTHING = ""


@dataclass(frozen=True, slots=True)
class Slot:
    """One slot with all that was seen of it at one time."""

    code: str
    raw: int | None
    """What the slot holds in the drive; None where it could not be read."""
    parameter: Parameter | None = None
    """What it stands for; None where it is unused or holds an address nobody knows."""
    word: int | None = None
    """The raw value that came through the block."""
    text: str = NOT_AVAILABLE
    """The same as a person reads it, with its unit."""
    direct: Reading | None = None
    verdict: Verdict = Verdict.UNREAD
    force: Force = Force.NOTHING
    brings: str = ""
    """Code of what it brings in place of what was chosen, where that is sure."""

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
    """Why the block brought nothing, or nothing sure; else empty."""

    @property
    def raws(self) -> dict[str, int]:
        """Raw values by slot, of those that could be read."""
        return {slot.code: slot.raw for slot in self.slots if slot.raw is not None}

    @property
    def plan(self) -> Assignment | None:
        """The assignment that the drive holds; None where a slot could not be read."""
        return assignment(self.block, self.raws)


def wire_timing(session: DriveSession) -> WireTiming:
    """What the session's line takes for an exchange, by its settings and what was measured."""
    link = session.line.link
    turnaround = session.line.device_state(session.device).usual_turnaround or USUAL_TURNAROUND
    if isinstance(link, TcpLink):
        return WireTiming(character=0.0, silence=0.0, turnaround=turnaround)
    return WireTiming(character_time(link), silence(link), turnaround)


@dataclass(slots=True)
class Mapper:
    """Looks at the blocks of one drive; raises the line's errors."""

    session: DriveSession
    in_force: Callable[[], Mapping[str, int]] = dict
    """Raw values by slot of what a monitor has proved to stand in each place."""
    priority: Priority = Priority.OPERATOR_READ
    written: dict[str, int] = field(default_factory=dict)
    """Slots written from here that count after a reset, which was not seen yet."""
    _asker: Asker = field(init=False)

    def __post_init__(self) -> None:
        self._asker = Asker(self.session, self.priority)

    @property
    def lacking(self) -> frozenset[str]:
        """Parameters that the drive said it does not have."""
        return self.session.image.lacking

    def note_reset(self) -> None:
        """The drive may have been reset or switched off: what was written before may count now."""
        self.written = {}

    async def slots(self, block: Block) -> dict[str, int]:
        """Raw values of a block's slots as the drive holds them now."""
        return await self._asker.ask_raws(block.slots)

    async def look(self, block: Block, *, rounds: int = 1) -> BlockView:
        """The slots of a block, what each brings, the same read directly, and the verdict.

        More rounds make surer: a slot differs only if every round says so, and is the same only
        if every one says that. Where a slot seems to differ, it is looked at again anyway.
        """
        held = await self.slots(block)
        view = await self._round(block, held)
        for number in range(1, ROUNDS):
            reads = block.direction == "read"
            doubtful = reads and any(slot.verdict is Verdict.DIFFERS for slot in view.slots)
            if number >= rounds and not doubtful:
                break
            again = await self._round(block, await self.slots(block))
            view = _both(view, again)
        return view

    async def verify(self, block: Block) -> BlockView:
        """The same, compared several times."""
        return await self.look(block, rounds=ROUNDS)

    async def _round(self, block: Block, held: Mapping[str, int]) -> BlockView:
        """One comparison: direct, block, direct, and the slots again."""
        profile = self.session.profile
        chosen = {
            slot: target(profile, block, held[slot]) if slot in held else None
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
            # one slot was seen to change: others may have, there and back again
            changed = tuple(
                Slot(slot, still.get(slot), verdict=Verdict.CHANGED) for slot in block.slots
            )
            return BlockView(block, changed, "The slots were changed while they were looked at.")
        found = []
        for place, slot in enumerate(block.slots):
            word = words[place] if place < len(words) else None
            raw = held.get(slot)
            found.append(self._slot(block, slot, raw, chosen[slot], word, before, after))
        return BlockView(block, tuple(found), trouble)

    def _to_ask(self, block: Block, chosen: Iterable[Parameter | None]) -> list[str]:
        """What is read directly: the chosen ones; for an indirect block all that could be."""
        wanted = [p.code for p in chosen if p is not None]
        if block.effective == "after-reset" and block.direction == "read" and wanted:
            wanted += [choice.parameter for choice in block.choices]
        profile = self.session.profile
        for parameter in map(profile.__getitem__, tuple(wanted)):
            sources = (parameter.scale_by, parameter.unit_by)
            wanted += [source.parameter for source in sources if source is not None]
        return [code for code in dict.fromkeys(wanted) if profile[code].access != "w"]

    async def _direct(self, codes: Sequence[str]) -> dict[str, Reading]:
        return await self._asker.ask(codes) if codes else {}

    async def _words(self, block: Block, held: Mapping[str, int]) -> tuple[tuple[int, ...], str]:
        """The words that the block brings, up to its last slot in use; else why there are none."""
        plan = assignment(block, held)
        if plan is None:
            missing = ", ".join(slot for slot in block.slots if slot not in held)
            return (), f"{missing} cannot be read."
        stretch = span(plan)
        if stretch is None:
            return (), ""
        if block.direction == "write" and not block.values:
            return (), f"{block.name} can only be written: what it would take cannot be read."
        try:
            reply = await self.session.line.read(
                self.session.device, *stretch, priority=self.priority
            )
        except DeviceException as refusal:
            return (), f"The drive refuses the {block.name.lower()}: {refusal}"
        return reply.words, ""

    def _slot(
        self,
        block: Block,
        slot: str,
        raw: int | None,
        parameter: Parameter | None,
        word: int | None,
        before: Mapping[str, Reading],
        after: Mapping[str, Reading],
    ) -> Slot:
        if raw == UNUSED:
            return Slot(slot, raw, verdict=Verdict.UNUSED)
        if raw is None or parameter is None:
            return Slot(slot, raw, word=word, verdict=Verdict.NONE)
        direct = after.get(parameter.code)
        force, brings = self._force(block, slot, raw, word, before, after)
        base = Slot(slot, raw, parameter, direct=direct, force=force, brings=brings)
        if word is None or word_count(parameter) != 1:
            return base
        through = self._through(parameter, word)
        if through is None:
            return Slot(slot, raw, parameter, word, NOT_AVAILABLE, direct, Verdict.NONE, force)
        verdict = compare(parameter, through, before.get(parameter.code), direct)
        text = self._text(parameter, through)
        if verdict is Verdict.DIFFERS and block.direction == "read":
            # it is not this parameter's value: it gets neither its scale nor its unit
            text = f"raw {word}"
        return Slot(slot, raw, parameter, through, text, direct, verdict, force, brings)

    def _text(self, parameter: Parameter, raw: int) -> str:
        profile, asker = self.session.profile, self._asker
        return shown(profile, parameter, raw, asker.raws, asker.lacking).display

    def _through(self, parameter: Parameter, word: int) -> int | None:
        """The raw value of a word; None where it stands for no value."""
        if word == self.session.profile.data.reading.unknown_word:
            return None
        return from_words(parameter, [word])

    def _force(
        self,
        block: Block,
        slot: str,
        raw: int,
        word: int | None,
        before: Mapping[str, Reading],
        after: Mapping[str, Reading],
    ) -> tuple[Force, str]:
        """Whether the slot is in force, and what it brings where that is something else."""
        if block.effective == "at-once":
            return Force.ACTIVE, ""
        if self.in_force().get(slot) == raw:
            # the monitor compares all the time, and has proved it
            return Force.ACTIVE, ""
        waits = self.written.get(slot) == raw
        if word is None or block.direction == "write":
            return (Force.PENDING if waits else Force.UNPROVED), ""
        profile = self.session.profile
        fits = [
            choice
            for choice in block.choices
            if compare(
                profile[choice.parameter],
                from_words(profile[choice.parameter], [word]),
                before.get(choice.parameter),
                after.get(choice.parameter),
            )
            is not Verdict.DIFFERS
        ]
        raws = {choice.raw for choice in fits}
        if raws == {raw}:
            return Force.ACTIVE, ""
        if raw not in raws:
            return Force.PENDING, fits[0].parameter if len(fits) == 1 else ""
        return (Force.PENDING if waits else Force.UNPROVED), ""


def _both(one: BlockView, other: BlockView) -> BlockView:
    """Two comparisons taken together: the later values, the verdict of both."""
    slots = tuple(_two(a, b) for a, b in zip(one.slots, other.slots, strict=True))
    return BlockView(other.block, slots, other.trouble)


def _two(one: Slot, other: Slot) -> Slot:
    if one.raw != other.raw:
        return Slot(other.code, other.raw, other.parameter, verdict=Verdict.CHANGED)
    verdict = other.verdict
    if one.verdict != verdict and {one.verdict, verdict} <= _COMPARED:
        verdict = Verdict.MOVING
    force = other.force
    if one.force is not other.force:
        # one comparison that leaves a single parameter is enough, if none speaks against it
        against = Force.PENDING in (one.force, other.force)
        force = Force.UNPROVED if against else Force.ACTIVE
    if verdict is Verdict.MOVING and other.verdict is Verdict.DIFFERS:
        # its value of the round in which it fitted
        other = replace(other, word=one.word, text=one.text, direct=one.direct, brings="")
    brings = other.brings if force is Force.PENDING else ""
    return Slot(
        other.code,
        other.raw,
        other.parameter,
        other.word,
        other.text,
        other.direct,
        verdict,
        force,
        brings,
    )


_COMPARED = frozenset({Verdict.SAME, Verdict.MOVING, Verdict.DIFFERS})
