"""Triggers of a recording, and the seconds before and after each that are kept."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from datetime import time as time_of_day
from typing import NamedTuple, Protocol

from tui.drive.errors import DriveError

from ..record.schema import ReplyRow

_LEVEL = re.compile(
    r"(?P<code>[^<>,\s]+)\s*(?P<side>[<>])\s*(?P<level>[-+]?[\d.]+)(\s*,\s*(?P<rearm>[-+]?[\d.]+))?"
)
_TIME = re.compile(r"([01]?\d|2[0-3]):[0-5]\d(:[0-5]\d)?")


class TriggerError(DriveError):
    """A text is not a trigger."""


class CycleSeen(NamedTuple):
    """One cycle of a drive, as triggers see it."""

    wall: float
    """Seconds since 1970."""
    numbers: dict[str, float]
    """The engineering values that were read in this cycle, by code."""
    fault: str
    """The present fault; empty if there is none."""
    command: int | None
    """The command word; None if it was not read."""


class Trigger(Protocol):
    """Condition that starts a recording."""

    def fired(self, look: CycleSeen) -> str:
        """Return what happened, for a person; empty if nothing did."""


@dataclass(slots=True)
class FaultTrigger:
    """The drive has tripped since the cycle before."""

    before: str | None = None

    def fired(self, look: CycleSeen) -> str:
        before, self.before = self.before, look.fault
        return f"Fault: {look.fault}" if look.fault and before == "" else ""


@dataclass(slots=True)
class CommandTrigger:
    """The command word has changed, by any program."""

    before: int | None = None

    def fired(self, look: CycleSeen) -> str:
        before = self.before
        if look.command is None:
            return ""
        self.before = look.command
        if before in (None, look.command):
            return ""
        return f"Command word 16#{look.command:04X} after 16#{before:04X}"


@dataclass(slots=True)
class LevelTrigger:
    """A value has passed a level; again only after it was at or beyond `rearm`."""

    code: str
    above: bool
    level: float
    rearm: float
    armed: bool = True

    def fired(self, look: CycleSeen) -> str:
        value = look.numbers.get(self.code)
        if value is None:
            return ""
        if not self.armed:
            self.armed = value <= self.rearm if self.above else value >= self.rearm
            return ""
        if not (value > self.level if self.above else value < self.level):
            return ""
        self.armed = False
        return f"{self.code} {value:g} {'>' if self.above else '<'} {self.level:g}"


@dataclass(slots=True)
class TimeTrigger:
    """A time of day, local, has passed since the cycle before."""

    at: time_of_day
    before: datetime | None = None

    def fired(self, look: CycleSeen) -> str:
        now = datetime.fromtimestamp(look.wall)
        before, self.before = self.before, now
        if before is None or not before < datetime.combine(now.date(), self.at) <= now:
            return ""
        return f"Time {self.at.isoformat()}"


def parse_trigger(text: str) -> Trigger:
    """Return the trigger of a text: `fault`, `command`, `14:30`, `LCR>10` or `LCR>10,9`.

    Raises TriggerError.
    """
    folded = text.strip().casefold()
    if folded == "fault":
        return FaultTrigger()
    if folded == "command":
        return CommandTrigger()
    if _TIME.fullmatch(folded):
        return TimeTrigger(
            time_of_day.fromisoformat(folded.zfill(len(folded) + (folded[1] == ":")))
        )
    if (found := _LEVEL.fullmatch(text.strip())) is not None:
        try:
            level = float(found["level"])
            rearm = level if found["rearm"] is None else float(found["rearm"])
        except ValueError:
            raise _invalid(text) from None
        above = found["side"] == ">"
        if rearm > level if above else rearm < level:
            raise TriggerError(f"{text!r}: the second number is on the wrong side of the first.")
        return LevelTrigger(found["code"], above, level, rearm)
    raise _invalid(text)


def _invalid(text: str) -> TriggerError:
    return TriggerError(
        f"{text!r} is not a trigger. Use fault, command, 14:30, CODE>LEVEL or CODE>LEVEL,REARM."
    )


@dataclass(slots=True)
class TriggeredRows:
    """Keeps rows of the seconds before a trigger, and passes on those around each."""

    before: float
    after: float
    always: bool
    """True if there are no triggers: every row is passed on."""
    _until: float = float("-inf")
    _kept: deque[tuple[float, Sequence[ReplyRow]]] = field(default_factory=deque)

    def take(self, mono: float, rows: Sequence[ReplyRow], *, fired: bool) -> list[ReplyRow]:
        """Return the rows to record after a cycle that ended at `mono` (monotonic)."""
        if fired:
            self._until = mono + self.after
        while self._kept and self._kept[0][0] < mono - self.before:
            self._kept.popleft()
        if not (self.always or mono <= self._until):
            self._kept.append((mono, rows))
            return []
        passed = [row for _, kept in self._kept for row in kept]
        self._kept.clear()
        return [*passed, *rows]
