"""Endpoint of a simulated line on a port that the caller opened."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

from .conversation import Conversation
from .endpoints import CHUNK, Endpoint, wait_time

STREAM_PAUSE = 0.005
"""Longest pause in s between two reads of an opened port without data."""


class ByteStream(Protocol):
    """Open port of the caller: reads with a short timeout, writes, closes."""

    def read(self, size: int, /) -> bytes:
        """Return up to `size` bytes; b"" after the timeout."""

    def write(self, data: bytes, /) -> int | None:
        """Write all bytes."""

    def close(self) -> None:
        """Close the port."""


class StreamEndpoint(Endpoint):
    """Port that the caller opened; it is closed at the end, and cannot be plugged in again."""

    def __init__(self, converse: Callable[[], Conversation], stream: ByteStream) -> None:
        super().__init__("simulated line, port", converse)
        self._stream = stream
        self.error: OSError | None = None
        """Error that ended the port, if any."""

    def _open(self) -> None:
        return

    def _work(self) -> None:
        conversation = self._converse()
        try:
            while not self._stopping.is_set():
                if data := self._stream.read(CHUNK):
                    conversation.feed(data, time.monotonic())
                else:
                    time.sleep(wait_time(conversation, STREAM_PAUSE) or 0.0)
                if out := conversation.poll(time.monotonic()):
                    self._stream.write(out)
        except OSError as error:
            self.error = error

    def _wake(self) -> None:
        return

    def _shut(self) -> None:
        self._stream.close()
