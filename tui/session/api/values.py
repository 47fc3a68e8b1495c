"""Results for a script: values, samples, and errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from decimal import Decimal

from tui.drive.errors import DriveError

from ..clock import Clock
from ..reading import Reading
from ..shown import Quality


class NotWritten(DriveError):
    """Some settings were not written; `why` has a sentence for each, by code."""

    def __init__(self, why: Mapping[str, str]) -> None:
        super().__init__(" ".join(why.values()))
        self.why = dict(why)


@dataclass(frozen=True, slots=True)
class DriveValue:
    """A parameter's value as it was read."""

    code: str
    number: Decimal | None
    """In `unit`; None for a name, a word of bits, or no value."""
    text: str
    """As a person reads it, without the unit."""
    unit: str
    raw: int | None
    good: bool
    """True if it was read now; in a sample, in that very cycle."""
    time: datetime
    """When its reply came, UTC."""
    error: str = ""
    """Why there is no value."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One cycle of a drive that is watched."""

    time: datetime
    values: Mapping[str, DriveValue]
    """By code, as they were asked for."""
    state: str
    """The drive's state in words; empty where its status word is not watched."""
    error: str
    """Why this cycle brought nothing; empty where it did."""


def value_from(reading: Reading, clock: Clock) -> DriveValue:
    """A reading as a script has it."""
    return DriveValue(
        reading.parameter.code,
        reading.value.number if reading.value is not None else None,
        reading.text,
        reading.unit,
        reading.raw,
        reading.quality is Quality.GOOD,
        datetime.fromtimestamp(clock.wall_of(reading.time), UTC),
        reading.error,
    )
