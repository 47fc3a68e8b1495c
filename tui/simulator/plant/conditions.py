"""Surroundings of a simulated drive that a bench changes, and faults planted in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

PLANTS: Mapping[str, str] = {
    "slow-ramps": "The motor's ramps take ten times as long as the drive's ramp times say.",
    "swapped-direction": "The drive runs in reverse if it is commanded forward, and forward if in "
    "reverse.",
    "no-timeout": "The communication timeout never expires, whatever its setting says.",
    "no-limits": "Values outside their range are accepted, and HSP or UL limit no reference.",
}
"""Defects that an acceptance test must notice, by name, with their effects."""
RAMP_FACTOR = 10.0
"""Factor of the ramp times of `slow-ramps`."""


@dataclass
class Conditions:
    """Supply, load and wire of one drive; the first values change nothing."""

    powered: bool = True
    """True if the drive's supply is on."""
    load: float | None = None
    """Constant load at rated speed, 1.0 at rated torque; None: the slowly changing one."""
    inertia: float = 1.0
    """Factor of the load's inertia."""
    jammed: bool = False
    """True if the shaft cannot turn."""
    volts: float | None = None
    """Constant supply voltage in V; None: the rated one, varying slightly."""
    wire_cut: bool = False
    """True if the drive's wire to the line is cut."""
    planted: set[str] = field(default_factory=set)
    """Names of planted defects, of `PLANTS`."""

    def slows(self) -> float:
        """Return the factor by which the ramps of the motor are slower than set."""
        return RAMP_FACTOR if "slow-ramps" in self.planted else 1.0

    def reset(self) -> None:
        """Return to the first values, except for the supply: nothing is planted."""
        first = Conditions()
        self.load, self.inertia, self.jammed = first.load, first.inertia, first.jammed
        self.volts, self.wire_cut = first.volts, first.wire_cut
        self.planted.clear()
