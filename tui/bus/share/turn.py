"""Whose turn it is where several programs send stops past a frozen owner."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from time import monotonic

from .place import PRIVATE_FILE, SHARED_FILE, SharePlace, make_private

log = logging.getLogger(__name__)

LONGEST_TURN = 1.5
"""Seconds after which another one's turn is waited for no more: it may be frozen itself."""
TURN_LOOK = 0.005


class Turn:
    """The right to send, by a lock of its own, for a few exchanges each."""

    def __init__(self, place: SharePlace) -> None:
        self._place = place
        self._path = place.lock_path.with_suffix(".turn")

    @asynccontextmanager
    async def taken(self) -> AsyncIterator[None]:
        """While inside it is this program's turn; also where no lock is to be had."""
        descriptor = self._open()
        try:
            if descriptor is not None:
                await self._lock(descriptor)
            yield
        finally:
            if descriptor is not None:
                os.close(descriptor)

    def _open(self) -> int | None:
        shared = self._place.group is not None
        try:
            make_private(self._path.parent, shared=shared)
            mode = SHARED_FILE if shared else PRIVATE_FILE
            return os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, mode)
        except OSError as error:
            log.error("stops past the owner are not sent in turns: %s", error)
            return None

    async def _lock(self, descriptor: int) -> None:
        import fcntl

        end = monotonic() + LONGEST_TURN
        while monotonic() < end:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                await asyncio.sleep(TURN_LOOK)
            except OSError as error:
                log.error("stops past the owner are not sent in turns: %s", error)
                return
            else:
                return
        log.error("another program keeps its turn for too long: a stop goes out all the same")
