"""Client that commands a drive, and the effect of other programs' stops on clients."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Any

from tui.bus.api import ModbusLine
from tui.bus.errors import LineClosed
from tui.bus.line_events import ControlDenied, ControlRequested, DevicesStopped, LineEvent
from tui.bus.program import Program

from ..clock import REAL_CLOCK
from .started import StartedMotors

log = logging.getLogger(__name__)

STOPPED_ELSEWHERE = (
    "was stopped by another program: a client must send a stop before it can command the drive"
)


class GatewayCommanding:
    """Drives of one line that clients command; for any thread.

    A client that repeats its words would restart a motor that a person has just stopped. So after
    such a stop, commands of clients are refused until a client has sent a stop word itself, as a
    controller does that has seen the standstill. After a stop by another client, each client that
    has commanded the drive must send its own.
    """

    def __init__(
        self,
        line: ModbusLine,
        stands: Callable[[int], Coroutine[Any, Any, bool]],
        started: StartedMotors,
    ) -> None:
        self._started = started
        self._line = line
        self._stands = stands
        self._lock = threading.Lock()
        self._by: dict[int, str] = {}
        """The client that commands, by device."""
        self._stopped: dict[int, str] = {}
        """Source of a stop by another program since the last stop of a client, by device."""
        self._signs: dict[int, float] = {}
        """Time of the last request of the client that commands, by device (monotonic)."""
        self._commanded: dict[int, set[str]] = {}
        """The clients that have commanded each device since it was stopped."""
        self._barred: dict[tuple[int, str], str] = {}
        """Source of a stop by another client, by device and by the client that must stop first."""
        self._unsubscribe = line.facts.events.subscribe(self._hear)

    def close(self) -> None:
        """End the subscription, and release all drives."""
        self._unsubscribe()
        with self._lock:
            devices = list(self._by)
        for device in devices:
            self._release(device)

    def claim(self, device: int, client: str) -> str:
        """Make a client the commander of a drive; return why not, or an empty string."""
        with self._lock:
            by = self._stopped.get(device) or self._barred.get((device, client))
        if by is not None:
            return f"Drive {device} {STOPPED_ELSEWHERE} ({by})."
        if why := self._line.facts.claim(device):
            return why
        with self._lock:
            before, self._by[device] = self._by.get(device), client
            self._signs[device] = REAL_CLOCK.monotonic()
            self._commanded.setdefault(device, set()).add(client)
        if before not in (None, client):
            text = f"Modbus TCP client {client} now commands this drive, instead of {before}."
            log.warning("drive %s: %s", device, text)
            self._line.facts.tell_all(device, text)
        return ""

    def heard(self, device: int, client: str) -> None:
        """Note the time of a request, if its client commands the drive."""
        with self._lock:
            if self._by.get(device) == client:
                self._signs[device] = REAL_CLOCK.monotonic()

    def last_sign(self, device: int) -> float:
        """Return the time of the commander's last request (monotonic); -inf if there was none."""
        with self._lock:
            return self._signs.get(device, -math.inf)

    def stop(self, device: int, client: str) -> None:
        """Cancel earlier commands of all programs and release the drive, for a client's stop."""
        self._line.facts.give_stop([device], f"Modbus TCP client {client}")
        with self._lock:
            self._stopped.pop(device, None)
            self._barred.pop((device, client), None)
            for other in self._commanded.pop(device, set()) - {client}:
                self._barred[device, other] = f"Modbus TCP client {client}"
        self._release(device)
        self._started.stopped(device)

    def stopped_too(self, device: int, client: str) -> None:
        """Accept commands of a client again after its stop, even if an equal one was sent."""
        with self._lock:
            self._barred.pop((device, client), None)

    def gone(self, client: str) -> None:
        """Release the drives of a client that has closed its connection."""
        with self._lock:
            left = [device for device, by in self._by.items() if by == client]
            for clients in self._commanded.values():
                clients.discard(client)
            for barred in [pair for pair in self._barred if pair[1] == client]:
                del self._barred[barred]
        for device in left:
            self._release(device)
            text = (
                f"Modbus TCP client {client}, which commanded this drive, has disconnected. The"
                " motor follows the last command."
            )
            log.warning("drive %s: %s", device, text)
            self._line.facts.tell_all(device, text)

    def _release(self, device: int) -> None:
        with self._lock:
            self._by.pop(device, None)
        self._line.facts.release(device)

    def _hear(self, event: LineEvent) -> None:
        match event:
            case DevicesStopped(devices, by, program):
                for device in devices:
                    with self._lock:
                        self._stopped[device] = f"{by}, {program.text}"
                    self._release(device)
            case ControlDenied(device, why):
                self._denied(device, why)
            case ControlRequested(device, program):
                self._requested(device, program)

    def _denied(self, device: int, why: str) -> None:
        log.warning("%s", why)
        with self._lock:
            self._by.pop(device, None)

    def _requested(self, device: int, program: Program) -> None:
        """Give a drive to a program that requests it, if the motor is at standstill.

        Called in the line's thread.
        """
        with suppress(LineClosed):
            self._line.spawn(lambda: self._decide(device, program), f"question about {device}")

    async def _decide(self, device: int, program: Program) -> None:
        yes = await self._stands(device)
        if yes:
            with self._lock:
                self._by.pop(device, None)
            self._started.given(device)
        self._line.facts.answer(device, program.id, yes=yes)
