"""Line faults on demand: what becomes of a reply on its way. Seeded, so they can be repeated."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from random import Random

from ..spec import FaultRates
from .frames import seal

Sendings = list[tuple[float, bytes]]
"""What is put on the wire instead of a reply: delays in s, and bytes."""

DUPLICATE_AFTER = 0.02
MESSAGE_KINDS = frozenset({"late", "lost", "duplicated", "foreign"})
"""Faults that can hit a message of Modbus TCP too, which has no broken bytes."""


class FaultPlan:
    """Decides, reply by reply, which fault hits it."""

    def __init__(self, rates: FaultRates, seed: int) -> None:
        self.rates = rates
        self._random = Random(seed)
        self.hits: dict[str, int] = dict.fromkeys(rates.by_kind(), 0)

    def choose(self) -> str:
        """The kind of fault for the next reply; empty for none."""
        drawn = self._random.random()
        for kind, rate in self.rates.by_kind().items():
            if drawn < rate:
                return kind
            drawn -= rate
        return ""

    def carry(self, frame: bytes) -> Sendings:
        """What becomes of an RTU reply frame."""
        kind = self.choose()
        if not kind:
            return [(0.0, frame)]
        self.hits[kind] += 1
        return _CARRIERS[kind](self, frame)

    def carry_message(self, unit: int, pdu: bytes) -> list[tuple[float, int, bytes]]:
        """What becomes of a Modbus TCP reply: delays, units and messages."""
        kind = self.choose()
        if kind in MESSAGE_KINDS:
            self.hits[kind] += 1
        if kind == "late":
            return [(self.lateness(), unit, pdu)]
        if kind == "lost":
            return []
        if kind == "duplicated":
            return [(0.0, unit, pdu), (DUPLICATE_AFTER, unit, pdu)]
        if kind == "foreign":
            return [(0.0, self._other_unit(unit), pdu)]
        return [(0.0, unit, pdu)]

    def lateness(self) -> float:
        """Extra delay of a late reply, in s."""
        return self._random.uniform(*self.rates.late_by)

    def _other_unit(self, unit: int) -> int:
        return self._random.choice([u for u in range(1, 248) if u != unit])

    def _late(self, frame: bytes) -> Sendings:
        return [(self.lateness(), frame)]

    def _lost(self, frame: bytes) -> Sendings:
        return []

    def _duplicated(self, frame: bytes) -> Sendings:
        return [(0.0, frame), (DUPLICATE_AFTER, frame)]

    def _truncated(self, frame: bytes) -> Sendings:
        return [(0.0, frame[: self._random.randrange(1, len(frame))])]

    def _corrupted(self, frame: bytes) -> Sendings:
        place = self._random.randrange(len(frame))
        broken = bytearray(frame)
        broken[place] ^= 1 << self._random.randrange(8)
        return [(0.0, bytes(broken))]

    def _noise(self, frame: bytes) -> Sendings:
        return [(0.0, self._random.randbytes(self._random.randrange(1, 4)) + frame)]

    def _foreign(self, frame: bytes) -> Sendings:
        body = bytes([self._other_unit(frame[0])]) + frame[1:-2]
        return [(0.0, seal(body))]


_CARRIERS: Mapping[str, Callable[[FaultPlan, bytes], Sendings]] = {
    "late": FaultPlan._late,
    "lost": FaultPlan._lost,
    "duplicated": FaultPlan._duplicated,
    "truncated": FaultPlan._truncated,
    "corrupted": FaultPlan._corrupted,
    "noise": FaultPlan._noise,
    "foreign": FaultPlan._foreign,
}
