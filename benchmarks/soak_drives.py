"""The drives of the soak: five families whose words, but for a few, each hold a value of its own.

A value that is taken for another's, of the same drive or of another one, is recognized by that.
Words that make a drive what it is (its state, its place on the line, its timeout, the scales and
the slots of its block) stay as they are, and are not checked.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from tui.drive.chart import watched_codes
from tui.drive.orders import deciding_codes
from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile
from tui.drive.values import from_words, to_words, word_count
from tui.simulator import DriveSpec, FaultRates, LineTiming, Simulation

FAMILIES: Mapping[int, str] = {1: "atv21", 2: "atv31", 3: "atv312", 4: "atv71", 5: "powerdrive"}
"""Profiles by device."""
RANGE = range(1000, 32000)
"""Own values; all fit a signed word, and none is a word that stands for "no value"."""

Values = dict[int, dict[str, int]]
"""Raw values by device and code."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """Drives on a line that is not served yet, and which of their words have own values."""

    simulation: Simulation
    values: Values

    def words(self) -> Iterator[tuple[int, int, int]]:
        """Device, address and word of every register, for another server; no slot is filled."""
        for drive in self.simulation.drives:
            slots = _slots(drive.profile)
            for parameter in drive.profile.parameters:
                raw = 0 if parameter.code in slots else drive.raw(parameter.code)
                for offset, word in enumerate(to_words(parameter, raw)):
                    yield drive.address, parameter.address + offset, word


def prepare(
    seed: int, timing: LineTiming | None = None, faults: FaultRates | None = None
) -> Prepared:
    """The drives with own values, those of one seed always the same."""
    wanted = _wanted(seed)
    specs = [DriveSpec(family, device, sets=wanted[device]) for device, family in FAMILIES.items()]
    simulation = Simulation(specs, timing=timing, faults=faults, seed=seed)
    for drive in simulation.drives:
        drive.step(1.0)  # by then, values that the drive overwrites are known
    kept = {
        device: {c: raw for c, raw in own.items() if simulation.drive(device).raw(c) == raw}
        for device, own in wanted.items()
    }
    return Prepared(simulation, kept)


def _wanted(seed: int) -> Values:
    """A value of its own for every word that may have one."""
    chance = random.Random(seed)
    free = iter(chance.sample(RANGE, len(RANGE)))
    wanted: Values = {}
    for device, family in FAMILIES.items():
        profile = load(family)
        fixed = fixed_codes(profile)
        wanted[device] = {
            parameter.code: from_words(
                parameter, [next(free) for _ in range(word_count(parameter))]
            )
            for parameter in profile.parameters
            if parameter.code not in fixed and parameter.access != "w"
        }
    return wanted


def fixed_codes(profile: Profile) -> set[str]:
    """Codes of words that make a drive what it is."""
    data = profile.data
    fixed = {*watched_codes(profile), *deciding_codes(profile), *_slots(profile)}
    fixed |= {data.faults.parameter, data.identification.model_parameter}
    fixed |= {data.identification.class_parameter}
    fixed |= {setting.parameter for setting in data.link.settings}
    fixed |= {server.parameter for server in data.addresses.servers}
    fixed |= {code for block in data.blocks for code in block.values}
    if data.communication_fault:
        fixed |= {data.communication_fault.timeout, data.communication_fault.reaction}
    for parameter in profile.parameters:
        fixed |= {parameter.scale_by.parameter} if parameter.scale_by else set()
        fixed |= {parameter.unit_by.parameter} if parameter.unit_by else set()
    return fixed


def _slots(profile: Profile) -> set[str]:
    return {code for block in profile.data.blocks for code in block.slots}
