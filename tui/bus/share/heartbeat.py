"""The heartbeat of an attached program, sent by a thread on a connection of its own.

It shows that the process lives: one that is stopped or swapped out sends none. A loop of the line
that is busy for a moment does not hold it up. One that hangs ends it.
"""

from __future__ import annotations

import socket
import threading
import time
from pathlib import Path

from .messages import Alive, Pulse, packed
from .place import reached

BEAT_INTERVAL = 0.4
"""Seconds between two beats."""
LOOP_HANGS = 3.0
"""Seconds without a turn of the line's loop after which it counts as hung."""
BEAT_WITHIN = 0.5
"""Seconds that the holder has to take a beat."""
_ALIVE = packed(Alive())


class Heartbeat:
    """Beats from the start until it is closed, as long as the loop of the line turns."""

    def __init__(self, holder: str, program: str) -> None:
        """`holder` is the socket of the process that holds the line."""
        self._holder = Path(holder)
        self._greeting = packed(Pulse(program))
        self._turned = time.monotonic()
        self._ended = threading.Event()
        threading.Thread(target=self._work, name="heartbeat", daemon=True).start()

    def turn(self) -> None:
        """The loop of the line has turned."""
        self._turned = time.monotonic()

    def close(self) -> None:
        """Beat no more."""
        self._ended.set()

    def _work(self) -> None:
        connection: socket.socket | None = None
        while not self._ended.is_set():
            if time.monotonic() - self._turned < LOOP_HANGS:
                connection = self._beat(connection)
            self._ended.wait(BEAT_INTERVAL)
        if connection is not None:
            connection.close()

    def _beat(self, connection: socket.socket | None) -> socket.socket | None:
        """Beat once; returns the connection for the next beat, None if there is none."""
        try:
            if connection is None:
                connection = reached(self._holder, BEAT_WITHIN)
                connection.sendall(self._greeting)
            else:
                connection.sendall(_ALIVE)
        except (OSError, ValueError):
            if connection is not None:
                connection.close()
            return None
        return connection
