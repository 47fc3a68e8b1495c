"""The socket on which the owner of a line listens: private, made anew, never left behind."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path

from ..shared_facts import SharedFacts
from .messages import VERSION
from .place import PRIVATE_FILE, SHARED_FILE, Owner, OwnerLock, SharePlace, make_private, short_path

log = logging.getLogger(__name__)

KEEPING_ENDS = 0.5
"""Seconds that a note on the disk has to end before the next owner writes its own."""

TakeIn = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class Listening:
    """Listens for programs of one line; lives in the line's loop."""

    def __init__(
        self, place: SharePlace, lock: OwnerLock, facts: SharedFacts, line: str, welcome: TakeIn
    ) -> None:
        self._place = place
        self._line = line
        self._lock = lock
        self._facts = facts
        self._stopped: dict[int, float] = {}
        self._welcome = welcome
        self._server: asyncio.Server | None = None
        self._path: Path | None = None
        self._keeping: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Listen in the first folder that takes a socket. Raises OSError where none does."""
        trouble: OSError = FileNotFoundError("no folder for the socket of the line")
        for folder in self._place.socket_folders:
            try:
                await self._listen(folder)
            except OSError as error:
                trouble = error
            else:
                return
        raise trouble

    async def _listen(self, folder: Path) -> None:
        shared = self._place.group is not None
        # nobody else may enter it, so that nobody connects before the socket has its own mode
        make_private(folder, shared=shared)
        path = folder / f"{self._place.name}.sock"
        with suppress(FileNotFoundError):
            path.unlink()
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            with short_path(path) as address:
                listening.bind(address)
            path.chmod(SHARED_FILE if shared else PRIVATE_FILE)
            if self._place.group is not None:
                os.chown(path, -1, self._place.group)
            self._server = await asyncio.start_unix_server(self._welcome, sock=listening)
        except BaseException:
            # this program may end in the midst of it
            listening.close()
            with suppress(OSError):
                path.unlink()
            raise
        self._path = path
        self._tell()

    def keep(self) -> None:
        """Begin to look after the socket and the lock; a disk that hangs is not waited for."""
        if self._keeping is None or self._keeping.done():
            self._keeping = asyncio.create_task(self._keep(), name="socket of the line")

    async def _keep(self) -> None:
        """Make the socket anew if its folder was taken away, as at the end of a log-in.

        The lock is taken anew if its file was taken away.
        """
        if not await asyncio.to_thread(lambda: self._lock.stands):
            self._renew_lock()
        if self._path is not None and await asyncio.to_thread(self._note, self._path):
            return
        if self._server is not None:
            self._server.close()
        with suppress(OSError):
            await self.start()

    def _note(self, path: Path) -> bool:
        """Write down what was stopped since; False if the socket is gone."""
        if self._facts.stops.late_times != self._stopped:
            with suppress(OSError):
                self._tell()
        return os.access(path, os.F_OK)

    def _renew_lock(self) -> None:
        with suppress(OSError):
            if self._lock.renew() and self._path is not None:
                log.error("the lock of the line was taken away, and is made anew")
                self._tell()

    def _tell(self) -> None:
        """Write down where this program listens, and what was stopped, for who comes after it."""
        self._stopped = self._facts.stops.late_times
        self._lock.tell(
            Owner(VERSION, self._facts.me, str(self._path), 0.0, self._stopped, self._line)
        )

    async def close(self) -> None:
        """Listen no more, and leave no socket behind."""
        if self._keeping is not None:
            await asyncio.wait((self._keeping,), timeout=KEEPING_ENDS)
            self._keeping.cancel()
        if self._server is not None:
            self._server.close()
        if self._path is not None:
            with suppress(OSError):
                self._path.unlink()
            self._path = None
