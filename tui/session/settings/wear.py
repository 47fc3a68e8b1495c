"""Writes to a drive's EEPROM that are so frequent that they would wear it out.

A warning comes first. From `ASK_FROM` writes an hour on, or near the end of the EEPROM's life, a
person must agree, at the keyboard or by naming the parameter.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Collection
from dataclasses import dataclass, field
from datetime import datetime

from tui.drive.profile.profile import UNVERIFIED
from tui.drive.profile.schema import Eeprom, Parameter
from tui.drive.sentences import counted
from tui.drive.settings.memory_orders import eeprom_use

from ..drive import DriveSession
from ..eeprom_counts import COUNTED_DAY, DriveCounts, EepromCounts, EepromTally

HOUR = 3600.0
WARN_FROM = 5
"""Writes in the last hour from which on the next one is warned about."""
ASK_FROM = 10
"""Writes in the last hour from which on the next one needs a person's consent."""
WARN_FROM_IN_A_DAY = 20
NEARLY_WORN = 0.9
"""Part of the stated life from which on each write needs a person's consent."""


@dataclass(frozen=True, slots=True)
class Wear:
    """Frequency of the writes to EEPROM: of one parameter, or of saves."""

    count: int
    first: float
    """Time of the first write, in seconds since 1970; 0 without one."""
    hour: int
    """Writes in the last hour."""
    day: int
    life: int | None
    """Number of writes that the EEPROM lasts for; None if no document states it."""
    is_sure: bool
    """False if only a document of a sister family states the life."""

    @classmethod
    def of(cls, count: EepromTally, facts: Eeprom, now: float) -> Wear:
        """Return the wear by a count, at a time in seconds since 1970."""
        sure = facts.confidence not in UNVERIFIED
        recent = (len(count.within(HOUR, now)), len(count.within(COUNTED_DAY, now)))
        return cls(count.count, count.first, *recent, facts.writes, sure)

    @property
    def must_ask(self) -> bool:
        """True if the next write needs a person's consent."""
        worn = self.life is not None and self.count >= self.life * NEARLY_WORN
        return worn or self.hour >= ASK_FROM

    @property
    def is_frequent(self) -> bool:
        """True if the next write deserves a warning."""
        return self.must_ask or self.hour >= WARN_FROM or self.day >= WARN_FROM_IN_A_DAY

    @property
    def text(self) -> str:
        """The count with its time, the stated life, and when a frequent script uses it up."""
        return " ".join(
            filter(None, (self._count_text, self._pace_text, self._life_text, self._end))
        )

    @property
    def _count_text(self) -> str:
        if not self.count:
            return "No write from this computer is recorded."
        since = datetime.fromtimestamp(self.first).date().isoformat()
        texts = (
            "1 write from this computer since {since}.",
            "{count} writes from this computer since {since}.",
        )
        return counted(self.count, *texts, since=since)

    @property
    def _pace_text(self) -> str:
        if self.hour >= WARN_FROM:
            return f"In the last hour: {self.hour}."
        return f"In the last day: at least {self.day}." if self.day >= WARN_FROM_IN_A_DAY else ""

    @property
    def _life_text(self) -> str:
        if self.life is None:
            return "No available document states how many writes the EEPROM lasts for."
        return (_LIFE if self.is_sure else _LIFE_OF_SISTER).format(count=f"{self.life:,}")

    @property
    def _end(self) -> str:
        if self.life is None or not self.is_frequent:
            return ""
        if self.count >= self.life * NEARLY_WORN:
            return "That life is nearly used up."
        days = max(1, (self.life - self.count) // max(self.hour * 24, self.day))
        return f"At this pace it is worn out in {days} days."


_LIFE = "The EEPROM lasts for about {count} writes."
_LIFE_OF_SISTER = "The EEPROM lasts for about {count} writes, by a manual of a sister family."


async def read_counts(session: DriveSession, counts: EepromCounts) -> DriveCounts:
    """Read the counts of a drive in a thread. Raises OSError, and ValueError for a bad file."""
    place = (session.line_text, session.device, session.profile.id, session.known_identity.text)
    return await asyncio.to_thread(counts.counts_of, *place)


def wear_of(session: DriveSession, counts: DriveCounts, code: str) -> Wear:
    """Return the wear by writes of a parameter, or by saves for an empty code."""
    return Wear.of(counts.of(code), session.profile.data.memory.eeprom, session.clock.wall())


def wear_summary(session: DriveSession, counts: DriveCounts) -> str:
    """Return the wear of a drive for a person: the saves, or the parameter written most often."""
    memory, written = session.profile.data.memory, counts.writes
    if memory.save is not None or counts.saves.count:
        return f"All settings: {wear_of(session, counts, '').text}"
    code = max(written, key=lambda each: written[each].count, default="")
    wear = wear_of(session, counts, code)
    return f"Most often {code}: {wear.text}" if code else wear.text


async def agreed(question: str) -> bool:
    """Agree, because a person has seen the counts with the question that led here."""
    return bool(question)


def _unheard(text: str) -> None:
    """Drop a warning: the caller has no place for it."""


@dataclass(slots=True)
class WearGate:
    """Decides for one task which writes may go to the EEPROM; reads the counts once."""

    counts: EepromCounts
    confirmed: Collection[str] = ()
    """Codes that a person has named; those of a save too."""
    ask: Callable[[str], Awaitable[bool]] | None = None
    """Ask a person; None if there is no person to ask."""
    warn: Callable[[str], None] = _unheard
    way: str = ""
    """Way to write anyway, with `{code}`, as a sentence."""
    _known: DriveCounts | None = None
    _passed: set[str] = field(default_factory=set)

    async def refusal(self, session: DriveSession, parameter: Parameter, raw: int) -> str:
        """Return why a write must not be sent, with the way out; empty if it may be.

        Counts that cannot be read are a warning, never a refusal.
        """
        use, code = eeprom_use(session.profile, parameter, raw), parameter.code
        if not use or code in self._passed:
            return ""
        try:
            if self._known is None:
                self._known = await read_counts(session, self.counts)
        except (OSError, ValueError) as error:
            self.warn(f"The EEPROM writes of this drive are not known: {error}")
            return ""
        wear = wear_of(session, self._known, code if use == "write" else "")
        what = code if use == "write" else "All settings"
        if wear.is_frequent and not wear.must_ask:
            self.warn(f"EEPROM, {what}: {wear.text}")
        if wear.must_ask and code not in self.confirmed:
            text = f"{what} would go to EEPROM again. {wear.text}"
            if self.ask is None or not await self.ask(f"{text} Write anyway?"):
                return f"Not written: {text} {self.way.format(code=code)}".rstrip()
        self._passed.add(code)
        return ""
