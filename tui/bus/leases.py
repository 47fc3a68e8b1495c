"""Which program may write to which device: until when, and under which count of stops.

The process that holds the line checks it just before the bytes are sent, whatever a program that
hangs, or was suspended, believes of itself.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from .stop_counts import StopCounts


@dataclass(frozen=True, slots=True)
class WriteLease:
    """The right of one program to write to one device."""

    stamp: int
    """The count of stops of the device when it was armed."""
    until: float | None = None
    """When it ends (monotonic); None: when the program leaves the line."""
    care: bytes = b""
    """What stops the device, should the program end: see tui.session.care_data."""


class WriteLeases:
    """The leases of one line; for any thread."""

    def __init__(self, stops: StopCounts) -> None:
        self._stops = stops
        self._leases: Mapping[tuple[str, int], WriteLease] = MappingProxyType({})
        self._lock = threading.Lock()

    def grant(self, program: str, device: int, lease: WriteLease) -> WriteLease:
        """Let a program write to a device; without `care` what it has registered before stays."""
        with self._lock:
            before = self._leases.get((program, device))
            if before is not None and not lease.care:
                lease = replace(lease, care=before.care)
            self._leases = MappingProxyType({**self._leases, (program, device): lease})
        return lease

    def end(self, program: str, device: int | None = None) -> None:
        """Let a program write no more, to any device unless one is named."""
        with self._lock:
            rest = {
                key: one
                for key, one in self._leases.items()
                if key[0] != program or device not in (None, key[1])
            }
            self._leases = MappingProxyType(rest)

    def find(self, program: str, device: int) -> WriteLease | None:
        """The lease of a program for a device."""
        return self._leases.get((program, device))

    def of(self, program: str) -> dict[int, WriteLease]:
        """The leases of a program, by device."""
        return {device: one for (owner, device), one in self._leases.items() if owner == program}

    def refusal(self, program: str, device: int) -> str:
        """Why a program may not write to a device now, for a person; empty if it may."""
        lease = self._leases.get((program, device))
        if lease is None:
            return f"Not sent: drive {device} is not armed by this program."
        if lease.stamp != self._stops.stamp(device):
            return f"Not sent: drive {device} was stopped after it was armed."
        if lease.until is not None and time.monotonic() > lease.until:
            return f"Not sent: drive {device} is not armed any more."
        if not lease.care:
            return f"Not sent: the holder of the line does not know how to stop drive {device}."
        return ""
