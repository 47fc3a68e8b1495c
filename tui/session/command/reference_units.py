"""Conversions of references between Hz, rpm and %, with the readings of one drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.units import factor_between

from ..reading import reading_of
from ..shown import Shown

MOTOR_DATA: tuple[Quantity, ...] = ("rated_frequency", "rated_speed")
"""Ratings from which the pole pairs of the motor follow."""
NEARLY_ONE_MORE = Decimal("0.05")
"""Tolerance for rounded rated speeds: 1501 rpm at 50 Hz means two pole pairs, not one."""


@dataclass(frozen=True, slots=True)
class ReferenceUnits:
    """Conversions between units, with the readings of one drive."""

    profile: Profile
    readings: Mapping[str, Shown]

    @property
    def raws(self) -> dict[str, int]:
        """Raw values by code."""
        return {
            code: reading.raw for code, reading in self.readings.items() if reading.raw is not None
        }

    @property
    def absent(self) -> set[str]:
        """Codes of words that the drive does not have."""
        return {code for code, reading in self.readings.items() if reading.absent}

    def unit(self, parameter: Parameter) -> str:
        """Return the unit of a word; `raw` if it depends on a word that was not read."""
        return self.profile.unit(parameter, self.raws)

    def quantity(self, quantity: Quantity) -> tuple[Decimal, str] | None:
        """Return the number and unit of a quantity; None if not read, or without a scale."""
        return self._number(self.profile.quantity(quantity))

    def whole(self, parameter: Parameter) -> Parameter | None:
        """Return the parameter whose value is 100 % of this one, in a physical unit."""
        full = parameter.full_scale
        code = parameter.rating or (full.parameter if full is not None else "")
        return self.profile.get(code) if code else None

    def converted(
        self, number: Decimal, unit: str, other: str, whole: Parameter | None = None
    ) -> Decimal | None:
        """Convert a number to another unit; None if no conversion is known.

        `whole` is the parameter whose value is 100 %.
        """
        if (factor := factor_between(unit, other)) is not None:
            return number * factor
        hundred = self._number(whole)
        if hundred is not None and hundred[0] and factor_between(unit, "%"):
            return self.converted(number * hundred[0] / 100, hundred[1], other)
        if hundred is not None and hundred[0] and factor_between(other, "%"):
            part = self.converted(number, unit, hundred[1])
            return None if part is None else part * 100 / hundred[0]
        return self._between_speeds(number, unit, other)

    def _between_speeds(self, number: Decimal, unit: str, other: str) -> Decimal | None:
        """Convert between Hz and rpm at synchronous speed."""
        pairs = self._pole_pairs()
        if pairs is None:
            return None
        for text, two, times, by in (("Hz", "rpm", 60, pairs), ("rpm", "Hz", pairs, 60)):
            before, after = factor_between(unit, text), factor_between(two, other)
            if before is not None and after is not None:
                return number * before * times / by * after
        return None

    def _pole_pairs(self) -> Decimal | None:
        frequency, speed = (self.quantity(literal_type) for literal_type in MOTOR_DATA)
        if not frequency or not speed or frequency[0] <= 0 or speed[0] <= 0:
            return None
        hertz, rpm = factor_between(frequency[1], "Hz"), factor_between(speed[1], "rpm")
        if hertz is None or rpm is None:
            return None
        pairs = 60 * frequency[0] * hertz / (speed[0] * rpm)
        return max(Decimal(1), Decimal(int(pairs + NEARLY_ONE_MORE)))

    def _number(self, parameter: Parameter | None) -> tuple[Decimal, str] | None:
        reading = self.readings.get(parameter.code) if parameter is not None else None
        value = reading_of(reading).value if reading is not None else None
        if value is None or value.number is None or value.unit == "raw":
            return None
        return value.number, value.unit
