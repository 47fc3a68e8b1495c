"""A value that was read, for screens: they get its text only with its quality and age.

`Reading` has the text as well. Screens and widgets do not import it; a contract checks that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from typing import Protocol, TypeVar

from tui.drive.profile.schema import Parameter
from tui.drive.values import Value

Drawn = TypeVar("Drawn")
"""Result of drawing a value: a text with its style, a bar, a cell of a row."""


@dataclass(frozen=True, slots=True)
class Rating:
    """Value of 100 %: a number and its unit."""

    number: Decimal
    unit: str


class Quality(StrEnum):
    """Current, outdated, or without a value."""

    GOOD = "good"
    STALE = "stale"
    BAD = "bad"


class Shown(Protocol):
    """A value that was read. Times are monotonic, in seconds.

    It has no text of its own: a screen must say how it draws the value if it is current, if it is
    old, and if there is none.
    """

    @property
    def parameter(self) -> Parameter:
        """The parameter that was read."""

    @property
    def raw(self) -> int | None:
        """The words as read, for codes and bits; None if there are none."""

    @property
    def quality(self) -> Quality:
        """Quality of the value."""

    @property
    def time(self) -> float:
        """Time at which the reply was complete."""

    @property
    def error(self) -> str:
        """Reason why there is no value."""

    @property
    def absent(self) -> bool:
        """True if the drive reported that it has no such word."""

    @property
    def current_number(self) -> float | None:
        """The engineering value if it is current, for bars and comparisons."""

    def age(self, now: float) -> float:
        """Seconds since the value was on the wire."""

    def aged(self, now: float, longest: float) -> Shown:
        """The same value, stale if it is good and older than `longest` seconds."""

    def drawn(
        self,
        now: float,
        *,
        current: Callable[[Value], Drawn],
        old: Callable[[Value, float], Drawn],
        missing: Drawn,
    ) -> Drawn:
        """Draw the value as it is at `now`: `current`, or `old` with its age, or `missing`."""
