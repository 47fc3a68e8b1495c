"""Read rates of the values of a profile's monitoring set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tui.drive.chart import fault_code, watched_codes
from tui.drive.profile.profile import Profile

from ..reading import Reading
from .trend import TREND_QUANTITIES, readout_parameter

SLOW_FACTOR = 10
"""Number of cycles in which each slow value is read once."""


@dataclass(frozen=True, slots=True)
class Rates:
    """Codes grouped by read rate: `fast` ones are read in every cycle."""

    fast: tuple[str, ...]
    changing: tuple[str, ...] = ()
    """Details of the state. Read when it changes, in every cycle of a fault or an alarm, and at
    the slow rate."""
    slow: tuple[str, ...] = ()
    key: tuple[str, ...] = ()
    """The fast codes that show the state."""

    @property
    def seldom(self) -> tuple[str, ...]:
        """Values that are not read in every cycle."""
        return (*self.changing, *self.slow)

    def with_fast(self, codes: Sequence[str]) -> Rates:
        """Return rates with these codes in each cycle, too."""
        more = tuple(code for code in dict.fromkeys(codes) if code not in self.fast)
        return replace(
            self,
            fast=self.fast + more,
            changing=tuple(code for code in self.changing if code not in more),
            slow=tuple(code for code in self.slow if code not in more),
        )


def bad_readings(profile: Profile, rates: Rates, now: float, why: str) -> dict[str, Reading]:
    """Return a bad reading with this reason for every code, so that no value is shown."""
    return {code: Reading.bad(profile[code], now, why) for code in (*rates.fast, *rates.seldom)}


def rates_of(profile: Profile) -> Rates:
    """Return the read rate of each value of a profile's monitoring set."""
    rates = {value.parameter: value.rate for value in profile.data.monitoring.values}
    when = {chart.when.parameter for chart in profile.data.charts if chart.when}
    changing = {profile.data.faults.parameter, *when} - {""}
    codes = monitoring_codes(profile)
    reported = {
        code: rates.get(code, "on-change" if code in changing else "fast") for code in codes
    }
    if code := fault_code(profile):
        reported[code] = (
            "fast"  # the state must not appear with a fault that was reset in the meantime
        )
    fast, change, slow = (
        tuple(code for code in codes if reported[code] == rate)
        for rate in ("fast", "on-change", "slow")
    )
    watched = set(watched_codes(profile))
    return Rates(fast, change, slow, tuple(code for code in fast if code in watched))


def monitoring_codes(profile: Profile) -> list[str]:
    """Return the codes of a profile's monitoring set, and of the words for state and fault."""
    codes = [value.parameter for value in profile.data.monitoring.values]
    codes += watched_codes(profile)
    if profile.data.faults.parameter:
        codes.append(profile.data.faults.parameter)
    return list(dict.fromkeys(codes))


def codes_of_state(profile: Profile) -> tuple[str, ...]:
    """Return the codes of the drive's state, its fault, and the values of its trend."""
    found = (readout_parameter(profile, quantity) for quantity in TREND_QUANTITIES)
    codes = [*watched_codes(profile), profile.data.faults.parameter]
    codes += [parameter.code for parameter in found if parameter is not None]
    return tuple(dict.fromkeys(code for code in codes if code))
