"""A Modbus TCP server that hands each request to somebody who answers in his own time.

pymodbus' server keeps one request of a connection at hand: an answer that is awaited would leave
with the transaction id of whatever came meanwhile, so frames are taken apart and put together
here. Reads of one connection are answered in their order; a write waits for its turn behind the
writes before it where who answers asks for that: a stop does not.
"""

from __future__ import annotations

import asyncio
import logging
import struct
from collections.abc import Awaitable, Callable, Coroutine, Iterable
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic
from typing import Any, SupportsIndex

from tui.safety import GATEWAY_SUSPENDED_AFTER

from .pdu import BUSY, DEVICE_FAILURE, WRITE_FUNCTIONS, exception_pdu
from .room import host_of, makes_room
from .talk import ClientTalk, TcpClient, peer_text

log = logging.getLogger(__name__)

HEADER = struct.Struct(">HHHB")
LONGEST_PDU = 253
MOST_CLIENTS = 64
"""Connections at a time; for one more another one makes room, see `makes_room`."""
MOST_LEAVING = 64
"""Most closed connections whose writes are still in progress."""
IDLE_CLIENT_ENDS_AFTER = 600.0
"""Seconds after which a connection without requests, or with unread answers, is closed."""


class _Incoming(asyncio.StreamReader):
    """The bytes of a connection; knows which of them waited while this program was suspended."""

    def __init__(self, awake: Awake, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__(loop=loop)
        self._awake = awake
        self._came = self._taken = self._stale = 0

    def feed_data(self, data: Iterable[SupportsIndex]) -> None:
        came = bytes(data)
        self._came += len(came)
        if self._awake.just_woke:
            self._stale = self._came
        super().feed_data(came)

    async def take(self, count: int) -> bytes:
        """The next bytes; waits for them as long as a client may be idle."""
        async with asyncio.timeout(IDLE_CLIENT_ENDS_AFTER):
            data = await self.readexactly(count)
        self._taken += count
        return data

    @property
    def stale(self) -> bool:
        """True if the bytes that were read last waited while this program was suspended."""
        return self._taken <= self._stale


async def at_once() -> None:
    """The turn of a request that has none before it."""


@dataclass(frozen=True, slots=True)
class TcpRequest:
    """A request as it came in."""

    client: TcpClient
    unit: int
    pdu: bytes
    stale: bool = False
    """True if it waited while this program was suspended: its effect may be unexpected now."""
    turn: Callable[[], Awaitable[None]] = at_once
    """Returns once the writes that came before it on its connection are answered."""


TcpAnswer = Callable[[TcpRequest], Coroutine[Any, Any, bytes]]
"""Returns the bytes of the answer; called immediately on a request, awaited afterwards."""


class TcpGateway:
    """Listens and answers until it is closed; lives in one loop."""

    def __init__(
        self,
        answer: TcpAnswer,
        gone: Callable[[TcpClient], None] = lambda _: None,
        awake: Awake | None = None,
    ) -> None:
        self._answer = answer
        self._gone = gone
        self._server: asyncio.Server | None = None
        self._talks: dict[asyncio.Task[None], ClientTalk] = {}
        self._count = 0
        self._awake = awake or Awake()

    async def listen(self, host: str, port: int) -> tuple[str, int]:
        """Listen at an address; returns it with the port that was found for 0. Raises OSError."""
        self._awake.start()
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._protocol, host, port)
        found = self._server.sockets[0].getsockname()
        return found[0], found[1]

    def _protocol(self) -> asyncio.StreamReaderProtocol:
        loop = asyncio.get_running_loop()
        incoming = _Incoming(self._awake, loop)
        return asyncio.StreamReaderProtocol(
            incoming, lambda _, writer: self._serve(incoming, writer), loop=loop
        )

    async def close(self) -> None:
        """Stop listening, and close all connections."""
        self._awake.close()
        if self._server is not None:
            self._server.close()
        tasks = tuple(self._talks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, reader: _Incoming, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        peer = writer.get_extra_info("peername")
        self._make_room(host_of(peer))
        self._count += 1
        client = TcpClient(self._count, peer_text(peer), host_of(peer))
        talk = self._talks[task] = ClientTalk(client, writer)
        try:
            await self._converse(talk, reader)
        except (OSError, EOFError, TimeoutError) as error:
            log.info("Modbus TCP client %s has disconnected: %s", client.peer, error or "idle")
        except asyncio.CancelledError:
            # closing the gateway is no error of this connection
            return
        finally:
            self._talks.pop(task, None)
            self._gone(client)
            with suppress(OSError, RuntimeError):
                writer.close()

    def _make_room(self, host: str) -> None:
        """Close another connection if there are too many with the one from this host."""
        now = asyncio.get_running_loop().time()
        here = {task: talk.place(now) for task, talk in self._talks.items() if not talk.goes}
        if len(here) < MOST_CLIENTS:
            return
        leaving = [task for task, talk in self._talks.items() if talk.goes]
        for task in leaving[: max(0, len(leaving) - MOST_LEAVING + 1)]:
            task.cancel()
        task = makes_room(host, here)
        talk = self._talks[task]
        log.warning("Modbus TCP client %s makes room for one from %s", talk.client.peer, host)
        talk.make_room()
        task.cancel()

    async def _converse(self, talk: ClientTalk, reader: _Incoming) -> None:
        client = talk.client
        try:
            while True:
                head = await reader.take(HEADER.size)
                transaction, protocol, length, unit = HEADER.unpack(head)
                if protocol != 0 or not 2 <= length <= LONGEST_PDU + 1:
                    log.warning(
                        "%s sends bytes that are not Modbus TCP; its connection is closed",
                        client.peer,
                    )
                    return
                pdu = await reader.take(length - 1)
                talk.requested = asyncio.get_running_loop().time()
                await talk.room_for_writes()
                request = TcpRequest(client, unit, pdu, reader.stale, talk.turn())
                await self._begin(talk, transaction, request)
        except asyncio.CancelledError:
            talk.cancel()
            raise
        finally:
            client.left = True
            # requests sent before the client left are carried out: one may be a stop
            await talk.ended()

    async def _begin(self, talk: ClientTalk, transaction: int, request: TcpRequest) -> None:
        """Have one request answered, beside those before it; no read keeps what is behind it."""
        function = request.pdu[0]
        writes = function in WRITE_FUNCTIONS
        if not writes and talk.full:
            await self._send(talk, transaction, request.unit, exception_pdu(function, BUSY))
            return
        answer = self._answer(request)
        task = talk.begin(self._one(talk, transaction, request, answer), writes=writes)
        # one that is cancelled before it began awaits nothing
        task.add_done_callback(lambda _: answer.close())

    async def _one(
        self, talk: ClientTalk, transaction: int, request: TcpRequest, answer: Awaitable[bytes]
    ) -> None:
        """Answer one request; reads of a connection take turns."""
        if request.pdu[0] in WRITE_FUNCTIONS:
            reply = await self._replied(request, answer)
        else:
            async with talk.reads:
                reply = await self._replied(request, answer)
        await self._send(talk, transaction, request.unit, reply)

    async def _send(self, talk: ClientTalk, transaction: int, unit: int, reply: bytes) -> None:
        if talk.writer.is_closing():
            return  # it has disconnected: no answer arrives, and asyncio would log each
        try:
            talk.writer.write(HEADER.pack(transaction, 0, len(reply) + 1, unit) + reply)
            async with asyncio.timeout(IDLE_CLIENT_ENDS_AFTER):
                await talk.writer.drain()
        except (OSError, TimeoutError) as error:
            log.info("Modbus TCP client %s took no answer: %s", talk.client.peer, error or "idle")
            talk.writer.transport.abort()

    async def _replied(self, request: TcpRequest, answer: Awaitable[bytes]) -> bytes:
        try:
            return await answer
        except Exception:
            # an internal error in one request closes no connection
            log.exception("a request of %s: %s", request.client.peer, request.pdu.hex())
            return exception_pdu(request.pdu[0], DEVICE_FAILURE)


LOOK_AWAKE = 0.5
"""Seconds between two looks."""
CATCHES_UP = 1.0
"""Seconds after a suspension in which a loop reads what came in the meantime."""


class Awake:
    """Checks the time regularly to detect a suspension; lives in one loop."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._looked = self._stale_until = clock()
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin the checks."""
        self._looked = self._clock()
        self._task = asyncio.get_running_loop().create_task(self._work(), name="awake")

    def close(self) -> None:
        """End the checks."""
        if self._task is not None:
            self._task.cancel()

    @property
    def just_woke(self) -> bool:
        """True if bytes that come in now may have come while the loop was suspended."""
        now = self._clock()
        # the bytes of a connection are taken in before the look that is due
        return now - self._looked > GATEWAY_SUSPENDED_AFTER or now < self._stale_until

    def look(self) -> None:
        """Note that the loop runs."""
        now = self._clock()
        if now - self._looked > GATEWAY_SUSPENDED_AFTER:
            self._stale_until = now + CATCHES_UP
        self._looked = now

    async def _work(self) -> None:
        while True:
            await asyncio.sleep(LOOK_AWAKE)
            self.look()
