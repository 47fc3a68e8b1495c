"""The drives of several lines, found side by side: what one lacks keeps it from no other."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from .drives import failed
from .errors import DONE, failure_of
from .options import Target, connect_drive
from .output import print_json
from .several_lines import LineWish, connected
from .silence import silence_hint

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

T = TypeVar("T")
FoundOnLines = list[tuple[LineWish, "DriveSession"]]


async def find_drives(
    lines: Sequence[tuple[OpenLine, LineWish]], *, as_json: bool
) -> tuple[FoundOnLines, int]:
    """The wanted drives that are there, in order, and the highest status of the others.

    Errors of one of several are reported; raises it where there is one drive only.
    """
    wanted = sum(len(wish.on(opened)) for opened, wish in lines)
    found = _Finding(alone=wanted == 1, several=len(lines) > 1, as_json=as_json)
    each = await asyncio.gather(*(found.on_line(opened, wish) for opened, wish in lines))
    return [pair for some in each for pair in some], found.worst


class _Finding:
    """Finds drives, and reports those that it does not find."""

    def __init__(self, *, alone: bool, several: bool, as_json: bool) -> None:
        self.worst = DONE
        self._alone = alone
        self._several = several
        self._as_json = as_json

    async def on_line(self, opened: OpenLine, wish: LineWish) -> FoundOnLines:
        """The drives of one line."""
        drives = wish.on(opened)
        there = partial(_there, opened, wish)
        if self._several and not await self._done(there, opened, wish, drives):
            return []
        found: FoundOnLines = []
        for drive in drives:
            connect = partial(connect_drive, opened, drive)
            made = await self._done(connect, opened, wish, [drive])
            found += [(wish, made)] if made is not None else []
        return found

    async def _done(
        self,
        work: Callable[[], Awaitable[T]],
        opened: OpenLine,
        wish: LineWish,
        drives: Sequence[Target],
    ) -> T | None:
        try:
            return await work()
        except Exception as error:
            if self._alone:
                raise
            failure = failure_of(error)
            self.worst = max(self.worst, failure.status)
            text = failure.message + silence_hint(error, opened, wish.drives[0])
            for drive in drives:
                reported = failed(drive, text, failure.status, wish.name if self._several else "")
                if self._as_json:
                    print_json(reported, compact=True)
            return None


async def _there(opened: OpenLine, wish: LineWish) -> bool:
    await connected(opened, wish.name)
    return True
