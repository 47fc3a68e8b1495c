"""A TCP connection to a Modbus TCP server or to a device server."""

from __future__ import annotations

import asyncio
import socket
import time

from .base import Receiver

UNACKNOWLEDGED = 5000
"""Milliseconds after which sent bytes without acknowledgement end the connection (Linux)."""
KEEPALIVE = {"TCP_KEEPIDLE": 10, "TCP_KEEPINTVL": 5, "TCP_KEEPCNT": 3}


class TcpTransport(asyncio.Protocol):
    """One connection; made by `connect`."""

    note = ""

    def __init__(self) -> None:
        self._receiver: Receiver | None = None
        self._connection: asyncio.Transport | None = None
        self._early = bytearray()
        self._ended: str | None = None

    @classmethod
    async def connect(cls, host: str, port: int, timeout: float) -> TcpTransport:
        """Connect within `timeout` seconds. Raises OSError (TimeoutError is one)."""
        loop = asyncio.get_running_loop()
        async with asyncio.timeout(timeout):
            _, protocol = await loop.create_connection(cls, host, port)
        return protocol

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Connected: do not let a dead network go unnoticed."""
        assert isinstance(transport, asyncio.Transport)
        self._connection = transport
        peer: socket.socket = transport.get_extra_info("socket")
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        options = {**KEEPALIVE, "TCP_USER_TIMEOUT": UNACKNOWLEDGED}
        for name, value in options.items():
            option = getattr(socket, name, None)
            if option is not None:
                peer.setsockopt(socket.IPPROTO_TCP, option, value)

    def data_received(self, data: bytes) -> None:
        """Bytes came in."""
        if self._receiver is None:
            self._early += data
        else:
            self._receiver.received(data, time.monotonic())

    def connection_lost(self, exc: Exception | None) -> None:
        """The other end closed the connection, or the network did."""
        reason = f"the connection was lost ({exc})" if exc else "the other end closed"
        self._ended = reason
        self._connection = None
        if self._receiver is not None:
            receiver, self._receiver = self._receiver, None
            receiver.lost(reason)

    def start(self, receiver: Receiver) -> None:
        """Begin to pass on received bytes."""
        self._receiver = receiver
        if self._early:
            receiver.received(bytes(self._early), time.monotonic())
            self._early.clear()
        if self._ended is not None:
            self._receiver = None
            receiver.lost(self._ended)

    async def send(self, data: bytes) -> None:
        """Hand the bytes to the connection. Raises OSError."""
        if self._connection is None or self._connection.is_closing():
            raise OSError("the connection is closed")
        self._connection.write(data)

    async def rest(self, until: float) -> None:
        """Wait until `until`, to the millisecond: a network is not more exact."""
        left = until - time.monotonic()
        if left > 0:
            await asyncio.sleep(left)

    async def take_in(self) -> None:
        """Have the loop pass on the bytes that have arrived."""
        # it looks at its sockets once in each turn, and hands over behind who was ready by then
        await asyncio.sleep(0)
        await asyncio.sleep(0)

    def close(self) -> None:
        """Drop the connection."""
        self._receiver = None
        if self._connection is not None:
            self._connection.abort()
            self._connection = None
