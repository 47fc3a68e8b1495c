"""Which program may write to which device: until when, and under which count of stops.

The process that holds the line checks it just before the bytes are sent. It does not rely on the
programs, which may hang or have been suspended.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from tui.safety import LEASE_RENEWED_EVERY

from .bounds import MOST_CARE
from .share.messages import AnyMessage, Armed
from .stop_counts import StopCounts

LEASE_ENDED = 0.0
"""The end of a lease that its program has ended."""


@dataclass(frozen=True, slots=True)
class WriteLease:
    """The right of one program to write to one device."""

    stamp: int
    """The count of stops of the device when it was armed."""
    until: float | None = None
    """When it ends (monotonic); None: when the program leaves the line."""
    care: bytes = b""
    """The care for the device: see tui.session.care_data."""

    @property
    def has_ended(self) -> bool:
        """True if its program has ended it."""
        return self.until == LEASE_ENDED


class WriteLeases:
    """The leases of one line: this program's, and in its holder those of all; for any thread."""

    def __init__(self, me: str, stops: StopCounts, tell: Callable[[AnyMessage], None]) -> None:
        self._me = me
        self._stops = stops
        self._tell = tell
        self._leases: Mapping[tuple[str, int], WriteLease] = MappingProxyType({})
        self._lock = threading.Lock()

    # This program's

    def arm(self, device: int, seconds: float | None, care: bytes) -> None:
        """Write to a device for so many seconds; None: until this program leaves the line.

        `care` is how to stop the device, should this program end.
        """
        # the holder's lease ends a moment later: what is refused is refused here, with its reason
        until = None if seconds is None else time.monotonic() + seconds + LEASE_RENEWED_EVERY
        known = care if len(care) <= MOST_CARE else b""
        if not known:
            self.disarm(device)
            self.end(self._me, device)  # or the care of before would count
        lease = WriteLease(self._stops.stamp(device), until, known)
        self._say(device, self.grant(self._me, device, lease))

    def stay_armed(self, device: int, seconds: float | None) -> None:
        """Extend the lease of a device that this program has armed, to so many seconds from now."""
        if seconds is None:
            return
        until, mine = time.monotonic() + seconds + LEASE_RENEWED_EVERY, (self._me, device)
        with self._lock:  # a lease that has just ended stays ended
            lease = self._leases.get(mine)
            if lease is None or not lease.until or until - lease.until < LEASE_RENEWED_EVERY:
                return
            self._leases = MappingProxyType({**self._leases, mine: replace(lease, until=until)})
        self._say(device, WriteLease(lease.stamp, until))

    def disarm(self, device: int) -> None:
        """End this program's lease; the next holder of the line still learns how to stop the
        device."""
        lease = self._leases.get((self._me, device))
        if lease is not None and not lease.has_ended:
            self.grant(self._me, device, replace(lease, until=LEASE_ENDED))
            self._say(device, WriteLease(self._stops.stamp(device), LEASE_ENDED))

    def forget_ended(self, devices: Iterable[int]) -> None:
        """Other programs command these devices, and may know better how to stop them."""
        for device in devices:
            lease = self._leases.get((self._me, device))
            if lease is not None and lease.has_ended:
                self.end(self._me, device)

    def _say(self, device: int, lease: WriteLease) -> None:
        self._tell(Armed(device, lease.stamp, lease.until, lease.care))

    # Of all

    def grant(self, program: str, device: int, lease: WriteLease) -> WriteLease:
        """Let a program write to a device; without `care` that of before stays."""
        with self._lock:
            before = self._leases.get((program, device))
            if before is not None and not lease.care:
                lease = replace(lease, care=before.care)
            self._leases = MappingProxyType({**self._leases, (program, device): lease})
        return lease

    def end(self, program: str, device: int | None = None) -> None:
        """End the leases of a program, of all devices unless one is named."""
        with self._lock:
            rest = {
                key: lease
                for key, lease in self._leases.items()
                if key[0] != program or device not in (None, key[1])
            }
            self._leases = MappingProxyType(rest)

    def of(self, program: str) -> dict[int, WriteLease]:
        """The leases of a program, by device."""
        return {
            device: lease for (owner, device), lease in self._leases.items() if owner == program
        }

    def refusal(self, program: str, device: int) -> str:
        """Why a program may not write to a device now, for a person; empty if it may."""
        lease = self._leases.get((program, device))
        if lease is None:
            return f"Not sent: drive {device} is not armed by this program."
        if lease.stamp != self._stops.stamp(device):
            return f"Not sent: drive {device} was stopped after it was armed."
        if lease.until is not None and time.monotonic() > lease.until:
            return f"Not sent: drive {device} is not armed now."
        if not lease.care:
            return f"Not sent: the holder of the line does not know how to stop drive {device}."
        return ""
