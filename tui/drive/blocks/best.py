"""The assignment of a block that saves most on the wire for a set of parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from ..profile.profile import Profile
from ..profile.schema import Block
from ..read_plan import WireTiming
from .assignment import Assignment, empty
from .picking import raw_of
from .slot_rules import reason_against
from .wire_cost import cost


def best_assignment(
    profile: Profile,
    block: Block,
    codes: Sequence[str],
    timing: WireTiming,
    others: Mapping[str, int],
    unreadable: Collection[str] = (),
) -> Assignment:
    """Slots for these parameters such that reading all of them takes least.

    One slot after another takes what helps most then, though the first ones may cost more than
    they save; the best of all lengths counts. `others` are the slots of other blocks.
    """
    left = [code for code in codes if code not in unreadable]
    left = [code for code in left if not reason_against(profile, block, profile[code])]

    def takes(plan: Assignment) -> int:
        slots = {**others, **plan.slots}
        return cost(profile, codes, timing, slots, unreadable).microseconds

    plan = best = empty(block)
    least = takes(plan)
    for place in range(len(block.slots)):
        if not left:
            break
        tried = {c: plan.with_raw(place, raw_of(profile, block, profile[c])) for c in left}
        code = min(tried, key=lambda c: takes(tried[c]))
        left.remove(code)
        plan = tried[code]
        if (now := takes(plan)) < least:
            least, best = now, plan
    return best
