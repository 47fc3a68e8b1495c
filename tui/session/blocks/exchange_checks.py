"""Reasons against writing through the outputs of a block or scanner, before and after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tui.drive.blocks.assignment import Assignment, describe, slot_target
from tui.drive.blocks.slot_rules import assignment_problems, refusing
from tui.drive.blocks.wire_cost import reach
from tui.drive.command_blocked import held_back
from tui.drive.orders import chart_in_force, deciding_codes, interlock_codes
from tui.drive.profile.schema import Parameter
from tui.drive.settings.writable import AT_REST, is_order
from tui.drive.values import check_raw

from ..drive import DriveSession
from ..read.retrying_reader import RetryingReader
from .write import AssignmentRefused


@dataclass(slots=True)
class ExchangeChecks:
    """The checks of one exchange; each raises AssignmentRefused with what is wrong."""

    session: DriveSession
    retrying: RetryingReader
    outputs: Assignment
    inputs: Assignment | None
    wanted: Mapping[str, int]
    places: range = field(init=False)
    """The slots from the first to the last that a person names."""
    targets: list[Parameter] = field(init=False)
    """Parameters of the written places, in their order."""

    def __post_init__(self) -> None:
        profile, block = self.session.profile, self.outputs.block
        self.places = reach(profile, self.outputs, self.wanted)
        found = [slot_target(profile, block, self.outputs.raws[place]) for place in self.places]
        self.targets = [parameter for parameter in found if parameter is not None]

    def check_named(self) -> None:
        """Raise AssignmentRefused for a stranger, a hole, or a slot that must not be used."""
        profile, block = self.session.profile, self.outputs.block
        known = {p.code for p in self.targets}
        if foreign := [code for code in self.wanted if code not in known]:
            raise AssignmentRefused(f"No output slot is mapped to {', '.join(foreign)}.")
        if not self.wanted:
            raise AssignmentRefused("No output was named; nothing was written.")
        for place in self.places:
            if slot_target(profile, block, self.outputs.raws[place]) is None:
                stands = describe(profile, block, self.outputs.raws[place])
                raise AssignmentRefused(
                    f"{block.slots[place]} is {stands}: nothing is written through it."
                )
        if wrong := refusing(assignment_problems(profile, self.outputs)):
            raise AssignmentRefused(" ".join(problem.text for problem in wrong))

    async def check_state(self) -> None:
        """The interlocks of a run order where an output is an order; rest where one needs it."""
        profile = self.session.profile
        state = await self.retrying.ask_state()
        stopped = [p.code for p in self.targets if p.access == "rw-stopped"]
        if stopped and state not in AT_REST:
            raise AssignmentRefused(
                f"{', '.join(stopped)} are written with the motor stopped only; the drive is"
                f" {self.retrying.headline}."
            )
        if not any(is_order(profile, parameter) for parameter in self.targets):
            return
        codes = deciding_codes(profile)
        for chart in profile.data.charts:
            codes += interlock_codes(chart)
        await self.retrying.ask_raws(codes)
        raws = self.session.image.raws
        found = chart_in_force(profile, raws)
        if found is None or not found.orders:
            raise AssignmentRefused("Drive Panel does not command this drive.")
        if (held := held_back(profile, found, "forward", raws)) is not None:
            raise AssignmentRefused(f"{held.text} {held.remedy}".strip())

    def check_values(self, raws: Mapping[str, int]) -> None:
        """Raise ValueRefused for a value that its parameter cannot take."""
        profile = self.session.profile
        for parameter in self.targets:
            if parameter.code in self.wanted:
                scale = profile.scale(parameter, self.retrying.raws, self.retrying.lacking)
                raw = raws[parameter.code]
                check_raw(parameter, raw, profile.names(parameter), scale)

    async def check_slots(self, when: str) -> None:
        """Raise unless the slots stand for what the person saw; afterwards it may be too late."""
        for plan in (self.outputs, self.inputs):
            if plan is None:
                continue
            block = plan.block
            held = await self.retrying.ask_raws(block.slots)
            changed = [slot for slot, raw in plan.slots.items() if held.get(slot) != raw]
            if not changed:
                continue
            text = f"{', '.join(changed)} of {block.name.lower()} were changed by another program"
            if when == "before":
                raise AssignmentRefused(f"{text}: nothing was written. Look at them first.")
            if plan is self.inputs:
                raise AssignmentRefused(
                    f"{text}: the outputs were written, of what came back nothing is taken."
                )
            raise AssignmentRefused(
                f"{text} while words were written through them: look at {self._names(held)}."
            )

    def _names(self, held: Mapping[str, int]) -> str:
        profile, block = self.session.profile, self.outputs.block
        return ", ".join(describe(profile, block, raw) for raw in held.values() if raw)
