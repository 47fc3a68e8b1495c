"""Orders to one drive, carried out one after another in the line's loop; a stop ends them all."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from tui.drive.orders import OrderRefused

from .drive_session import DriveSession

MOST_WAITING = 4
"""Orders that may wait behind the one that is being carried out."""

Work = Callable[[], Coroutine[Any, Any, str]]


class OrderQueue:
    """Takes orders from any thread; `carry_out` says itself what became of each."""

    def __init__(
        self,
        session: DriveSession,
        carry_out: Callable[[Work], Awaitable[None]],
        dropped: Callable[[], None],
    ) -> None:
        self._session = session
        self._carry_out = carry_out
        self._dropped = dropped
        """Called in the line's thread when waiting orders were forgotten because of a stop."""
        self._lock = threading.Lock()
        self._waiting: deque[Work] = deque()

    def put(self, work: Work) -> None:
        """Carry out an order behind those before it. Raises OrderRefused where too many wait."""
        session = self._session
        with self._lock:
            if len(self._waiting) >= MOST_WAITING:
                raise OrderRefused("Earlier orders are still being carried out.")
            self._waiting.append(work)
            if session.busy is None or session.busy.done():
                session.busy = session.line.spawn(self._serve, f"order {session.device}")

    def drop(self) -> bool:
        """Forget the orders that wait; True if there were any."""
        with self._lock:
            waiting = bool(self._waiting)
            self._waiting.clear()
        return waiting

    async def _serve(self) -> None:
        try:
            while (work := self._next()) is not None:
                await self._carry_out(work)
        finally:
            if self.drop():
                self._dropped()

    def _next(self) -> Work | None:
        with self._lock:
            if self._waiting:
                return self._waiting.popleft()
            self._session.busy = None
            return None
