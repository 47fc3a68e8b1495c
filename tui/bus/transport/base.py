"""Transport of the bytes of a line: a port or a connection, opened and ready."""

from __future__ import annotations

from typing import Protocol


class Receiver(Protocol):
    """The one who gets what a transport receives; called in the line's loop."""

    def received(self, data: bytes, time: float) -> None:
        """Bytes came in; `time` is when they were taken from the system."""

    def lost(self, reason: str) -> None:
        """The transport cannot be used any more; said once."""


class Transport(Protocol):
    """Bytes out, bytes in, and exact pauses in between."""

    note: str
    """Unusual properties of this port; empty if none."""

    def start(self, receiver: Receiver) -> None:
        """Begin to receive; called once, in the line's loop."""

    async def send(self, data: bytes) -> None:
        """Hand the bytes to the system. Raises OSError."""

    async def rest(self, until: float) -> None:
        """Wait until a time of the line's clock, exactly; shorter if bytes come in."""

    async def take_in(self) -> None:
        """Hand over what the system holds already: it came before what is sent next."""

    def close(self) -> None:
        """Give the port back; may be called twice."""
