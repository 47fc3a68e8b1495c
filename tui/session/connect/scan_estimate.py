"""Duration of a search at other settings of a line, and the message before slow settings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from tui.bus.link import SerialLink
from tui.drive.finding import LineSetting, families_at
from tui.drive.sentences import all_of

from .address_prober import known_profiles, probers_of


@dataclass(frozen=True, slots=True)
class ScanEstimate:
    """Time of an empty address at each setting of a line, in seconds."""

    each: Mapping[LineSetting, float]
    """Seconds of one address by setting."""
    addresses: int

    def seconds(self, settings: Iterable[LineSetting]) -> float:
        """Return the seconds of a search at these settings."""
        return sum(self.each.get(setting, 0.0) for setting in settings) * self.addresses

    def before_slow(self, settings: Sequence[LineSetting], ends: str) -> str:
        """Return the message before the slow settings are tried; `ends` is the key that ends
        them."""
        bauds = [f"{baud}" for baud in dict.fromkeys(setting.baud for setting in settings)]
        can = families_at(known_profiles(), settings)
        return (
            f"Not searched yet: {all_of(sorted(bauds, key=int))} baud,"
            f" {self.seconds(settings):.0f} s more, for {all_of(can)} only. Press {ends} to stop."
        )


def scan_estimate(
    link: SerialLink,
    wait: float,
    settings: Iterable[LineSetting],
    addresses: int,
    *,
    patient: bool = False,
) -> ScanEstimate:
    """Return the times at settings of a line; reads files. `wait` is the network wait in
    seconds."""
    each = {}
    for setting in settings:
        there = replace(link, baud=setting.baud, format=setting.format)
        each[setting] = probers_of(there, wait, patient=patient).cost
    return ScanEstimate(each, addresses)
