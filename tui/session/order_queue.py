"""Orders to one drive, carried out one after another in the line's loop; a stop ends them all."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from tui.bus.line import Line, Worker
from tui.drive.orders import OrderRefused

MOST_WAITING = 4
"""Orders that may wait behind the one that is being carried out."""
BY_STOP = "ended by a stop"


@dataclass(frozen=True, slots=True)
class Order:
    """Something to be done to a drive, by whichever screen or command."""

    carry_out: Callable[[], Awaitable[None]]
    """Says itself what became of it, whatever that is."""
    dropped: Callable[[str], None]
    """Called with the reason, in any thread, where it is forgotten before it began."""


class OrderQueue:
    """Takes the orders to one drive from any thread."""

    def __init__(self, line: Line, device: int) -> None:
        self._line = line
        self._device = device
        self._lock = threading.Lock()
        self._waiting: deque[Order] = deque()
        self._worker: Worker | None = None

    @property
    def busy(self) -> bool:
        """Whether an order is being carried out."""
        return self._worker is not None and not self._worker.done()

    def put(self, order: Order) -> None:
        """Carry out an order behind those before it. Raises OrderRefused where too many wait."""
        with self._lock:
            if len(self._waiting) >= MOST_WAITING:
                raise OrderRefused("Earlier orders are still being carried out.")
            self._waiting.append(order)
            if not self.busy:
                self._worker = self._line.spawn(self._serve, f"order {self._device}")

    def cancel(self) -> None:
        """End the order that is being carried out, and forget those behind it."""
        with self._lock:
            worker, self._worker = self._worker, None
        if worker is not None:
            worker.cancel()
        # a worker that had no time to begin would leave them to the next order
        self.drop(BY_STOP)

    def drop(self, why: str) -> bool:
        """Forget the orders that wait; True if there were any."""
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        for order in waiting:
            order.dropped(why)
        return bool(waiting)

    async def _serve(self) -> None:
        try:
            while (order := self._next()) is not None:
                await order.carry_out()
        finally:
            self.drop(BY_STOP)

    def _next(self) -> Order | None:
        with self._lock:
            if self._waiting:
                return self._waiting.popleft()
            self._worker = None
            return None
