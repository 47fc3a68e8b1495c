"""What the slots of an indirect block or a communication scanner stand for, and changing that.

An assignment is a value: picking, moving and clearing make another one. Nothing is read or
written here.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from ..errors import DriveError, UnknownParameter
from ..profile.profile import Profile, is_verified, parse_address
from ..profile.schema import Block, Parameter
from ..values import word_count

UNUSED = 0
"""The raw value of a slot that stands for nothing."""
NONE = frozenset({"", "-", "--", "none", "off", "0", "w0", "16#0", "0x0"})
"""How a person may write that a slot is unused."""


class MappingError(DriveError):
    """A slot cannot hold what was asked for; the text says why and what to do."""


@dataclass(frozen=True, slots=True)
class Assignment:
    """The raw values of a block's slots, in their order; 0 where a slot is unused."""

    block: Block
    raws: tuple[int, ...]

    def with_raw(self, place: int, raw: int) -> Assignment:
        """The same with another raw value in one slot; places count from 0."""
        return replace(self, raws=(*self.raws[:place], raw, *self.raws[place + 1 :]))

    def cleared(self, place: int) -> Assignment:
        """The same with one slot unused."""
        return self.with_raw(place, UNUSED)

    def moved(self, place: int, step: int) -> Assignment:
        """The same with a slot's content one place up (-1) or down (1), the other one there."""
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
        """How many slots there are up to the last one in use."""
        return max((n for n, raw in enumerate(self.raws, start=1) if raw), default=0)


@dataclass(frozen=True, slots=True)
class SlotChange:
    """One slot whose raw value differs between two assignments."""

    slot: str
    old: int | None
    """None where it could not be read."""
    new: int


@dataclass(frozen=True, slots=True)
class Problem:
    """What is wrong with a slot of an assignment, as a sentence."""

    slot: str
    text: str
    refuses: bool = True
    """True where it must not be written so; else it is only to be known."""


def has_blocks(profile: Profile) -> bool:
    """Whether the family has an indirect block or a communication scanner at all."""
    return bool(profile.data.blocks)


def assignment(block: Block, raws: Mapping[str, int]) -> Assignment | None:
    """What the slots hold, given raw values by code; None unless all of them are known."""
    if not set(block.slots) <= raws.keys():
        return None
    return Assignment(block, tuple(raws[slot] & 0xFFFF for slot in block.slots))


def empty(block: Block) -> Assignment:
    """A block none of whose slots is used."""
    return Assignment(block, (UNUSED,) * len(block.slots))


def factory(profile: Profile, block: Block) -> Assignment:
    """A block as it leaves the factory; slots without a known setting are unused."""
    return Assignment(block, tuple(profile[slot].factory or UNUSED for slot in block.slots))


def slot_target(profile: Profile, block: Block, raw: int) -> Parameter | None:
    """The parameter that a slot's raw value stands for; None for unused and unknown ones."""
    if raw == UNUSED:
        return None
    if block.selects_by == "address":
        return profile.at(raw)
    chosen = next((c.parameter for c in block.choices if c.raw == raw), "")
    return profile.get(chosen)


def place_of(profile: Profile, slot: str) -> tuple[Block, int]:
    """The block and the place of a slot by its code, in any case; raises MappingError."""
    for block in profile.data.blocks:
        for place, code in enumerate(block.slots):
            if code.casefold() == slot.strip().casefold():
                return block, place
    known = [f"{b.slots[0]} to {b.slots[-1]}" for b in profile.data.blocks]
    hint = f" It has {', '.join(known)}." if known else f" {no_blocks(profile)}"
    raise MappingError(f"{profile.name} has no slot {slot!r}.{hint}")


def no_blocks(profile: Profile) -> str:
    """Why there is nothing to assign, and what serves instead; for a family without blocks."""
    function = profile.function(3)
    longest = function.max_read if function else None
    instead = (
        f" Up to {longest} neighbouring words come in one read instead."
        if longest and longest > 1
        else ""
    )
    return f"{profile.name} has neither an indirect block nor a communication scanner.{instead}"


def raw_of(profile: Profile, block: Block, parameter: Parameter) -> int:
    """The raw value that makes a slot stand for a parameter.

    Raises MappingError where the block cannot bring or take it.
    """
    if wrong := _against(profile, block, parameter):
        raise MappingError(wrong)
    if block.selects_by == "address":
        return parameter.address
    return next(c.raw for c in block.choices if c.parameter == parameter.code)


def pick(profile: Profile, today: Assignment, place: int, text: str) -> Assignment:
    """A slot standing for what a person names: a code, a number, an address, or `none`.

    Raises MappingError and UnknownParameter.
    """
    return today.with_raw(place, raw_named(profile, today.block, text))


def raw_named(profile: Profile, block: Block, text: str) -> int:
    """The raw value of a slot for what a person names; raises MappingError, UnknownParameter."""
    wanted = text.strip()
    if wanted.casefold() in NONE:
        return UNUSED
    try:
        parameter = profile.find(wanted)
    except UnknownParameter:
        address = parse_address(wanted)
        if block.selects_by != "address" or address is None:
            raise
        raise MappingError(
            f"{profile.name} has no parameter at {wanted} that is known here: what the drive"
            " would copy there is not known. Type a code, or `none`."
        ) from None
    return raw_of(profile, block, parameter)


def choices(profile: Profile, block: Block, search: str = "") -> list[Parameter]:
    """The parameters that a slot of the block can stand for, those that fit a search first.

    A search finds codes, numbers, addresses and names, and leaves out what holds none of its
    words.
    """
    if block.selects_by == "choice":
        offered = [profile[choice.parameter] for choice in block.choices]
    else:
        offered = sorted(profile.parameters, key=lambda parameter: parameter.address)
    fitting = [p for p in offered if not _against(profile, block, p)]
    wanted = search.casefold().split()
    if not wanted:
        return fitting
    found = [p for p in fitting if all(word in _words_of(p) for word in wanted)]
    return sorted(found, key=lambda p: not p.code.casefold().startswith(wanted[0]))


def slot_changes(before: Mapping[str, int], after: Assignment) -> list[SlotChange]:
    """The slots that would be written, against raw values by slot as they are."""
    return [
        SlotChange(slot, before.get(slot), raw)
        for slot, raw in after.slots.items()
        if before.get(slot) != raw
    ]


def steps(before: Mapping[str, int], after: Assignment) -> list[SlotChange]:
    """The writes that lead from one assignment to another, one slot at a time.

    A slot whose content goes to another slot is set to 0 first: at no moment do two slots
    stand for the same parameter, so an output is never taken from two places.
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
    # what becomes unused goes before what is taken into use
    return first + sorted(rest, key=lambda change: change.new != UNUSED)


def assignment_problems(
    profile: Profile, plan: Assignment, unreadable: Collection[str] = ()
) -> list[Problem]:
    """What is wrong with an assignment, or should be known of it, in the order of the slots.

    `unreadable` names parameters that this drive said it does not have.
    """
    found: list[Problem] = []
    seen: dict[int, str] = {}
    for slot, raw in plan.slots.items():
        if raw == UNUSED:
            continue
        found += _of_slot(profile, plan.block, slot, raw, unreadable)
        if raw in seen:
            name = _name(profile, plan.block, raw)
            found.append(
                Problem(slot, f"{slot}: {name} stands in {seen[raw]} already.", _writes(plan))
            )
        seen.setdefault(raw, slot)
    return found + _of_shape(plan)


def refusing(found: Iterable[Problem]) -> list[Problem]:
    """Those that keep an assignment from being written."""
    return [problem for problem in found if problem.refuses]


def _of_slot(
    profile: Profile, block: Block, slot: str, raw: int, unreadable: Collection[str]
) -> list[Problem]:
    parameter = slot_target(profile, block, raw)
    if parameter is None:
        what = f"{raw} (16#{raw:04X})"
        if block.selects_by == "choice":
            return [Problem(slot, f"{slot}: {what} is none of its {len(block.choices)} choices.")]
        text = f"{slot}: no parameter of {profile.name} is known at {what}."
        return [Problem(slot, text)]
    if wrong := _against(profile, block, parameter):
        return [Problem(slot, f"{slot}: {wrong}")]
    if parameter.code in unreadable:
        return [Problem(slot, f"{slot}: this drive says that it has no {parameter.code}.")]
    found = []
    if not is_verified(parameter):
        text = f"{slot}: {parameter.code} is unverified: no manual in hand confirms its address."
        found.append(Problem(slot, text, _writes_block(block)))
    if _writes_block(block) and parameter.access == "rw-stopped":
        text = f"{slot}: {parameter.code} is taken by the drive with the motor stopped only."
        found.append(Problem(slot, text, refuses=False))
    return found


def _of_shape(plan: Assignment) -> list[Problem]:
    """What the shape of the requests makes of the slots in use."""
    block, length = plan.block, plan.length
    if not length or not block.fixed_start:
        return []
    found = []
    holes = [slot for slot, raw in list(plan.slots.items())[:length] if raw == UNUSED]
    if holes and _writes_block(block):
        text = (
            f"{holes[0]} is unused: the drive refuses every write to this block (exception 4)"
            f" while {plan.block.slots[0]} stands for nothing."
        )
        found.append(Problem(holes[0], text))
    elif holes:
        text = f"{holes[0]} is unused: what stands behind it is not read through the block here."
        found.append(Problem(holes[0], text, refuses=False))
    if length < block.min_words:
        done = "written" if _writes_block(block) else "read"
        text = f"One slot alone is of no use: {block.min_words} words are {done} at least."
        found.append(Problem(block.slots[length], text, refuses=False))
    return found


def _against(profile: Profile, block: Block, parameter: Parameter) -> str:
    """Why a slot of this block cannot stand for a parameter; empty where it can."""
    code = parameter.code
    if block.selects_by == "choice" and code not in {c.parameter for c in block.choices}:
        codes = ", ".join(choice.parameter for choice in block.choices)
        return f"{code} is not in the list of {block.name.lower()}: {codes}."
    if word_count(parameter) != 1:
        return f"{code} takes two words; a slot carries one."
    if parameter.address == UNUSED:
        return f"{code} has the address 0, which stands for an unused slot."
    if block.direction == "read" and parameter.access == "w":
        return f"{code} can only be written; it cannot stand in {block.name.lower()}."
    if block.direction == "write" and parameter.access == "r":
        return f"{code} can only be read; it cannot stand in {block.name.lower()}."
    if block.direction == "write" and parameter.forbidden:
        return f"{code} is not written from here: {parameter.forbidden}"
    own = {c for b in profile.data.blocks for c in (*b.slots, *b.values)}
    if block.selects_by == "address" and code in own:
        return f"{code} belongs to the scanner itself."
    return ""


def _writes(plan: Assignment) -> bool:
    return _writes_block(plan.block)


def _writes_block(block: Block) -> bool:
    return block.direction == "write"


def _name(profile: Profile, block: Block, raw: int) -> str:
    parameter = slot_target(profile, block, raw)
    return parameter.code if parameter else f"{raw} (16#{raw:04X})"


def _words_of(parameter: Parameter) -> str:
    spelled = (parameter.code, parameter.number, parameter.name, str(parameter.address))
    return f"{' '.join(spelled)} 16#{parameter.address:04X}".casefold()


def describe(profile: Profile, block: Block, raw: int | None) -> str:
    """What a slot stands for in a few words: a code, `unused`, or the address alone."""
    if raw is None:
        return "-----"
    return "unused" if raw == UNUSED else _name(profile, block, raw)


def slots_of(plans: Sequence[Assignment]) -> dict[str, int]:
    """Raw values by slot of several blocks together."""
    return {slot: raw for plan in plans for slot, raw in plan.slots.items()}
