"""Stops given to each device, by program; a stop reported twice counts once.

A write carries the count that its program knew of: one that is older than a stop does not go out.
Counts wrap: no number that another program sends keeps a later stop from changing the total.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType

from tui.safety import STOPS_KEPT

from .bounds import MOST_STOPPERS, STOPS_WRAP

GivenStops = Mapping[int, Mapping[str, int]]
"""Counts of stops, by device and program."""

GIVEN_BY_NOBODY = ""
"""Under which the stops of programs are counted that have left."""


def next_count(count: int) -> int:
    """The count after one more stop."""
    return (count + 1) % STOPS_WRAP


def is_newer(count: int, than: int) -> bool:
    """True if a count is ahead of another by less than half of all counts."""
    return 0 < (count - than) % STOPS_WRAP < STOPS_WRAP // 2


class StopCounts:
    """The stops of one line, as one program knows them; for any thread.

    Each program counts its own stops, so that stops of two disconnected programs add up.
    """

    def __init__(self) -> None:
        self.totals: Mapping[int, int] = MappingProxyType({})
        """Stops given to each device, by all programs."""
        self.given: GivenStops = MappingProxyType({})
        self.by: Mapping[int, str] = MappingProxyType({})
        """Name of the program of each device's last stop."""
        self.times: Mapping[int, float] = MappingProxyType({})
        """When the last one of each device was given (monotonic), by whichever program."""
        self._lock = threading.RLock()

    def stamp(self, device: int) -> int:
        """The count that a write to a device carries; for a broadcast, that of all devices."""
        if device:
            return self.totals.get(device, 0)
        return sum(self.totals.values()) % STOPS_WRAP

    def of(self, program: str, devices: Iterable[int]) -> tuple[int, ...]:
        """Return how often a program has stopped each device."""
        return tuple(self.given.get(device, {}).get(program, 0) for device in devices)

    def give(self, program: str, devices: tuple[int, ...], by: str) -> None:
        """A program stops devices now."""
        with self._lock:
            counts = tuple(map(next_count, self.of(program, devices)))
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
                {number: {program: count} for number, count in zip(devices, counts, strict=False)}
            )
            self.learn_times(dict.fromkeys(news, when or time.monotonic()))
            return news

    def learn_times(self, reported: Mapping[int, float]) -> None:
        """Take over when devices were stopped; a future time is from before a restart of the
        computer.

        Commands that were typed before a stop and reach the line after it are refused by these
        times.
        """
        now = time.monotonic()
        with self._lock:
            known = dict(self.times)
            for device, when in reported.items():
                if when <= now:
                    known[device] = max(when, known.get(device, when))
            self.times = MappingProxyType(known)

    @property
    def plain(self) -> dict[int, dict[str, int]]:
        """The counts as they are sent to others."""
        return {device: dict(counts) for device, counts in self.given.items()}

    @property
    def late_times(self) -> dict[int, float]:
        """When devices were stopped recently."""
        since = time.monotonic() - STOPS_KEPT
        return {device: when for device, when in self.times.items() if when > since}

    def learn(self, reported: GivenStops) -> tuple[int, ...]:
        """Take over counts that are higher than the known ones; returns the devices of these.

        A count never decreases: that would let a write through that a stop has canceled.
        """
        with self._lock:
            most = {device: dict(counts) for device, counts in self.given.items()}
            for device, counts in reported.items():
                known = most.setdefault(device, {})
                for program, count in counts.items():
                    if is_newer(count, known.get(program, 0)):
                        known[program] = count
            return self._put(most)

    def learn_greeting(
        self, program: str, greeting: GivenStops, present: Collection[str]
    ) -> tuple[int, ...]:
        """Take over the counts that a program sends as it attaches; returns as `learn` does.

        Its own count is the one that it sends: what others added to it before stays in the total,
        so that its next stop is news. Programs that are `present` send their own counts.
        """
        with self._lock:
            given = {device: dict(counts) for device, counts in self.given.items()}
            corrected = []
            for device, counts in given.items():
                own = greeting.get(device, {}).get(program, 0)
                if program in counts and is_newer(known := counts[program], own):
                    counts[program] = own
                    _add(counts, GIVEN_BY_NOBODY, known - own)
                    corrected.append(device)
            self._put(given)
            others = set(present) - {program}
            news = self.learn(
                {
                    device: {text: count for text, count in counts.items() if text not in others}
                    for device, counts in greeting.items()
                }
            )
            crowded = [counts for counts in self.given.values() if len(counts) > MOST_STOPPERS // 2]
            self.fold(set().union(*crowded) - {program, GIVEN_BY_NOBODY, *present})
            return tuple({*news, *corrected})

    def replace(self, reported: GivenStops, me: str) -> tuple[int, ...]:
        """Take over the counts of the line's owner, but for those of this program itself.

        Returns the devices with stops that were not known.
        """
        with self._lock:
            own = {
                device: {me: counts[me]} for device, counts in self.given.items() if me in counts
            }
            before, self.given = self.totals, MappingProxyType(reported)
            self.learn(own)
            return self._risen(before)

    def fold(self, programs: Collection[str]) -> None:
        """Programs have left: their stops count on without their names."""
        with self._lock:
            folded: dict[int, dict[str, int]] = {}
            for device, counts in self.given.items():
                rest = {text: count for text, count in counts.items() if text not in programs}
                for text in counts.keys() - rest.keys():
                    _add(rest, GIVEN_BY_NOBODY, counts[text])
                folded[device] = rest
            self._put(folded)

    def _put(self, given: Mapping[int, Mapping[str, int]]) -> tuple[int, ...]:
        before = self.totals
        self.given = MappingProxyType(dict(given))
        self.totals = MappingProxyType(
            {number: sum(of.values()) % STOPS_WRAP for number, of in given.items()}
        )
        return self._risen(before)

    def _risen(self, before: Mapping[int, int]) -> tuple[int, ...]:
        return tuple(
            number for number, n in self.totals.items() if is_newer(n, before.get(number, 0))
        )


def _add(counts: dict[str, int], program: str, more: int) -> None:
    counts[program] = (counts.get(program, 0) + more) % STOPS_WRAP
