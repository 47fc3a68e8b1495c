"""Master that polls simulated drives as a PLC does, and a port on which both can be monitored."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from contextlib import suppress

from tui.drive.profile.profile import Profile

from .errors import SimulatorError
from .server.conversation import RtuConversation
from .server.faults import FaultPlan
from .server.frames import seal
from .simulation import Simulation
from .troubles import FaultRates

_PAUSE = 0.02
"""Seconds between an answer and the next request."""
_ANSWER_WITHIN = 0.2
"""Seconds after which the master continues without an answer."""
_STEP = 0.001
_POLLED = ("status_word", "output_frequency", "motor_current")
"""Quantities that the master reads, one by one, as many PLC programs do."""
_GIVEN = ("frequency_reference", "command_frequency")
"""Quantities of which it writes the first writable one: 0, which moves nothing."""


class PlcOnLine:
    """Traffic of a master on a simulated line, for a listener; it begins with `start`.

    `requests` are frames without checksum, sent one after the other in a cycle. POSIX only: raises
    SimulatorError if there are no pseudo-terminals.
    """

    def __init__(
        self, simulation: Simulation, requests: Sequence[bytes], pause: float = _PAUSE
    ) -> None:
        if os.name != "posix":
            raise SimulatorError("This system has no pseudo-terminals to listen to.")
        self._conversation = RtuConversation(simulation.line, FaultPlan(FaultRates(), 0))
        self._requests = [seal(request) for request in requests]
        self._pause = pause
        import tty

        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self.path = os.ttyname(self._theirs)
        """Path of the port to monitor."""
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._work, name="simulated master", daemon=True)
        self._simulation = simulation

    def start(self) -> None:
        """Start polling."""
        self._simulation.start()
        self._thread.start()

    def stop(self) -> None:
        """End the traffic and remove the port; may be called twice."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        for descriptor in (self._ours, self._theirs):
            if descriptor >= 0:
                os.close(descriptor)
        self._ours = self._theirs = -1

    def _work(self) -> None:
        while not self._stopping.is_set():
            for request in self._requests:
                self._ask(request)
                if self._stopping.wait(self._pause):
                    return

    def _ask(self, request: bytes) -> None:
        """Make one exchange, visible at the port byte by byte."""
        self._say(request)
        requested = time.monotonic()
        self._conversation.feed(request, requested)
        answered = False
        while not self._stopping.wait(_STEP):
            now = time.monotonic()
            if reply := self._conversation.poll(now):
                self._say(reply)
                answered = True
            if answered and self._conversation.due is None:
                return
            if not answered and now - requested > _ANSWER_WITHIN:
                return

    def _say(self, data: bytes) -> None:
        with suppress(BlockingIOError):  # no program reads the port
            os.write(self._ours, data)


def plc_cycle(drives: Sequence[tuple[int, Profile]]) -> list[bytes]:
    """Return a typical cycle over drives by address: identity, single reads, a reference of 0."""
    found = []
    for address, profile in drives:
        if profile.function(43):
            found.append(bytes([address, 43, 14, 1, 0]))
        requested = [profile.quantity(text) for text in _POLLED]  # type: ignore[arg-type]
        found += [
            bytes([address, parameter.function, *parameter.address.to_bytes(2, "big"), 0, 1])
            for parameter in requested
            if parameter is not None
        ]
        given = [profile.quantity(text) for text in _GIVEN]  # type: ignore[arg-type]
        written = next(
            (parameter for parameter in given if parameter is not None and "w" in parameter.access),
            None,
        )
        if written is not None:
            found.append(bytes([address, 6, *written.address.to_bytes(2, "big"), 0, 0]))
    return found
