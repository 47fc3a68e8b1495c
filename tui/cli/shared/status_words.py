"""Command and status words of a drive, as `status` shows them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tui.drive.communication_words import communication_words
from tui.drive.values import NOT_AVAILABLE, set_bits

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.reading import Reading

    from ..documents.parts import StatusWordField


def word_rows(profile: Profile, readings: Mapping[str, Reading]) -> list[tuple[str, str]]:
    """Return a row for each word: its code, then the number and the names of its bits that are 1.

    `-----` if it was not read just now.
    """
    rows = []
    for parameter in communication_words(profile).values():
        reading = readings.get(parameter.code)
        if reading is None or reading.raw is None or reading.quality != "good":
            rows.append((parameter.code, NOT_AVAILABLE))
            continue
        bits = ", ".join(bit.name for bit in set_bits(parameter.bits, reading.raw)) or "no bit set"
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
            )
        )
    return fields
