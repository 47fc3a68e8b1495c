"""Reading the settings that reveal the byte order of a drive's words."""

from __future__ import annotations

import asyncio

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.drive.byte_order import telling_codes

from .presence import look_for_drive, meets_silence
from .reader import Reader

CHECK_WITHIN = 3.0
"""Longest time of the check in seconds: five reads on a slow line."""


async def check_byte_order(reader: Reader, priority: Priority) -> None:
    """Read these settings if the byte order is not certain yet, or after the line was lost.

    Raises BytesSwapped, and the line's errors. If the drive does not answer them although it is
    present, it may lack these words; the byte order then stays unknown. After CHECK_WITHIN the
    check stops, and the next call repeats it.
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
