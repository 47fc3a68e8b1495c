"""A simulated drive."""

from __future__ import annotations


class SimulatedDrive:
    """A drive of one profile: its registers, its state chart, its motor and its faults."""

    def provoke(self, fault: str | int, *, persists: bool = False) -> None:
        """Trip the drive with a fault given by code or raw value."""
        raise NotImplementedError

    def run(self, hz: float, *, wander: bool = False) -> None:
        """Run the motor as if an order came from the terminals."""
        raise NotImplementedError

    def power_cycle(self) -> None:
        """Switch the drive's supply off and on."""
        raise NotImplementedError
