"""How many stops each device was given, by which program; two tellings of one stop count once.

A write carries the count that its program knew of: one that is older than a stop does not go out.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable, Mapping
from types import MappingProxyType

GivenStops = Mapping[int, Mapping[str, int]]
"""Counts of stops, by device and program."""

STOPS_KEPT = 600.0
"""Seconds for which the next owner of a line is told when a device was stopped."""
GIVEN_BY_NOBODY = ""
"""Under which the stops of programs are counted that have left."""


class StopCounts:
    """The stops of one line, as one program knows them; for any thread.

    Each program counts its own, so that those of two that could not hear each other add up.
    """

    def __init__(self) -> None:
        self.totals: Mapping[int, int] = MappingProxyType({})
        """How many stops each device was given, by all programs."""
        self.given: GivenStops = MappingProxyType({})
        self.by: Mapping[int, str] = MappingProxyType({})
        """Who gave the last one of each device, as people are told."""
        self.times: Mapping[int, float] = MappingProxyType({})
        """When the last one of each device was given (monotonic), by whichever program."""
        self._lock = threading.RLock()

    def stamp(self, device: int) -> int:
        """The count that a write to a device goes by; a broadcast goes by those of all."""
        return self.totals.get(device, 0) if device else sum(self.totals.values())

    def of(self, program: str, devices: Iterable[int]) -> tuple[int, ...]:
        """How often a program has stopped each device."""
        return tuple(self.given.get(device, {}).get(program, 0) for device in devices)

    def give(self, program: str, devices: tuple[int, ...], by: str) -> None:
        """A program stops devices now."""
        with self._lock:
            counts = tuple(count + 1 for count in self.of(program, devices))
            self.note(program, devices, counts, by)

    def note(
        self,
        program: str,
        devices: tuple[int, ...],
        counts: tuple[int, ...],
        by: str,
        when: float | None = None,
    ) -> tuple[int, ...]:
        """A program has stopped devices, each for so many times by now, the last time at `when`.

        Returns the devices of which this is news.
        """
        with self._lock:
            self.by = MappingProxyType({**self.by, **dict.fromkeys(devices, by)})
            news = self.learn(
                {one: {program: count} for one, count in zip(devices, counts, strict=False)}
            )
            self.learn_times(dict.fromkeys(news, when or time.monotonic()))
            return news

    def learn_times(self, told: Mapping[int, float]) -> None:
        """Take over when devices were stopped; a time to come is of an earlier run of the machine.

        It decides about commands that were typed before a stop and came to the line after it.
        """
        now = time.monotonic()
        with self._lock:
            known = dict(self.times)
            for device, when in told.items():
                if when <= now:
                    known[device] = max(when, known.get(device, when))
            self.times = MappingProxyType(known)

    @property
    def plain(self) -> dict[int, dict[str, int]]:
        """The counts as they are told to others."""
        return {device: dict(counts) for device, counts in self.given.items()}

    @property
    def late_times(self) -> dict[int, float]:
        """When devices were stopped of late."""
        since = time.monotonic() - STOPS_KEPT
        return {device: when for device, when in self.times.items() if when > since}

    def learn(self, told: GivenStops) -> tuple[int, ...]:
        """Take over counts that are higher than those known; returns the devices of which some are.

        A count never goes down: that would let a write through that a stop has voided.
        """
        with self._lock:
            most = {device: dict(counts) for device, counts in self.given.items()}
            for device, counts in told.items():
                known = most.setdefault(device, {})
                for program, count in counts.items():
                    known[program] = max(known.get(program, 0), count)
            return self._put(most)

    def replace(self, told: GivenStops, me: str) -> tuple[int, ...]:
        """Take over the counts of the line's owner, but for those of this program itself.

        Returns the devices of which stops are told that were not known.
        """
        with self._lock:
            own = {
                device: {me: counts[me]} for device, counts in self.given.items() if me in counts
            }
            before, self.given = self.totals, MappingProxyType(told)
            self.learn(own)
            return tuple(one for one, n in self.totals.items() if n > before.get(one, 0))

    def fold(self, program: str) -> None:
        """A program has left: its stops count on without its name."""
        with self._lock:
            folded: dict[int, dict[str, int]] = {}
            for device, counts in self.given.items():
                rest = {one: count for one, count in counts.items() if one != program}
                if program in counts:
                    rest[GIVEN_BY_NOBODY] = rest.get(GIVEN_BY_NOBODY, 0) + counts[program]
                folded[device] = rest
            self._put(folded)

    def _put(self, given: Mapping[int, Mapping[str, int]]) -> tuple[int, ...]:
        before = self.totals
        self.given = MappingProxyType(dict(given))
        self.totals = MappingProxyType({one: sum(of.values()) for one, of in given.items()})
        return tuple(one for one, n in self.totals.items() if n > before.get(one, 0))
