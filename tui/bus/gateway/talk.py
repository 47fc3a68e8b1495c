"""One connection to the Modbus TCP server, and its requests in progress."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from .room import ServedConnection, host_of

MOST_AT_ONCE = 128
"""Most requests of one connection in progress; a further read is answered with BUSY."""


@dataclass(slots=True, eq=False)
class TcpClient:
    """One connection, for as long as it lasts."""

    number: int
    peer: str
    """Host and port that it comes from."""
    host: str = ""
    left: bool = False
    """True if it sends nothing more: it may have disconnected."""


class ClientTalk:
    """Pending work of one connection."""

    def __init__(self, client: TcpClient, writer: asyncio.StreamWriter) -> None:
        self.client = client
        self.writer = writer
        self.reads = asyncio.Lock()
        self.requested = asyncio.get_running_loop().time()
        """When its last request came, on the loop's clock."""
        self.goes = False
        """True if it will be closed to make room."""
        self._under_way: set[asyncio.Task[None]] = set()
        self._writes: set[asyncio.Task[None]] = set()

    @property
    def full(self) -> bool:
        """True if no further read is accepted."""
        return len(self._under_way) >= MOST_AT_ONCE

    def place(self, now: float) -> ServedConnection:
        """Its data for the choice of the connection to close; `now` is the same for all of them."""
        waits = bool(self._under_way) and not self._writes
        idle = 0.0 if waits else now - self.requested
        host = host_of(self.writer.get_extra_info("peername"))
        return ServedConnection(host, idle, writes=bool(self._writes))

    def turn(self) -> Callable[[], Awaitable[None]]:
        """The turn of a write that arrives now."""
        before = tuple(self._writes)

        async def turn() -> None:
            if before:
                await asyncio.wait(before)

        return turn

    async def room_for_writes(self) -> None:
        """Return once not too many writes are under way; further ones stay in the socket."""
        while len(self._writes) >= MOST_AT_ONCE:
            await asyncio.wait(tuple(self._writes), return_when=asyncio.FIRST_COMPLETED)

    def begin(self, work: Coroutine[Any, Any, None], *, writes: bool) -> asyncio.Task[None]:
        task = asyncio.create_task(work)
        for tasks in (self._under_way, self._writes) if writes else (self._under_way,):
            tasks.add(task)
            task.add_done_callback(tasks.discard)
        return task

    def make_room(self) -> None:
        """Close the connection to make room, but carry out the writes that came before."""
        self.goes = True
        self.writer.transport.abort()

    def cancel(self) -> None:
        """Stop answering."""
        for task in self._under_way - self._writes if self.goes else self._under_way:
            task.cancel()

    async def ended(self) -> None:
        """Return once all is answered; cancelled, it cancels that."""
        await asyncio.gather(*self._under_way, return_exceptions=True)


def peer_text(peer: object) -> str:
    """Return the source of a connection as a person writes it."""
    if not isinstance(peer, tuple) or len(peer) < 2:
        return "somewhere"
    host, port = str(peer[0]), peer[1]
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
