"""Messages to systemd by the protocol of sd_notify, and the pulse of a line that they report.

Each is a datagram to the socket that NOTIFY_SOCKET names; without it nothing is sent.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine

log = logging.getLogger(__name__)

SHARE_OF_WATCHDOG = 3
"""Heartbeats per time that systemd allows."""


class Service:
    """This program as systemd knows it."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        self._place = environment.get("NOTIFY_SOCKET", "")
        self._limit = _watchdog_seconds(environment)

    def ready(self, status: str) -> None:
        """Everything that was asked for is served."""
        self._tell(f"READY=1\nSTATUS={_one_line(status)}")

    def stopping(self) -> None:
        """The end was begun."""
        self._tell("STOPPING=1\nSTATUS=Ending")

    async def watch(self, alive: Callable[[], bool]) -> None:
        """Send heartbeats while `alive` returns True; return immediately without a watchdog."""
        if self._limit is None:
            return
        while True:
            if alive():
                self._tell("WATCHDOG=1")
            else:
                log.error("the line loop hangs: systemd gets no heartbeat")
            await asyncio.sleep(self._limit / SHARE_OF_WATCHDOG)

    @property
    def watchdog(self) -> float | None:
        """Seconds after which systemd ends a program without signs of life; None: it never does."""
        return self._limit

    def _tell(self, text: str) -> None:
        if not self._place:
            return
        # an abstract address begins with a zero, which no variable can hold
        address = f"\0{self._place[1:]}" if self._place.startswith("@") else self._place
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
                sender.connect(address)
                sender.sendall(text.encode())
        except OSError as error:
            log.warning("systemd was not told %r: %s", text, error)


def _watchdog_seconds(environment: Mapping[str, str]) -> float | None:
    """The time that systemd allows between two signs of life, where it watches this process."""
    text, pid = environment.get("WATCHDOG_USEC", ""), environment.get("WATCHDOG_PID", "")
    if not text.isdecimal() or not int(text) or (pid and pid != str(os.getpid())):
        return None
    return int(text) / 1e6


def _one_line(text: str) -> str:
    return " ".join(text.split())


PULSE_INTERVAL = 0.5
STILL_AFTER = 5.0
"""Seconds without a beat after which a line counts as standing still."""


class LinePulse:
    """Beats in the loop of a line; `alive` may be asked in any thread."""

    def __init__(self, line: ModbusLine) -> None:
        self._last = time.monotonic()
        self._worker = line.spawn(self._beat, "pulse")

    @property
    def alive(self) -> bool:
        """True if it beat a moment ago."""
        return not self._worker.done() and time.monotonic() - self._last < STILL_AFTER

    async def _beat(self) -> None:
        while True:
            self._last = time.monotonic()
            await asyncio.sleep(PULSE_INTERVAL)
