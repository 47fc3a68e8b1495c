"""A serial port on POSIX: its file descriptor in the line's loop, and pauses exact to 0.1 ms."""

from __future__ import annotations

import asyncio
import os
import select
import time

import serial

from .base import Receiver
from .opening import closed_beside
from .port_errors import PortErrors, port_errors

LUMP = 4096
WAITED_ON_PORT = 0.0025
"""The loop wakes to the millisecond only; the last part of a pause is waited on the port."""
SHORT_PAUSE = 0.004
"""Longest pause for which the loop sleeps: to run it in between would cost more."""
SPIN = 0.00008
"""The system wakes a sleeper that much late; the very last part is waited in a short loop."""
SEND_TIMEOUT = 1.0


class PosixSerial:
    """An opened serial port, read and written without blocking."""

    def __init__(self, port: serial.Serial, note: str = "") -> None:
        self.note = note
        self._port = port
        self._fd: int | None = port.fileno()
        self._receiver: Receiver | None = None
        self._resumes: asyncio.TimerHandle | None = None
        os.set_blocking(port.fileno(), False)

    def start(self, receiver: Receiver) -> None:
        """Begin to receive in the running loop."""
        self._receiver = receiver
        self._resume()

    def pause(self, seconds: float) -> None:
        """Read nothing for so many seconds, unless something is sent before.

        Each wake-up of the loop costs more than the bytes that it delivers.
        """
        if self._fd is None or self._resumes is not None:
            return
        if seconds <= SHORT_PAUSE:
            time.sleep(seconds)
            self._take()
            return
        loop = asyncio.get_running_loop()
        loop.remove_reader(self._fd)
        until = time.monotonic() + seconds
        self._resumes = loop.call_later(seconds - WAITED_ON_PORT, self._resume, until)

    def _resume(self, until: float = 0.0) -> None:
        if self._resumes is not None:
            self._resumes.cancel()
            self._resumes = None
        if self._fd is not None:
            time.sleep(max(0.0, until - time.monotonic()))
            asyncio.get_running_loop().add_reader(self._fd, self._take)

    def _take(self) -> None:
        """Read the available bytes; a lost port shows as an error or as nothing to read."""
        if self._fd is None or self._receiver is None:
            return
        try:
            data = os.read(self._fd, LUMP)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self._end(f"the port disappeared ({error.strerror or error})")
            return
        now = time.monotonic()
        if data:
            self._receiver.received(data, now)
        else:
            self._end("the port disappeared")

    def _end(self, reason: str) -> None:
        receiver = self._receiver
        self.close()
        if receiver is not None:
            receiver.lost(reason)

    async def send(self, data: bytes) -> None:
        """Write all bytes. Raises OSError when the port is gone or takes nothing."""
        if self._resumes is not None:
            self._resume()
        while data:
            if self._fd is None:
                raise OSError("the port is closed")
            try:
                data = data[os.write(self._fd, data) :]
            except (BlockingIOError, InterruptedError):
                await self._writable()

    async def _writable(self) -> None:
        if self._fd is None:
            return
        loop = asyncio.get_running_loop()
        ready: asyncio.Future[None] = loop.create_future()

        def wake() -> None:
            if not ready.done():
                ready.set_result(None)

        loop.add_writer(self._fd, wake)
        try:
            async with asyncio.timeout(SEND_TIMEOUT):
                await ready
        except TimeoutError:
            raise OSError("the port accepts no bytes") from None
        finally:
            if self._fd is not None:
                loop.remove_writer(self._fd)

    async def rest(self, until: float) -> None:
        """Wait until `until`; returns early once bytes have been received."""
        left = until - time.monotonic()
        if left > WAITED_ON_PORT:
            await asyncio.sleep(left - WAITED_ON_PORT)
        while self._fd is not None:
            left = until - time.monotonic()
            if left <= 0:
                return
            if left > SPIN and select.select([self._fd], [], [], left - SPIN)[0]:
                self._take()
                return

    async def take_in(self) -> None:
        """Pass on the bytes that the port already has."""
        # poll first: reading from a port without bytes looks like a lost port
        if self._fd is not None and select.select([self._fd], [], [], 0)[0]:
            self._take()

    def errors(self) -> PortErrors | None:
        """Return the port's counts of broken characters; None if it does not count."""
        return port_errors(self._fd) if self._fd is not None else None

    def close(self) -> None:
        """Close the port; a lock on it ends with that."""
        if self._fd is None:
            return
        asyncio.get_running_loop().remove_reader(self._fd)
        self._fd = None
        self._receiver = None
        closed_beside(str(self._port.port), self._port.close)
