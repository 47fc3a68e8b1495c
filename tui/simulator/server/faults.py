"""Line faults on demand: changes of replies in transit. Seeded, so that they can be repeated."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from random import Random

from ..troubles import FaultRates, Habits
from .frames import seal

Sendings = list[tuple[float, bytes]]
"""Bytes sent instead of a reply, each with its delay in s."""

DUPLICATE_AFTER = 0.02
TWIN_AFTER = 0.004
"""Seconds from one reply to that of a second drive at its address."""
WORD_READS = (3, 4, 23)
REPLIED_EXCEPTION = 0x80
MESSAGE_KINDS = frozenset(
    {"late", "lost", "duplicated", "foreign", "twin", "swapped", "exception-0a", "exception-0b"}
)
"""Faults that also apply to Modbus TCP, which has no damaged bytes."""
NO_HABITS = Habits()


class FaultPlan:
    """Plan of faults: decides for each reply which fault applies."""

    def __init__(self, rates: FaultRates, seed: int, habits: Habits = NO_HABITS) -> None:
        self.rates = rates
        self.habits = habits
        self._random = Random(seed)
        self.hits: dict[str, int] = dict.fromkeys(rates.by_kind(), 0)
        self._requests = 0
        self._held: deque[bytes] = deque()
        """Replies held until a later request, on a line that is one behind."""
        self._twins = 0

    def reaches(self) -> bool:
        """True if the next request reaches the drives."""
        self._requests += 1
        return not self.habits.lost_every or self._requests % self.habits.lost_every != 0

    def served(self, unit: int, only: int) -> int | None:
        """Return the address to which a gateway forwards a unit; None if it does not answer the
        unit."""
        if self.habits.only_unit is None:
            return unit
        return only if unit == self.habits.only_unit else None

    def _turn(self, reply: bytes) -> bytes | None:
        """Return the reply sent instead of this one; None for no reply."""
        if not self.habits.behind:
            return reply
        self._held.append(reply)
        return self._held.popleft() if len(self._held) > self.habits.behind else None

    def choose(self) -> str:
        """Return the kind of fault for the next reply; empty for none."""
        drawn = self._random.random()
        for kind, rate in self.rates.by_kind().items():
            if drawn < rate:
                return kind
            drawn -= rate
        return ""

    def carry(self, frame: bytes) -> Sendings:
        """Return the changed RTU reply frame."""
        if (turned := self._turn(frame)) is None:
            return []
        kind = self.choose()
        if not kind:
            return [(0.0, turned)]
        self.hits[kind] += 1
        return _CARRIERS[kind](self, turned)

    def carry_message(self, unit: int, pdu: bytes) -> list[tuple[float, int, bytes]]:
        """Return the changed Modbus TCP reply: delays, units and messages."""
        if (turned := self._turn(pdu)) is None:
            return []
        pdu = turned
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
        if kind == "twin":
            # a gateway forwards the first of two replies, and no damaged one
            return [(0.0, unit, _refusal(pdu, 0x0B) if self._overlaps() else pdu)]
        if kind in _CHANGES:
            return [(0.0, unit, _CHANGES[kind](pdu))]
        return [(0.0, unit, pdu)]

    def lateness(self) -> float:
        """Return the extra delay of a late reply, in s."""
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

    def _overlaps(self) -> bool:
        """Return True if two drives at one address send at once: every second time."""
        self._twins += 1
        return bool(self._twins % 2)

    def _twin(self, frame: bytes) -> Sendings:
        other = bytearray(frame[:-2])
        if frame[1] in WORD_READS:
            other[-1] ^= 1  # its values differ
        second = seal(bytes(other))
        if not self._overlaps():
            return [(0.0, frame), (TWIN_AFTER, second)]
        # both share the pair of wires: a zero of either dominates
        shifted = frame[:1] + bytes(a & b for a, b in zip(frame[1:], second, strict=False))
        return [(0.0, shifted + second[-1:])]

    def _changed(self, kind: str, frame: bytes) -> Sendings:
        return [(0.0, seal(frame[:1] + _CHANGES[kind](frame[1:-2])))]

    def _swapped(self, frame: bytes) -> Sendings:
        return self._changed("swapped", frame)

    def _no_path(self, frame: bytes) -> Sendings:
        return self._changed("exception-0a", frame)

    def _no_target(self, frame: bytes) -> Sendings:
        return self._changed("exception-0b", frame)


def _refusal(pdu: bytes, code: int) -> bytes:
    return bytes([pdu[0] | REPLIED_EXCEPTION, code])


def _swap(pdu: bytes) -> bytes:
    if pdu[0] not in WORD_READS:
        return pdu
    words = bytearray(pdu[2:])
    words[0::2], words[1::2] = words[1::2], words[0::2]
    return pdu[:2] + bytes(words)


_CHANGES: Mapping[str, Callable[[bytes], bytes]] = {
    "swapped": _swap,
    "exception-0a": lambda pdu: _refusal(pdu, 0x0A),
    "exception-0b": lambda pdu: _refusal(pdu, 0x0B),
}
_CARRIERS: Mapping[str, Callable[[FaultPlan, bytes], Sendings]] = {
    "late": FaultPlan._late,
    "lost": FaultPlan._lost,
    "duplicated": FaultPlan._duplicated,
    "truncated": FaultPlan._truncated,
    "corrupted": FaultPlan._corrupted,
    "noise": FaultPlan._noise,
    "foreign": FaultPlan._foreign,
    "twin": FaultPlan._twin,
    "swapped": FaultPlan._swapped,
    "exception-0a": FaultPlan._no_path,
    "exception-0b": FaultPlan._no_target,
}
