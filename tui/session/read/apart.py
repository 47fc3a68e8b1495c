"""Reading words of which a drive may lack some, where a missing one meets silence."""

from __future__ import annotations

from collections.abc import Iterable

from tui.bus.errors import NoAnswer

from ..reading import Reading
from .presence import look_for_drive, meets_silence
from .reader import Reader

NO_SUCH_WORD = "no answer, while the drive answers otherwise: perhaps it has no such word"


async def read_apart(reader: Reader, codes: Iterable[str]) -> dict[str, Reading]:
    """Readings by code, as a person asked for them; those that meet silence are bad ones.

    They are asked for together, and one by one where that brings no answer but the drive is there.
    Raises the line's errors, NoAnswer where the drive answers nothing.
    """
    wanted = list(dict.fromkeys(codes))
    try:
        return await reader.read(wanted)
    except NoAnswer as error:
        if not meets_silence(reader.profile):
            raise
        await look_for_drive(reader.session, error)
    return {code: await _alone(reader, code) for code in wanted}


async def _alone(reader: Reader, code: str) -> Reading:
    try:
        return (await reader.read([code]))[code]
    except NoAnswer as error:
        await look_for_drive(reader.session, error)
        now = reader.session.clock.monotonic()
        return Reading.bad(reader.profile[code], now, NO_SUCH_WORD)
