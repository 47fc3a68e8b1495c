"""Running counts of a line and of each of its devices, and their frozen copies for others."""

from __future__ import annotations

import time
from bisect import bisect_left
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from .model import TURNAROUND_EDGES, DeviceCounters, LastMinute, LineCounters
from .program_use import ProgramUse

BUCKET, BUCKETS = 5.0, 12
"""Seconds of one bucket, and how many of them are kept: the last 55 to 60 s."""
_KINDS = LastMinute.__slots__
_PLACES = {kind: place for place, kind in enumerate(_KINDS)}


class MinuteWindow:
    """Counted in the line's loop, read from any thread: the buckets are replaced as a whole."""

    __slots__ = ("_buckets", "_copied", "_summed")

    def __init__(self, copied: LastMinute | None = None) -> None:
        self._buckets: tuple[tuple[int, tuple[int, ...]], ...] = ()
        self._copied = copied
        """Counts of the program that owns the line; None if this one counts."""
        self._summed: tuple[object, int, LastMinute] = (None, 0, LastMinute())
        """The last sum with its buckets and its time: it is read more often than it changes."""

    def count(self, kind: str, now: float, number: int = 1) -> None:
        """Count so many of a field of LastMinute; a negative number corrects an earlier count."""
        newest = int(now // BUCKET)
        kept = [bucket for bucket in self._buckets if newest - BUCKETS < bucket[0] <= newest]
        counts = [0] * len(_KINDS)
        if kept and kept[-1][0] == newest:
            counts = list(kept.pop()[1])
        counts[_PLACES[kind]] += number
        self._buckets, self._copied = (*kept, (newest, tuple(counts))), None

    def total(self, now: float) -> LastMinute:
        """The counts of the last minute."""
        if self._copied is not None:
            return self._copied
        buckets, newest = self._buckets, int(now // BUCKET)
        of, then, total = self._summed
        if of is buckets and then == newest:
            return total
        counted = [counts for bucket, counts in buckets if bucket > newest - BUCKETS]
        # a correction may be kept for longer than the count
        total = LastMinute(*(max(0, sum(pair)) for pair in zip(*counted, strict=True)))
        self._summed = (buckets, newest, total)
        return total


_OF_SEVERAL = ("devices", "programs", "minute")
_PLAIN = tuple(name for name in LineCounters.__slots__ if name not in _OF_SEVERAL)
_PLAIN_OF_DEVICE = tuple(name for name in DeviceCounters.__slots__ if name != "minute")


@dataclass(slots=True)
class DeviceTally:
    """Counts of one device that the line's thread adds to; fields as in DeviceCounters."""

    requests: int = 0
    replies: int = 0
    timeouts: int = 0
    checksum: int = 0
    wrong: int = 0
    repeats: int = 0
    exceptions: Mapping[int, int] = field(default_factory=dict)
    bytes_out: int = 0
    bytes_in: int = 0
    busy_seconds: float = 0.0
    turnarounds: tuple[int, ...] = (0,) * (len(TURNAROUND_EDGES) + 1)
    minute: MinuteWindow = field(default_factory=MinuteWindow)
    missed: int = 0
    """Requests of the last minute's counts that it did not answer since its last reply."""

    def count_reply(self, turnaround: float) -> None:
        """Count a valid reply and its turnaround in seconds."""
        self.replies += 1
        bars = list(self.turnarounds)
        bars[bisect_left(TURNAROUND_EDGES, turnaround)] += 1
        self.turnarounds = tuple(bars)

    def count_exception(self, code: int) -> None:
        """Count a refusal. The mapping is replaced: another thread may be reading it."""
        self.exceptions = {**self.exceptions, code: self.exceptions.get(code, 0) + 1}

    def frozen(self, now: float) -> DeviceCounters:
        """The counts of this moment."""
        plain = {n: getattr(self, n) for n in _PLAIN_OF_DEVICE}
        return DeviceCounters(**plain, minute=self.minute.total(now))


@dataclass(slots=True)
class Tally:
    """Counts that the line's thread adds to; fields as in LineCounters."""

    requests: int = 0
    replies: int = 0
    timeouts: int = 0
    searched: int = 0
    checksum: int = 0
    wrong: int = 0
    exceptions: int = 0
    resyncs: int = 0
    stale: int = 0
    bytes_out: int = 0
    bytes_in: int = 0
    busy_seconds: float = 0.0
    framing: int = 0
    parity: int = 0
    breaks: int = 0
    overruns: int = 0
    repeats: int = 0
    devices: dict[int, DeviceTally] = field(default_factory=dict)
    use: ProgramUse = field(default_factory=ProgramUse)
    shares: dict[str, float] = field(default_factory=dict)
    """The share of each program, from the program that owns the line."""
    clock: Callable[[], float] = time.monotonic
    minute: MinuteWindow = field(default_factory=MinuteWindow)

    def of(self, device: int) -> DeviceTally:
        """The counts of a device; in the line's thread only."""
        return self.devices.get(device) or self.devices.setdefault(device, DeviceTally())

    def count_sent(self, device: int, size: int) -> None:
        """Count a frame sent to a device."""
        tally = self.of(device)
        self.requests += 1
        self.bytes_out += size
        tally.requests += 1
        tally.bytes_out += size

    def count_end(self, device: int, seconds: float, received: int) -> None:
        """Count the time and bytes of an exchange; the line's own bytes were counted on arrival."""
        tally = self.of(device)
        self.busy_seconds += seconds
        tally.busy_seconds += seconds
        tally.bytes_in += received

    def count_reply(self, device: int, turnaround: float) -> None:
        """Count a valid reply, or a refusal."""
        self.replies += 1
        self.of(device).count_reply(turnaround)

    def count_exception(self, device: int, code: int) -> None:
        """That reply was a refusal."""
        self.exceptions += 1
        self.of(device).count_exception(code)

    def count_checksum(self, device: int) -> None:
        self.checksum += 1
        self.of(device).checksum += 1

    def count_wrong(self, device: int) -> None:
        """Count a reply that does not belong to the request."""
        self.wrong += 1
        self.of(device).wrong += 1

    def count_repeat(self, device: int) -> None:
        self.repeats += 1
        self.of(device).repeats += 1

    def count_silence(self, device: int, *, searched: bool) -> None:
        """Count a missing reply; in a search, an address without a device is not a fault of the
        line."""
        if searched:
            self.searched += 1
        else:
            self.timeouts += 1
            self.of(device).missed += 1
            self.of(device).minute.count("silent", self.clock())
        self.of(device).timeouts += 1

    def count_minute(self, device: int | None, kind: str) -> None:
        """Count a reply of the last minute by its field of LastMinute; of a device, or of none."""
        now = self.clock()
        self.minute.count(kind, now)
        if device is not None:
            self.of(device).minute.count(kind, now)

    def count_good(self, device: int, *, was_heard: bool) -> None:
        """It answers: its misses before are lost replies of the line, unless it was away."""
        own, now = self.of(device), self.clock()
        if own.missed and was_heard:
            self.minute.count("lost", now, own.missed)
            own.minute.count("lost", now, own.missed)
            own.minute.count("silent", now, -own.missed)
        own.missed = 0
        self.count_minute(device, "good")

    def copy(self, counters: LineCounters, devices: Mapping[int, DeviceCounters]) -> None:
        """Take over the counts of the program that owns the line, of devices those that changed."""
        for name in _PLAIN:
            setattr(self, name, getattr(counters, name))
        self.shares = dict(counters.programs)
        self.minute = MinuteWindow(counters.minute)
        for device, device_counters in devices.items():
            plain = {n: getattr(device_counters, n) for n in _PLAIN_OF_DEVICE}
            self.devices[device] = DeviceTally(**plain, minute=MinuteWindow(device_counters.minute))

    def frozen(self) -> LineCounters:
        """The counts of this moment, of each device too."""
        # copy() runs without giving up the interpreter, so no device comes in between
        each, now = self.devices.copy(), self.clock()
        found = {device: tally.frozen(now) for device, tally in each.items()}
        plain = {name: getattr(self, name) for name in _PLAIN}
        shares, minute = self.use.shares or self.shares, self.minute.total(now)
        return LineCounters(**plain, devices=found, programs=shares, minute=minute)
