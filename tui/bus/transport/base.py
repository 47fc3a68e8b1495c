"""Transport of the bytes of a line: a port or a connection, opened and ready."""

from __future__ import annotations

from typing import Protocol


class Receiver(Protocol):
    """Receiver of a transport's bytes; called in the line's loop."""

    def received(self, data: bytes, time: float) -> None:
        """Take bytes; `time` is when they were read from the system."""

    def lost(self, reason: str) -> None:
        """Note that the transport is lost; called once."""


class Transport(Protocol):
    """Bytes out, bytes in, and exact pauses in between."""

    note: str
    """Unusual properties of this port; empty if none."""

    def start(self, receiver: Receiver) -> None:
        """Begin to receive; called once, in the line's loop."""

    async def send(self, data: bytes) -> None:
        """Hand the bytes to the system. Raises OSError."""

    async def rest(self, until: float) -> None:
        """Wait exactly until a time of the line's clock; shorter if bytes come in."""

    async def take_in(self) -> None:
        """Pass on the bytes that the system already has: they precede the next request."""

    def close(self) -> None:
        """Give the port back; may be called twice."""
