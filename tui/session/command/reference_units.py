"""One reference in several units: by the pole pairs of the motor, and by what 100 % is."""

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
"""The plate that gives the pole pairs of the motor."""
NEARLY_ONE_MORE = Decimal("0.05")
"""By how much a plate may round a speed up: 1501 rpm at 50 Hz means two pole pairs."""


@dataclass(frozen=True, slots=True)
class ReferenceUnits:
    """Conversions by what was read of one drive."""

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
        """Codes of words that the drive lacks."""
        return {code for code, reading in self.readings.items() if reading.absent}

    def unit(self, parameter: Parameter) -> str:
        """The unit of a word; `raw` if it follows another word that was not read."""
        return self.profile.unit(parameter, self.raws)

    def quantity(self, quantity: Quantity) -> tuple[Decimal, str] | None:
        """Number and unit of a quantity; None if it was not read, or its scale is not known."""
        return self._number(self.profile.quantity(quantity))

    def whole(self, parameter: Parameter) -> Parameter | None:
        """The parameter that holds 100 % of this one in a physical unit."""
        return self.profile.get(parameter.rating) if parameter.rating else None

    def converted(
        self, number: Decimal, unit: str, other: str, whole: Parameter | None = None
    ) -> Decimal | None:
        """A number in another unit; None if nothing known leads from one to the other.

        `whole` is the parameter that holds 100 %.
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
        """Hz to rpm and back, at synchronous speed."""
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
