"""Which devices the holder of a line keeps from their communication timeout, for which programs.

The holder reads such a device if no program has had a reply of it for a while. So a program that
is busy for a moment loses no drive. When the program leaves the line, in whatever way, the reads
for it end.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from .bounds import MOST_DEVICES, MonotonicTime, RegisterAddress
from .coils import read_request
from .requests import Identify, Request

SHORTEST_TIMEOUT, LONGEST_TIMEOUT = 0.08, 1e6
"""Seconds of a timeout that is kept; a line could not keep a shorter one."""
MOST_WORDS = 125
"""Registers of one read."""


class KeepAlive(msgspec.Struct, frozen=True, tag=True):
    """A program has a device kept alive while it is on the line."""

    device: Annotated[int, Meta(ge=1, lt=MOST_DEVICES)]
    timeout: Annotated[float, Meta(ge=SHORTEST_TIMEOUT, le=LONGEST_TIMEOUT)]
    """Its communication timeout in seconds."""
    address: RegisterAddress = 0
    count: Annotated[int, Meta(ge=1, le=MOST_WORDS)] = 1
    function: Literal[1, 2, 3, 4, 43] = 3
    """1 and 2 read coils and inputs, 3 and 4 registers; 43 reads the identification."""
    until: MonotonicTime | None = None
    """Not beyond this time (monotonic); 0 ends it."""

    @property
    def request(self) -> Request:
        """The read that keeps it alive."""
        if self.function == Identify.function:
            return Identify(self.device)
        return read_request(self.device, self.address, self.count, self.function)


class KeepAlives:
    """Those of one line: this program's, and in its holder those of all; for any thread."""

    def __init__(self, me: str, tell: Callable[[KeepAlive], None]) -> None:
        self._me = me
        self._tell = tell
        self.kept: Mapping[tuple[str, int], KeepAlive] = MappingProxyType({})
        """By program and device; replaced as a whole."""
        self.changed: Callable[[], None] = lambda: None
        """Called after each change."""
        self._lock = threading.RLock()

    # This program's

    def keep(self, wanted: KeepAlive, seconds: float | None = None) -> None:
        """Have a device kept alive for so many seconds; None: until this program leaves."""
        until = None if seconds is None else time.monotonic() + seconds
        timeout = min(max(wanted.timeout, SHORTEST_TIMEOUT), LONGEST_TIMEOUT)
        alive = msgspec.structs.replace(wanted, timeout=timeout, until=until)
        if self.kept.get((self._me, alive.device)) != alive:
            self._say(alive)

    def let_go(self, device: int) -> None:
        """End the keep-alive reads of a device for this program."""
        if (alive := self.kept.get((self._me, device))) is not None:
            self._say(msgspec.structs.replace(alive, until=0.0))

    def _say(self, alive: KeepAlive) -> None:
        self.hear(self._me, alive)
        self._tell(alive)

    # Of all

    def hear(self, program: str, alive: KeepAlive) -> None:
        """Note that a program wants a device kept alive, or no longer."""
        with self._lock:
            kept = {key: each for key, each in self.kept.items() if key != (program, alive.device)}
            if alive.until != 0.0:
                kept[program, alive.device] = alive
            self.kept = MappingProxyType(kept)
        self.changed()

    def end(self, program: str) -> None:
        """Forget the devices of a program that has left the line."""
        with self._lock:
            rest = {key: alive for key, alive in self.kept.items() if key[0] != program}
            self.kept = MappingProxyType(rest)

    def of(self, program: str) -> list[KeepAlive]:
        """Those of one program."""
        return [alive for (owner, _), alive in self.kept.items() if owner == program]
