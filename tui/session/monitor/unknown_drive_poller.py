"""Keep-alive reads for drives that answered but match no profile.

Their communication timeout is not known, so a short one is assumed.
"""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from functools import partial

from tui.bus.api import LineWorker, ModbusLine
from tui.bus.errors import LineClosed
from tui.bus.keep_alive import KeepAlive
from tui.drive.finding import presence_probes

from ..connect.address_prober import known_profiles
from ..read.presence import UNKNOWN_TIMEOUT


class UnknownDrivePoller:
    """Keeps unknown drives alive with the read that finds drives; a refusal is enough too."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._changing = threading.RLock()
        self._workers: dict[int, LineWorker] = {}

    def keep(self, device: int) -> None:
        """Keep a drive alive until `let_go` or `stop`."""
        self.let_go(device)
        work = partial(self._begin, device)
        # a closed line sends no keep-alive reads; the work waits until its worker is noted
        with suppress(LineClosed), self._changing:
            self._workers[device] = self._line.spawn(work, f"stranger {device}")

    def let_go(self, device: int) -> None:
        """Stop keeping a drive alive, for example because its profile is known now."""
        with self._changing:
            if (worker := self._workers.pop(device, None)) is not None:
                worker.cancel()
                self._line.facts.keep_alives.let_go(device)

    def stop(self) -> None:
        """Stop keeping all of them alive."""
        for device in tuple(self._workers):
            self.let_go(device)

    async def _begin(self, device: int) -> None:
        probe = presence_probes(await asyncio.to_thread(known_profiles))[0]
        if probe.register is None:
            alive = KeepAlive(device, UNKNOWN_TIMEOUT, function=43)
        else:
            alive = KeepAlive(device, UNKNOWN_TIMEOUT, probe.register)
        with self._changing:
            if device in self._workers:
                self._line.facts.keep_alives.keep(alive)
