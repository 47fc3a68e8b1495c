"""Reading of a parameter: its value, the time it was on the wire, and its quality."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import cast

from tui.drive.profile.schema import Parameter
from tui.drive.values import NOT_AVAILABLE, Value

from .shown import Drawn, Quality, Shown


class Origin(StrEnum):
    """Why a register was read."""

    POLL = "poll"
    READ = "read"
    READ_BACK = "read back"


@dataclass(frozen=True, slots=True)
class Reading:
    """One parameter as last read; `time` is when its reply was complete (monotonic).

    `raw` is None if there is no value; `error` is the reason. `value` depends on other words that
    may change at any time, so it is decoded for each caller and not stored.
    """

    parameter: Parameter
    raw: int | None
    value: Value | None
    quality: Quality
    time: float
    error: str = ""
    physical: Value | None = None
    """A percentage in the unit of its rating; None if that is not known."""
    origin: Origin = Origin.READ
    absent: bool = False
    """True if the drive reported that it has no such word."""
    silent: bool = False
    """True if the drive did not answer this request although it answers others."""

    @property
    def text(self) -> str:
        """Text for a person, without the unit; dashes if there is no value."""
        return self.value.text if self.value is not None else NOT_AVAILABLE

    @property
    def unit(self) -> str:
        """Unit of the value; unit of the parameter if there is no value."""
        return self.value.unit if self.value is not None else self.parameter.unit

    @property
    def number(self) -> float | None:
        """The engineering value for bars and trends; None for names, words and bad values."""
        if self.value is None or self.value.number is None:
            return None
        return float(self.value.number)

    @property
    def current_number(self) -> float | None:
        """The engineering value if it is current."""
        return self.number if self.quality is Quality.GOOD else None

    def drawn(
        self,
        now: float,
        *,
        current: Callable[[Value], Drawn],
        old: Callable[[Value, float], Drawn],
        missing: Drawn,
    ) -> Drawn:
        """Draw the value, in the unit of its rating if that is known; see `Shown.drawn`."""
        value = self.physical or self.value
        if value is None:
            return missing
        return current(value) if self.quality is Quality.GOOD else old(value, self.age(now))

    def age(self, now: float) -> float:
        """Seconds since the value was on the wire."""
        return max(0.0, now - self.time)

    def aged(self, now: float, longest: float) -> Reading:
        """The same reading, stale if it is good and older than `longest` seconds."""
        if self.quality is Quality.GOOD and self.age(now) > longest:
            return replace(self, quality=Quality.STALE)
        return self

    def decoded(self, value: Value, physical: Value | None) -> Reading:
        """Return the reading with a decoded value."""
        return Reading(
            self.parameter,
            self.raw,
            value,
            self.quality,
            self.time,
            physical=physical,
            origin=self.origin,
        )

    @classmethod
    def undecoded(cls, parameter: Parameter, raw: int, time: float, origin: Origin) -> Reading:
        """Create a reading with a raw value that is not decoded yet."""
        return cls(parameter, raw, None, Quality.GOOD, time, origin=origin)

    @classmethod
    def bad(
        cls,
        parameter: Parameter,
        time: float,
        error: str,
        *,
        absent: bool = False,
        silent: bool = False,
    ) -> Reading:
        """Create a reading without a value; `error` is the reason."""
        return cls(parameter, None, None, Quality.BAD, time, error, absent=absent, silent=silent)


def reading_of(shown: Shown) -> Reading:
    """Return a shown value as its Reading, which has a text."""
    return cast("Reading", shown)  # there is no other implementation


def with_text(readings: Mapping[str, Shown]) -> Mapping[str, Reading]:
    """Return shown values as Readings, for output that has columns for quality and time."""
    return {code: reading_of(shown) for code, shown in readings.items()}
