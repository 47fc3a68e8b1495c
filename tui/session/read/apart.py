"""Reading words that a drive may lack, for families that do not answer a missing word."""

from __future__ import annotations

from collections.abc import Iterable

from tui.bus.errors import NoAnswer

from ..reading import Reading
from .presence import look_for_drive, meets_silence
from .reader import Reader

NO_SUCH_WORD = "no answer, while the drive answers otherwise: perhaps it has no such word"


async def read_apart(reader: Reader, codes: Iterable[str]) -> dict[str, Reading]:
    """Read parameters that a person chose; one without an answer gets a bad reading.

    Reads them together, or one at a time if that gets no answer but the drive is present.
    Raises the line's errors, and NoAnswer if the drive answers nothing at all.
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
