"""A serial port read by a thread of its own, for systems whose ports no event loop can watch."""

from __future__ import annotations

import asyncio
import threading
import time
from contextlib import suppress

import serial

from .base import Receiver
from .port_errors import PortErrors

READ_TIMEOUT = 0.05
COARSE_SLEEP = 0.002
JOIN_TIMEOUT = 1.0


class ThreadedSerial:
    """An open serial port whose thread passes received bytes to the line's loop."""

    def __init__(self, port: serial.Serial, note: str = "") -> None:
        self.note = note
        self._port = port
        self._port.timeout = READ_TIMEOUT
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, receiver: Receiver) -> None:
        """Begin to receive."""
        loop = asyncio.get_running_loop()
        self._thread = threading.Thread(
            target=self._work, args=(loop, receiver), name="line-reader", daemon=True
        )
        self._thread.start()

    def _work(self, loop: asyncio.AbstractEventLoop, receiver: Receiver) -> None:
        # a loop that has ended needs nothing any more
        with suppress(RuntimeError):
            while not self._closing.is_set():
                try:
                    data = self._port.read(1)
                    if data:
                        data += self._port.read(self._port.in_waiting)
                except (OSError, TypeError) as error:
                    # pyserial raises TypeError when the port is closed under a read
                    if not self._closing.is_set():
                        reason = f"the port disappeared ({error})"
                        loop.call_soon_threadsafe(receiver.lost, reason)
                    return
                if data:
                    loop.call_soon_threadsafe(receiver.received, data, time.monotonic())

    async def send(self, data: bytes) -> None:
        """Write all bytes. Raises OSError when the port is gone."""
        self._port.write(data)

    async def rest(self, until: float) -> None:
        """Wait until `until`."""
        left = until - time.monotonic()
        if left > COARSE_SLEEP:
            await asyncio.sleep(left - COARSE_SLEEP)
        left = until - time.monotonic()
        if left > 0:
            # a loop wakes to the millisecond only, which is half of the silence due
            time.sleep(left)  # noqa: ASYNC251
        # what the thread has read in the meantime is handed over first
        await asyncio.sleep(0)

    async def take_in(self) -> None:
        """Have the loop pass on the bytes that the thread has read."""
        await asyncio.sleep(0)

    def pause(self, seconds: float) -> None:
        """Read on: the thread that waits for bytes cannot be paused."""

    def errors(self) -> PortErrors | None:
        """Nothing: if ports are read by threads the system reports no counts."""
        return None

    def close(self) -> None:
        """End the thread and close the port."""
        self._closing.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(JOIN_TIMEOUT)
        self._thread = None
        self._port.close()
