"""Raw values with the scales and ratings that were known when they were decoded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tui.drive.profile.schema import Parameter
from tui.drive.shown import depends_on, shown
from tui.drive.values import Value, percent_of

from ..drive import DriveSession
from ..reading import Reading
from ..shown import Rating


@dataclass(slots=True)
class Decoding:
    """Decodes raw values with the scales and ratings known at its creation."""

    session: DriveSession
    raws: Mapping[str, int] | None = None
    """Raw values that scales and units depend on (default: those that may be trusted)."""
    _raws: Mapping[str, int] = field(init=False)
    _lacking: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        self._raws = self.session.image.trusted if self.raws is None else self.raws
        self._lacking = self.session.image.lacking

    def decode(self, reading: Reading) -> Reading:
        """Return the reading with its value and unit; unchanged if it has no raw value."""
        if reading.raw is None:
            return reading
        value = self._value(reading.parameter, reading.raw)
        return reading.decoded(value, self._physical(reading.parameter, value))

    def _value(self, parameter: Parameter, raw: int) -> Value:
        return shown(self.session.profile, parameter, raw, self._raws, self._lacking)

    def _physical(self, parameter: Parameter, value: Value) -> Value | None:
        """Convert a percentage to the unit of its rating.

        A rating that a person entered takes precedence over the drive's own.
        """
        if parameter.unit != "%" or value.number is None:
            return None
        rating = self.session.ratings.get(parameter.code)
        own_raw = self._raws.get(parameter.rating)
        if rating is None and own_raw is not None:
            own = self._value(self.session.profile[parameter.rating], own_raw)
            rating = Rating(own.number, own.unit) if own.number is not None else None
        if rating is None:
            return None
        number = percent_of(value.number, rating.number)
        return Value(value.raw, number, rating.unit, f"{number:f}")


def sources_of(parameter: Parameter) -> list[str]:
    """Return the codes of the parameters that set this one's scale, unit or rating."""
    return [*depends_on(parameter), *([parameter.rating] if parameter.rating else [])]
