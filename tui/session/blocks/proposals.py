"""Proposed assignments for the blocks of one drive; nothing is written here.

For the thread of the screen. A proposal is kept until it is written or discarded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from tui.drive.blocks.assignment import (
    Assignment,
    MappingError,
    SlotChange,
    assignment,
    factory,
    slot_changes,
    slot_target,
    slots_of,
)
from tui.drive.blocks.picking import pick
from tui.drive.blocks.slot_rules import Problem, assignment_problems
from tui.drive.blocks.wire_cost import Saving, Stretch, best_assignment, saving, stretches
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block, Quantity

from ..drive import DriveSession
from ..monitor.rates import monitoring_codes, rates_of
from ..monitor.trend import readout_parameter
from .mapping import wire_timing

LARGE: tuple[Quantity, ...] = ("output_frequency", "motor_current")
"""Quantities in Monitor's large figures."""


@dataclass(slots=True)
class Proposals:
    """The assignments that are proposed for a drive's blocks, and their results."""

    session: DriveSession
    busy: Callable[[], bool]
    """Returns True while something is being written; nothing can be proposed then."""
    plans: dict[str, Assignment] = field(default_factory=dict)
    """Proposals by the id of the block, if they differ from the present assignment."""
    seen: dict[str, dict[str, int]] = field(default_factory=dict)
    """The slots as the person saw them when the proposal began, by the id of the block."""
    _costs: dict[object, Saving] = field(default_factory=dict)

    @property
    def blocks(self) -> list[Block]:
        """The blocks of the family, those for reading first."""
        return sorted(self.session.profile.data.blocks, key=lambda b: b.direction != "read")

    def today(self, block: Block) -> Assignment | None:
        """Return the present assignment; None while it is not known."""
        raws = self.session.image.raws
        return assignment(block, {slot: raws[slot] for slot in block.slots if slot in raws})

    def proposed(self, block: Block) -> Assignment | None:
        """Return the proposal, else the present assignment."""
        return self.plans.get(block.id) or self.today(block)

    @property
    def assignments(self) -> list[Assignment]:
        """Proposal, else present assignment, of every block for which one is known."""
        return [plan for block in self.blocks if (plan := self.proposed(block))]

    @property
    def count(self) -> int:
        """Number of slots that writing the proposals would change now."""
        return sum(len(self.changes(block)) for block in self.blocks)

    def propose(self, plan: Assignment) -> None:
        """Propose an assignment; one that equals the present assignment is not a proposal. Raises
        MappingError."""
        today = self.today(plan.block)
        if today is None:
            raise MappingError(f"Not read yet: {plan.block.name}. Wait until it is.")
        if self.busy():
            raise MappingError("Not proposed: a write is in progress. Wait until it ends.")
        if plan.raws == today.raws:
            self.plans.pop(plan.block.id, None)
            return
        if plan.block.id not in self.plans:
            self.seen[plan.block.id] = today.slots
        self.plans[plan.block.id] = plan

    def pick(self, block: Block, place: int, text: str) -> None:
        """Propose the typed content of a slot. Raises MappingError, UnknownParameter."""
        self.propose(pick(self.session.profile, self._base(block), place, text))

    def move(self, block: Block, place: int, step: int) -> None:
        """Propose to move a slot's content one place up or down. Raises MappingError."""
        self.propose(self._base(block).moved(place, step))

    def clear(self, block: Block, place: int) -> None:
        """Propose to unmap a slot. Raises MappingError."""
        self.propose(self._base(block).cleared(place))

    def factory(self, block: Block) -> None:
        """Propose the factory assignment. Raises MappingError."""
        self.propose(factory(self.session.profile, block))

    def best(self) -> Saving | None:
        """Propose the assignment that shortens Monitor's cycle most; return the savings, None if
        none.

        Raises MappingError if the block was not read yet or a write is in progress.
        """
        block = next((block for block in self.blocks if block.direction == "read"), None)
        if block is None:
            raise MappingError("This drive has no block for reading.")
        timing, profile = wire_timing(self.session), self.session.profile
        today = self._base(block)
        others = slots_of([plan for plan in self.assignments if plan.block is not block])
        codes = rates_of(profile).fast
        plan = best_assignment(profile, block, codes, timing, others)
        before, after = {**others, **today.slots}, {**others, **plan.slots}
        found = saving(profile, codes, timing, before, after)
        if found.microseconds <= 0:
            return None
        self.propose(plan)
        return found

    def drop(self) -> None:
        """Discard all proposals."""
        self.plans.clear()
        self.seen.clear()

    def _base(self, block: Block) -> Assignment:
        plan = self.proposed(block)
        if plan is None:
            raise MappingError(f"Not read yet: {block.name}. Wait until it is.")
        return plan

    def changes(self, block: Block) -> list[SlotChange]:
        """Return the changes of writing the proposal now."""
        plan, today = self.plans.get(block.id), self.today(block)
        return slot_changes(today.slots, plan) if plan and today else []

    def problems(self, block: Block) -> list[Problem]:
        """Return the problems of the proposal, or of the present assignment if there is none."""
        plan = self.proposed(block)
        return (
            assignment_problems(self.session.profile, plan, self.session.image.lacking)
            if plan
            else []
        )

    def saving(self) -> Saving | None:
        """Return the time of a fast monitoring cycle with the present and with the proposed
        slots."""
        today = [plan for block in self.blocks if (plan := self.today(block))]
        if not today:
            return None
        timing = wire_timing(self.session)
        before_raws, after_raws = slots_of(today), slots_of(self.assignments)
        key = (tuple(before_raws.items()), tuple(after_raws.items()), timing)
        if key not in self._costs:
            codes = rates_of(self.session.profile).fast
            self._costs = {
                key: saving(self.session.profile, codes, timing, before_raws, after_raws)
            }
        return self._costs[key]


def useful_codes(proposals: Proposals, block: Block) -> list[str]:
    """Return the codes of the monitored values that no slot of the block maps."""
    profile, plan = proposals.session.profile, proposals.proposed(block)
    targets = (slot_target(profile, block, raw) for raw in (plan.raws if plan else ()))
    mapped = {target.code for target in targets if target is not None}
    return [code for code in watched_first(profile) if code not in mapped]


def watched_first(profile: Profile) -> list[str]:
    """Return the codes of the monitored values, those in Monitor's large figures first."""
    large = [p.code for quantity in LARGE if (p := readout_parameter(profile, quantity))]
    return list(dict.fromkeys((*large, *monitoring_codes(profile))))


def monitoring_stretches(session: DriveSession) -> list[Stretch]:
    """Return, for families without blocks, the adjacent words to read in one request."""
    codes = monitoring_codes(session.profile)
    return stretches(session.profile, codes, wire_timing(session))
