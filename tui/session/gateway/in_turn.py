"""Which writes of Modbus TCP clients a stop voids: all before it, whatever they wait for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from tui.bus.api import ModbusLine
from tui.bus.gateway.talk import TcpClient
from tui.bus.stop_counts import next_count


@dataclass(slots=True, eq=False)
class PendingWrite:
    """A write that came from a client and is not answered yet."""

    client: TcpClient
    device: int
    words: Mapping[int, int]
    """Written words, by register."""
    stops: int
    """The device's count of stops when it came: one that comes later voids it."""


class PendingWrites:
    """The writes to the drives of one line in the order in which they came; for one loop."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._pending: list[PendingWrite] = []

    def came(self, client: TcpClient, device: int, words: Mapping[int, int]) -> PendingWrite:
        """A write has come."""
        write = PendingWrite(client, device, words, self._line.facts.stops.stamp(device))
        self._pending.append(write)
        return write

    def ended(self, write: PendingWrite) -> None:
        """It is answered."""
        self._pending.remove(write)

    def stops_by(self, write: PendingWrite) -> None:
        """It has just stopped its drive: what its own client sent behind it means that stop."""
        at = self._pending.index(write)
        for pending_write in self._pending[at:]:
            if pending_write.client is write.client and pending_write.device == write.device:
                pending_write.stops = next_count(pending_write.stops)

    def void(self, write: PendingWrite) -> bool:
        """Return True if its drive was stopped since it came."""
        return write.stops != self._line.facts.stops.stamp(write.device)

    def changes_before(self, write: PendingWrite, registers: Collection[int]) -> bool:
        """Return True if its client has sent a write before it, to one of these registers of its
        drive."""
        before = self._pending[: self._pending.index(write)]
        return any(
            pending_write.client is write.client and pending_write.device == write.device
            and not pending_write.words.keys().isdisjoint(registers)
            for pending_write in before
        )  # fmt: skip
