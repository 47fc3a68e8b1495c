"""Sending of prepared writes around the queue, if the code of the normal way has failed."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass

from tui.safety import TURN_WITHIN

from ..errors import LineLost
from ..master import Master
from ..prepared import PreparedWrite
from ..transport.base import Transport

log = logging.getLogger(__name__)

AFTER_OWN_PORT = 0.05
"""Seconds for which a port opened for one frame stays open, so that its bytes get out."""

Ended = Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    writes: Sequence[PreparedWrite]
    ended: Ended


class LastWay:
    """Sends finished frames by any way that still works; lives in the line's loop.

    The ways: between two exchanges of the open port, as long as the dispatcher runs, else without
    waiting for it; through the owner of a shared line; on a port of its own. It shares no code with
    the queue.
    """

    def __init__(
        self,
        to_owner: Callable[[bytes], bool],
        wake: Callable[[], None],
        open_transport: Callable[[], Awaitable[Transport]],
        note: Callable[[bytes], None],
    ) -> None:
        self.master: Master | None = None
        """The open line; None while there is none, or another program owns it."""
        self._to_owner = to_owner
        self._wake = wake
        self._open_transport = open_transport
        self._note = note
        self._waiting: list[_Waiting] = []
        self._tasks: set[asyncio.Task[None]] = set()

    def put(self, writes: Sequence[PreparedWrite], ended: Ended) -> None:
        """Send writes as soon as possible; `ended` gets why one was not sent, or nothing."""
        self._waiting.append(_Waiting(writes, ended))
        if self.master is None:
            self._send_now()
            return
        asyncio.get_running_loop().call_later(TURN_WITHIN, self._send_now)
        self._wake()

    def lose(self) -> None:
        """Forget the line, which is closed; waiting writes are sent by another way."""
        self.master = None
        self._send_now()

    @property
    def waits(self) -> bool:
        """True if writes wait for the end of the exchange in flight."""
        return bool(self._waiting)

    def _send_now(self) -> None:
        if self._waiting:
            task = asyncio.get_running_loop().create_task(self.send_waiting())
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def send_waiting(self) -> None:
        """Send all that waits."""
        waiting, self._waiting = self._waiting, []
        for item in waiting:
            why = ""
            for write in item.writes:
                why = await self._send(write) or why
            item.ended(why)

    async def _send(self, write: PreparedWrite) -> str:
        why = ""
        for way in (self._by_owner, self._by_open_line, self._by_own_port):
            try:
                if await way(write):
                    return ""
            except Exception as error:
                log.error("a prepared frame was not sent", exc_info=error)
                why = str(error) or type(error).__name__
        return why or "there is no line"

    async def _by_owner(self, write: PreparedWrite) -> bool:
        return self._to_owner(write.message)

    async def _by_open_line(self, write: PreparedWrite) -> bool:
        if self.master is None:
            return False
        await self.master.send_finished(write.frame)
        self._trace(write)
        return True

    async def _by_own_port(self, write: PreparedWrite) -> bool:
        transport = await self._open_transport()
        try:
            await transport.send(write.frame)
            self._trace(write)
            await asyncio.sleep(AFTER_OWN_PORT)
        except OSError as error:
            raise LineLost(str(error.strerror or error)) from error
        finally:
            transport.close()
        return True

    def _trace(self, write: PreparedWrite) -> None:
        try:
            self._note(write.frame)
        except Exception:
            log.exception("a prepared frame was sent, but not noted")
