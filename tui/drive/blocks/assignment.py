"""Assignments of the slots of an indirect block or communication scanner, and their changes.

An assignment is a value: moving and clearing make another one. Nothing is read or written here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..errors import DriveError, UnknownParameter
from ..profile.profile import Profile
from ..profile.schema import Block, Parameter

UNUSED = 0
"""Raw value of an unused slot."""


class MappingError(DriveError):
    """A slot cannot hold the requested value; the text says why and what to do."""


class UnknownSlot(MappingError, UnknownParameter):
    """A profile has no slot with the typed code."""


@dataclass(frozen=True, slots=True)
class Assignment:
    """Raw values of a block's slots, in their order; 0 for an unused slot."""

    block: Block
    raws: tuple[int, ...]

    def with_raw(self, place: int, raw: int) -> Assignment:
        """Return a copy with another raw value in one slot; places count from 0."""
        return replace(self, raws=(*self.raws[:place], raw, *self.raws[place + 1 :]))

    def cleared(self, place: int) -> Assignment:
        """Return a copy with one slot unused."""
        return self.with_raw(place, UNUSED)

    def moved(self, place: int, step: int) -> Assignment:
        """Return a copy with a slot swapped with the one above (-1) or below (1) it."""
        other = place + step
        if not (0 <= place < len(self.raws) and 0 <= other < len(self.raws)):
            return self
        return self.with_raw(place, self.raws[other]).with_raw(other, self.raws[place])

    @property
    def slots(self) -> dict[str, int]:
        """Raw values by the code of the slot."""
        return dict(zip(self.block.slots, self.raws, strict=True))

    @property
    def length(self) -> int:
        """Number of slots up to the last one in use."""
        return max((n for n, raw in enumerate(self.raws, start=1) if raw), default=0)


@dataclass(frozen=True, slots=True)
class SlotChange:
    """One slot whose raw value differs between two assignments."""

    slot: str
    old: int | None
    """None if it could not be read."""
    new: int


def has_blocks(profile: Profile) -> bool:
    """Return True if the family has an indirect block or a communication scanner."""
    return bool(profile.data.blocks)


def assignment(block: Block, raws: Mapping[str, int]) -> Assignment | None:
    """Return the assignment for raw values by code; None unless all slots are known."""
    if not set(block.slots) <= raws.keys():
        return None
    return Assignment(block, tuple(raws[slot] & 0xFFFF for slot in block.slots))


def empty(block: Block) -> Assignment:
    """Return an assignment with all slots unused."""
    return Assignment(block, (UNUSED,) * len(block.slots))


def factory(profile: Profile, block: Block) -> Assignment:
    """Return the factory assignment; slots without a known factory setting are unused."""
    return Assignment(block, tuple(profile[slot].factory or UNUSED for slot in block.slots))


def slot_target(profile: Profile, block: Block, raw: int) -> Parameter | None:
    """Return the parameter that a slot's raw value selects; None if unused or unknown."""
    if raw == UNUSED:
        return None
    if block.selects_by == "address":
        return profile.at(raw)
    chosen = next((c.parameter for c in block.choices if c.raw == raw), "")
    return profile.get(chosen)


def place_of(profile: Profile, slot: str) -> tuple[Block, int]:
    """Return block and place of a slot by its code, ignoring case; raises UnknownSlot."""
    for block in profile.data.blocks:
        for place, code in enumerate(block.slots):
            if code.casefold() == slot.strip().casefold():
                return block, place
    known = [f"{b.slots[0]} to {b.slots[-1]}" for b in profile.data.blocks]
    hint = f"It has {', '.join(known)}." if known else no_blocks(profile)
    raise UnknownSlot(f"{profile.name} has no slot {slot!r}. {hint}")


def no_blocks(profile: Profile) -> str:
    """Return a text for a family without blocks: why, and what to use instead."""
    function = profile.function(3)
    longest = function.max_read if function else None
    text = f"{profile.name} has neither an indirect block nor a communication scanner."
    if not longest or longest <= 1:
        return text
    return f"{text} One read returns up to {longest} adjacent words instead."


def slot_changes(before: Mapping[str, int], after: Assignment) -> list[SlotChange]:
    """Return the slots that differ from the present raw values by slot."""
    return [
        SlotChange(slot, before.get(slot), raw)
        for slot, raw in after.slots.items()
        if before.get(slot) != raw
    ]


def steps(before: Mapping[str, int], after: Assignment) -> list[SlotChange]:
    """Return the writes that lead from one assignment to another, one slot at a time.

    A slot whose content goes to another slot is cleared first. So two slots never select the same
    parameter, and an output is never written from two places.
    """
    found = slot_changes(before, after)
    wanted = {change.new for change in found} - {UNUSED}
    freed = [c for c in found if c.old not in (None, UNUSED) and c.old in wanted]
    first = [SlotChange(change.slot, change.old, UNUSED) for change in freed]
    zeroed = {change.slot for change in first}
    rest = [
        replace(change, old=UNUSED) if change.slot in zeroed else change
        for change in found
        if not (change.slot in zeroed and change.new == UNUSED)
    ]
    # slots that become unused are written before slots that come into use
    return first + sorted(rest, key=lambda change: change.new != UNUSED)


def _name(profile: Profile, block: Block, raw: int) -> str:
    parameter = slot_target(profile, block, raw)
    return parameter.code if parameter else f"{raw} (16#{raw:04X})"


def describe(profile: Profile, block: Block, raw: int | None) -> str:
    """Describe a slot in a few words: a code, `unused`, or the address alone."""
    if raw is None:
        return "-----"
    return "unused" if raw == UNUSED else _name(profile, block, raw)


def slots_of(plans: Sequence[Assignment]) -> dict[str, int]:
    """Return the raw values by slot of several blocks."""
    return {slot: raw for plan in plans for slot, raw in plan.slots.items()}
