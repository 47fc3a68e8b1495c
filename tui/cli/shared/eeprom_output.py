"""Writes to a drive's EEPROM as `status` reports them."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.session.drive import DriveSession
    from tui.session.eeprom_counts import DriveCounts
    from tui.session.journal import Journal

    from ..documents.parts import EepromField

log = logging.getLogger(__name__)


async def eeprom_counts(session: DriveSession, journal: Journal) -> DriveCounts | None:
    """Read the counts of a drive; None if they cannot be read."""
    from tui.session.settings.wear import read_counts

    try:
        return await read_counts(session, journal.eeprom)
    except (OSError, ValueError) as error:
        log.warning("the EEPROM writes of device %s are not known: %s", session.device, error)
        return None


def eeprom_field(session: DriveSession, counts: DriveCounts | None) -> EepromField | None:
    """Return the writes to the EEPROM of a drive; null if they cannot be read."""
    from tui.session.journal import entry_time
    from tui.session.settings.wear import wear_of

    from ..documents.parts import EepromCountField, EepromField

    if counts is None:
        return None

    def field(code: str) -> EepromCountField:
        count, wear = counts.of(code), wear_of(session, counts, code)
        first, last = (entry_time(t) if t else None for t in (count.first, count.last))
        return EepromCountField(
            count=count.count,
            first=first,
            last=last,
            last_hour=wear.hour,
            frequent=wear.is_frequent,
        )

    return EepromField(
        life=session.profile.data.memory.eeprom.writes,
        saves=field(""),
        writes={code: field(code) for code in counts.writes},
    )


def eeprom_rows(session: DriveSession, counts: DriveCounts | None) -> list[tuple[str, str]]:
    """Return the row of the drive's EEPROM for a person; none if it was never written."""
    from tui.session.settings.wear import wear_summary

    return [("EEPROM", wear_summary(session, counts))] if counts and counts.last else []
