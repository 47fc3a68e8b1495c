"""Rules for the slots of a block or scanner, and problems of an assignment."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from ..profile.profile import Profile, is_verified
from ..profile.schema import Block, Parameter
from ..values import word_count
from .assignment import UNUSED, Assignment, describe, slot_target


@dataclass(frozen=True, slots=True)
class Problem:
    """Problem of a slot of an assignment, as a sentence."""

    slot: str
    text: str
    refuses: bool = True
    """True if it prevents the write; False if it is only a remark."""


def assignment_problems(
    profile: Profile, plan: Assignment, unreadable: Collection[str] = ()
) -> list[Problem]:
    """Return problems and remarks of an assignment, in the order of the slots.

    `unreadable` are codes of parameters that this drive reported as missing.
    """
    found: list[Problem] = []
    seen: dict[int, str] = {}
    for slot, raw in plan.slots.items():
        if raw == UNUSED:
            continue
        found += _slot_problems(profile, plan.block, slot, raw, unreadable)
        if raw in seen:
            name = describe(profile, plan.block, raw)
            text = f"{slot}: {name} is already in {seen[raw]}."
            found.append(Problem(slot, text, _writes_block(plan.block)))
        seen.setdefault(raw, slot)
    return found + _shape_problems(plan)


def refusing(found: Iterable[Problem]) -> list[Problem]:
    """Return the problems that prevent the write of an assignment."""
    return [problem for problem in found if problem.refuses]


def _slot_problems(
    profile: Profile, block: Block, slot: str, raw: int, unreadable: Collection[str]
) -> list[Problem]:
    parameter = slot_target(profile, block, raw)
    if parameter is None:
        what = f"{raw} (16#{raw:04X})"
        if block.selects_by == "choice":
            text = f"{slot}: {what} is not one of its {len(block.choices)} choices."
            return [Problem(slot, text)]
        text = f"{slot}: no parameter of {profile.name} is known at {what}."
        return [Problem(slot, text)]
    if wrong := reason_against(profile, block, parameter):
        return [Problem(slot, f"{slot}: {wrong}")]
    if parameter.code in unreadable:
        return [Problem(slot, f"{slot}: this drive reports that it has no {parameter.code}.")]
    found = []
    if not is_verified(parameter):
        text = f"{slot}: no available manual confirms the address of {parameter.code}."
        found.append(Problem(slot, text, _writes_block(block)))
    if _writes_block(block) and parameter.access == "rw-stopped":
        text = f"{slot}: the drive accepts {parameter.code} only with the motor stopped."
        found.append(Problem(slot, text, refuses=False))
    return found


def _shape_problems(plan: Assignment) -> list[Problem]:
    """Return the problems of the slots that follow from the shape of the requests."""
    block, length = plan.block, plan.length
    if not length or not block.fixed_start:
        return []
    found = []
    holes = [slot for slot, raw in list(plan.slots.items())[:length] if raw == UNUSED]
    if holes and _writes_block(block):
        text = (
            f"{holes[0]} is unused: the drive refuses every write to this block (exception 4)"
            f" while {plan.block.slots[0]} is not mapped."
        )
        found.append(Problem(holes[0], text))
    elif holes:
        text = f"{holes[0]} is unused, so the slots after it are not read through the block."
        found.append(Problem(holes[0], text, refuses=False))
    if length < block.min_words:
        text = _FEW_WRITTEN if _writes_block(block) else _FEW_READ
        text = text.format(words=block.min_words)
        found.append(Problem(block.slots[length], text, refuses=False))
    return found


_FEW_WRITTEN = "Map more slots: at least {words} words are written at once."
_FEW_READ = "Map more slots: at least {words} words are read at once."


def reason_against(profile: Profile, block: Block, parameter: Parameter) -> str:
    """Return why a slot of this block cannot select a parameter; empty if it can."""
    code = parameter.code
    if block.selects_by == "choice" and code not in {c.parameter for c in block.choices}:
        codes = ", ".join(choice.parameter for choice in block.choices)
        return f"{block.name} cannot hold {code}. It can hold {codes}."
    if parameter.is_bits:
        return f"{code} is on coils or discrete inputs; a slot holds a register."
    if word_count(parameter) != 1:
        return f"{code} has two words; a slot holds one."
    if parameter.address == UNUSED:
        return f"{code} has the address 0, which marks an unused slot."
    if block.direction == "read" and parameter.access == "w":
        return f"{code} can only be written. {block.name} cannot hold it."
    if block.direction == "write" and parameter.access == "r":
        return f"{code} can only be read. {block.name} cannot hold it."
    if block.direction == "write" and parameter.forbidden:
        return f"{code} is never written by Drive Panel: {parameter.forbidden}"
    own = {c for b in profile.data.blocks for c in (*b.slots, *b.values)}
    if block.selects_by == "address" and code in own:
        return f"{code} belongs to the scanner itself, so no slot can hold it."
    return ""


def _writes_block(block: Block) -> bool:
    return block.direction == "write"
