"""A slow link between two ends of a TCP connection, with a rate and a delay.

What the link takes in it carries at its rate, piece after piece, in both directions at once; the
last byte of a piece arrives half a round trip after it was carried. The link keeps next to nothing
itself: what waits for it stays in a small buffer of the system and then, as with a modem or a
radio, with the sender, which is held back. Only what TCP carries is counted, no heads of packets.
"""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from queue import SimpleQueue

PIECE = 128
"""Bytes that a shaped link takes at once; small against a picture."""
BUFFER = 4096
"""Bytes that the system may buffer for a limited link, as a modem or a radio does."""
SEGMENT = 536
"""Most bytes of a TCP segment on a shaped link. With loopback's own of 64 kB the sender's system
would keep megabytes at once, which none does on a slow line."""
UNSHAPED_PIECE = 65536


@dataclass(frozen=True, slots=True)
class Link:
    """Properties of a link: bytes per second each way, None without a limit; round trip in s."""

    rate: float | None = None
    round_trip: float = 0.0

    @property
    def piece(self) -> int:
        """Bytes that it takes at once."""
        return UNSHAPED_PIECE if self.rate is None else PIECE


class Pace:
    """When bytes that are given to one direction of a link are carried, and when they arrive."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._free = float("-inf")

    def carried(self, now: float, size: int) -> float:
        """Take so many bytes at this time; when the last of them has left, and the link is free.

        An idle link saves nothing up: bytes after a rest take as long as any others.
        """
        start = max(now, self._free)
        self._free = start if self._link.rate is None else start + size / self._link.rate
        return self._free

    def arrival(self, carried: float) -> float:
        """When a byte arrives at the other end that has left at this time."""
        return carried + self._link.round_trip / 2


class Proxy:
    """Takes TCP connections at `port` and carries them over a link to another port of loopback.

    The link may be changed for the connections to come.
    """

    def __init__(self, target: int, link: Link) -> None:
        self.link = link
        self.down = self.up = 0
        """Bytes that have arrived, from the target and at the target."""
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._open: list[socket.socket] = []
        self.port: int = self._listener.getsockname()[1]

    @contextmanager
    def at_work(self) -> Iterator[Proxy]:
        """Carry until the block ends."""
        thread = threading.Thread(target=self._accept, daemon=True)
        thread.start()
        try:
            yield self
        finally:
            _end(self._listener)
            self.cut()
            thread.join()

    def cut(self) -> None:
        """End every connection at once, with all that is on its way."""
        while self._open:
            _end(self._open.pop())

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            link = self.link
            target = socket.socket()
            for end in (client, target):
                _keep_little(end, link)
            target.connect(("127.0.0.1", self._target))
            self._open += [client, target]
            self._carry(client, target, link, "up")
            self._carry(target, client, link, "down")

    def _carry(self, source: socket.socket, sink: socket.socket, link: Link, way: str) -> None:
        """Start one direction: a thread that reads bytes, and one that passes them on."""
        flight: SimpleQueue[tuple[float, bytes]] = SimpleQueue()
        for work in (
            lambda: _take(source, flight, link),
            lambda: self._hand_over(sink, flight, way),
        ):
            threading.Thread(target=work, daemon=True).start()

    def _hand_over(
        self, sink: socket.socket, flight: SimpleQueue[tuple[float, bytes]], way: str
    ) -> None:
        with suppress(OSError):
            while True:
                due, data = flight.get()
                _sleep_until(due)
                if not data:
                    sink.shutdown(socket.SHUT_WR)
                    return
                # counted first, so that received bytes are always counted
                setattr(self, way, getattr(self, way) + len(data))
                sink.sendall(data)


def _take(source: socket.socket, flight: SimpleQueue[tuple[float, bytes]], link: Link) -> None:
    """Take a piece whenever the link is free; what it cannot take yet waits with its sender."""
    pace = Pace(link)
    while True:
        try:
            data = source.recv(link.piece)
        except OSError:
            data = b""
        carried = pace.carried(time.monotonic(), len(data))
        flight.put((pace.arrival(carried), data))
        if not data:
            return
        _sleep_until(carried)


def _keep_little(end: socket.socket, link: Link) -> None:
    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    if link.rate is not None:
        end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, SEGMENT)


def _sleep_until(due: float) -> None:
    time.sleep(max(0.0, due - time.monotonic()))


def _end(end: socket.socket) -> None:
    with suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)
    end.close()
