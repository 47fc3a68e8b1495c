"""Reading what arrives in time from a drive on a shared line."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.session.console import DriveConsole
    from tui.session.reading import Reading


async def read_until(
    console: DriveConsole, codes: Sequence[str], end: float
) -> tuple[dict[str, Reading], list[str]]:
    """Readings by code, the state first, and the codes that did not arrive in time.

    `end` is a time of the loop. Raises the line's errors if nothing comes.
    """
    from tui.bus.errors import ExchangeError
    from tui.session.read.reader import Reader
    from tui.session.reading import with_text

    readings: dict[str, Reading] = {}
    failure: Exception | None = None
    for group in sorted(Reader(console.session).groups(codes), key=lambda g: codes.index(g[0])):
        try:
            async with asyncio.timeout_at(end):
                readings |= with_text(await console.read(group))
        except (ExchangeError, TimeoutError) as error:
            if failure is not None and not readings:
                raise failure from error
            failure = error
    if failure is not None and not readings:
        raise failure
    return readings, [code for code in codes if code not in readings]
