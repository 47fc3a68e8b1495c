"""Reading the settings that show in which order the bytes of a drive's words arrive."""

from __future__ import annotations

import asyncio

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.drive.byte_order import telling_codes

from .presence import look_for_drive, meets_silence
from .reader import Reader

CHECK_WITHIN = 3.0
"""Seconds that the settings may take: five reads of a slow line."""


async def check_byte_order(reader: Reader, priority: Priority) -> None:
    """Read them once, and again while not all values agree, or after the line was lost.

    Raises BytesSwapped, and the line's errors. A drive that meets unknown words with silence may
    lack these: then nothing is known, and they are not read again. What takes longer than
    CHECK_WITHIN is left for the next time.
    """
    session = reader.session
    order = session.byte_order
    if not order.is_doubtful:
        return
    try:
        async with asyncio.timeout(CHECK_WITHIN):
            await reader.read(telling_codes(session.profile), priority=priority)
    except TimeoutError:
        return
    except NoAnswer as error:
        if error.retry_in is not None or not meets_silence(session.profile):
            raise
        await look_for_drive(session, error)
    order.note_tested()
