"""Ways to reach a simulated line."""

from __future__ import annotations

from typing import Protocol


class ByteStream(Protocol):
    """An opened port that the caller gives: reads with a short time-out, writes, closes."""

    def read(self, size: int, /) -> bytes:
        """Up to `size` bytes; b"" when the time-out passes."""

    def write(self, data: bytes, /) -> int | None:
        """Write all bytes."""

    def close(self) -> None:
        """Close the port."""
