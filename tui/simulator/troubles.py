"""Faults that a simulated line can have: the effect and the unit of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import inf

from .errors import SimulatorError

SHARE, REPLIES, UNIT, SECONDS = "share", "replies", "unit", "s"


@dataclass(frozen=True, slots=True)
class Trouble:
    """Kind of fault: the unit of its value, and its effect."""

    unit: str
    effect: str


TROUBLES: Mapping[str, Trouble] = {
    "late": Trouble(SHARE, "The reply comes 0.3 to 1.5 s late."),
    "lost": Trouble(SHARE, "The reply does not come."),
    "duplicated": Trouble(SHARE, "The reply comes twice."),
    "truncated": Trouble(SHARE, "The reply breaks off."),
    "corrupted": Trouble(SHARE, "One bit of the reply is wrong."),
    "noise": Trouble(SHARE, "Up to three random bytes come before the reply."),
    "foreign": Trouble(SHARE, "The reply carries the address of another drive."),
    "twin": Trouble(SHARE, "A second drive at the address replies too: over the first, or after."),
    "swapped": Trouble(SHARE, "The two bytes of each word that is read are swapped."),
    "exception-0a": Trouble(SHARE, "A gateway replies that it has no path to the drive."),
    "exception-0b": Trouble(SHARE, "A gateway replies that the drive did not answer."),
    "behind": Trouble(REPLIES, "Each request gets the reply to an earlier one: 1 is the last."),
    "lost-every": Trouble(REPLIES, "One request of so many does not reach the drives."),
    "only-unit": Trouble(UNIT, "A Modbus TCP gateway answers this unit only, for its one drive."),
    "idle-close": Trouble(SECONDS, "A TCP connection without requests is closed after this time."),
    "master": Trouble(SECONDS, "Another master polls each drive, so often, on an RTU line."),
}
"""Faults by kind, as in `--line-fault` and its help."""
VALUE_LIMITS = {
    SHARE: (0.0, 1.0),
    REPLIES: (1.0, 100.0),
    UNIT: (0.0, 255.0),
    SECONDS: (0.02, 3600.0),
}
"""Least and greatest value, by unit."""


def _as_kind(name: str) -> str:
    return name.replace("_", "-")


@dataclass(frozen=True)
class FaultRates:
    """Probability of each line fault per reply, 0..1; at most one fault hits a reply.

    `late_by` is the range of the extra delay of a late reply, in s.
    """

    late: float = 0.0
    lost: float = 0.0
    duplicated: float = 0.0
    truncated: float = 0.0
    corrupted: float = 0.0
    noise: float = 0.0
    foreign: float = 0.0
    twin: float = 0.0
    swapped: float = 0.0
    exception_0a: float = 0.0
    exception_0b: float = 0.0
    late_by: tuple[float, float] = (0.3, 1.5)

    def __post_init__(self) -> None:
        """Raise for rates that are not probabilities or add up to more than 1."""
        rates = self.by_kind()
        wrong = [kind for kind, rate in rates.items() if not 0 <= rate <= 1]
        if wrong:
            raise SimulatorError(f"The rate of {wrong[0]} replies must be between 0 and 1.")
        if sum(rates.values()) > 1 + 1e-9:
            raise SimulatorError("The rates of line faults add up to more than 1.")

    def by_kind(self) -> dict[str, float]:
        """Return the rates by kind of fault, in a fixed order."""
        return {
            _as_kind(f.name): getattr(self, f.name) for f in fields(self) if f.name != "late_by"
        }


@dataclass(frozen=True, slots=True)
class Habits:
    """Permanent faults of a line; it has none at 0, None and infinity."""

    behind: int = 0
    lost_every: int = 0
    only_unit: int | None = None
    idle_close: float = inf
    master: float = 0.0


def troubles_of(values: Mapping[str, float]) -> tuple[FaultRates, Habits]:
    """Return the rates and habits by kind of fault. Raises SimulatorError."""
    for kind, value in values.items():
        if kind not in TROUBLES:
            raise SimulatorError(f"{kind!r} is not a line fault. Use {', '.join(TROUBLES)}.")
        unit = TROUBLES[kind].unit
        least, most = VALUE_LIMITS[unit]
        fits = least <= value <= most
        if not fits or (unit in (REPLIES, UNIT) and value != int(value)):
            takes = f"{kind} takes {least:g} to {most:g} ({unit})"
            raise SimulatorError(f"'{kind}={value:g}': write KIND=VALUE; {takes}.")
    rates = {k: v for k, v in values.items() if TROUBLES[k].unit == SHARE}
    habits = {k: v if TROUBLES[k].unit == SECONDS else int(v) for k, v in values.items()}
    return (
        FaultRates(**{kind.replace("-", "_"): rate for kind, rate in rates.items()}),  # type: ignore[arg-type]
        Habits(**{k.replace("-", "_"): v for k, v in habits.items() if k not in rates}),  # type: ignore[arg-type]
    )
