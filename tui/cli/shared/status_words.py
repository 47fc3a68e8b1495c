"""Command and status words of a drive, and writes to its EEPROM, as `status` shows them."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import TYPE_CHECKING

from tui.drive.bit_texts import bit_texts
from tui.drive.communication_words import communication_words
from tui.drive.values import NOT_AVAILABLE, set_bits, without_named_bits

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.drive import DriveSession
    from tui.session.eeprom_counts import DriveCounts
    from tui.session.journal import Journal
    from tui.session.reading import Reading

    from ..documents.parts import EepromField, StatusWordField


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


def word_rows(profile: Profile, readings: Mapping[str, Reading]) -> list[tuple[str, str]]:
    """Return a row for each word: its code, then the number and the true texts of its bits.

    `-----` if it was not read just now.
    """
    rows = []
    for parameter in communication_words(profile).values():
        reading = readings.get(parameter.code)
        if reading is None or reading.raw is None or reading.quality != "good":
            rows.append((parameter.code, NOT_AVAILABLE))
            continue
        bits = ", ".join(bit_texts(parameter.bits, reading.raw)) or without_named_bits(reading.raw)
        rows.append((parameter.code, f"{reading.text}  {parameter.name}: {bits}"))
    return rows


def word_fields(
    profile: Profile, readings: Mapping[str, Reading]
) -> dict[str, StatusWordField | None]:
    """Return the words of a family by quantity; null for one that was not read."""
    from ..documents.parts import StatusWordField

    fields: dict[str, StatusWordField | None] = {}
    for quantity, parameter in communication_words(profile).items():
        reading = readings.get(parameter.code)
        raw = None if reading is None or reading.quality != "good" else reading.raw
        fields[quantity] = (
            None
            if reading is None or raw is None
            else StatusWordField(
                code=parameter.code,
                address=parameter.address,
                raw=raw,
                text=reading.text,
                bits=[bit.name for bit in set_bits(parameter.bits, raw)],
                texts=bit_texts(parameter.bits, raw),
            )
        )
    return fields
