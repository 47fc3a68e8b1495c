"""Cycle time of a planned line by its read plans, and suitable timeouts. Times are in seconds."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from tui.drive.profile.profile import Profile
from tui.drive.read_plan import WireTiming, plan_reads
from tui.drive.values import word_count
from tui.safety import MARGIN
from tui.wire.frames import character_seconds, silent_seconds

from ..monitor.rates import rates_of
from .plan_file import LinePlan, PlanStation

RETRIES = 2
"""Repeats of a request without a reply, as most masters send them."""
LEAST_REPLY = 0.1
"""Shortest wait for a reply, in s: the turnaround of most drives is not documented."""
LOST_CYCLES = 2
"""Longest pauses that a communication timeout must outlast, so that one lost request trips
nothing."""
USUAL_WORDS = 8
"""Words of a device without a profile, if the plan names none."""
COMPARED_BAUDS = (4800, 9600, 19200, 38400)


@dataclass(frozen=True, slots=True)
class StationTime:
    """Time of one station in each cycle."""

    station: PlanStation
    requests: int
    words: int
    seconds: float
    singly: float
    """Seconds if each value is read by a request of its own."""
    slowest: float
    """Seconds of its longest exchange."""


@dataclass(frozen=True, slots=True)
class StationTimeout:
    """Communication timeout of a station."""

    station: PlanStation
    parameter: str
    """Code of the parameter that sets it."""
    shortest: float
    """Shortest suitable timeout."""
    low: float
    """Range of the parameter; `high` is infinite if it is not known."""
    high: float

    @property
    def suitable(self) -> float | None:
        """The timeout to set; None if the parameter cannot be set so long."""
        value = max(self.shortest, self.low)
        return value if value <= self.high else None


@dataclass(frozen=True, slots=True)
class LineTimes:
    """Times of a line: one cycle, and the timeouts that follow from it."""

    stations: list[StationTime]
    cycle: float
    singly: float
    by_baud: dict[int, float]
    """Cycle time at each baud rate that all drives support."""
    reply: float
    """Suitable wait of the master for a reply."""
    longest: float
    """Longest pause between two requests to one station, while one other does not answer."""
    timeouts: list[StationTimeout]


def line_times(plan: LinePlan) -> LineTimes:
    """Return the times of a planned line."""
    plant = plan.file
    stations = _station_times(plan, plant.baud)
    cycle = sum(item.seconds for item in stations)
    slowest = max(item.slowest for item in stations)
    turnaround = max(_turnaround(plan, station) for station in plant.stations)
    reply = max(LEAST_REPLY, _rounded_up(slowest + (MARGIN - 1) * turnaround, 0.01))
    longest = cycle + (RETRIES + 1) * (plant.master.timeout or reply)
    bauds = [baud for baud in COMPARED_BAUDS if all(baud in b for b in _bauds(plan))]
    return LineTimes(
        stations,
        cycle,
        sum(item.singly for item in stations),
        {baud: sum(t.seconds for t in _station_times(plan, baud)) for baud in bauds},
        reply,
        longest,
        list(_timeouts(plan, longest)),
    )


def _bauds(plan: LinePlan) -> Iterator[list[int]]:
    for station in plan.file.stations:
        if (profile := plan.profile(station)) and profile.data.link.bauds:
            yield profile.data.link.bauds


def _turnaround(plan: LinePlan, station: PlanStation) -> float:
    if station.turnaround is not None:
        return station.turnaround
    profile = plan.profile(station)
    return float(profile.data.link.turnaround_ms) / 1000 if profile else WireTiming().turnaround


def _station_times(plan: LinePlan, baud: int) -> list[StationTime]:
    characters = plan.file.characters
    character, silence = character_seconds(baud, characters), silent_seconds(baud, characters)
    times = []
    for station in plan.file.stations:
        timing = WireTiming(character, silence, _turnaround(plan, station))
        profile = plan.profile(station)
        if profile is None:
            reads = [station.words if station.words is not None else USUAL_WORDS]
            reads, single = [n for n in reads if n], [n for n in reads if n]
        else:
            codes = station.values or list(rates_of(profile).fast)
            reads, single = _reads(profile, codes, timing)
        exchanges = [timing.read(words) for words in reads]
        if station.writes:
            exchanges.append(timing.write(station.writes, multiple=station.writes > 1))
        times.append(
            StationTime(
                station,
                len(exchanges),
                sum(reads) + station.writes,
                sum(exchanges),
                sum(timing.read(words) for words in single) + sum(exchanges[len(reads) :]),
                max(exchanges, default=0.0),
            )
        )
    return times


def _reads(profile: Profile, codes: list[str], timing: WireTiming) -> tuple[list[int], list[int]]:
    """Return the words of each planned read, and of each read of one value."""
    planned = [request.count for request in plan_reads(profile, codes, timing).requests]
    return planned, [word_count(profile[code]) for code in codes]


def _timeouts(plan: LinePlan, longest: float) -> Iterator[StationTimeout]:
    for station in plan.file.stations:
        profile = plan.profile(station)
        rules = profile.data.communication_fault if profile else None
        parameter = profile.get(rules.timeout) if profile and rules and rules.timeout else None
        if parameter is None or parameter.scale is None:
            continue
        scale = float(parameter.scale)
        lowest = max(parameter.min or 0, 1) * scale
        high = parameter.max * scale if parameter.max is not None else math.inf
        shortest = _rounded_up(LOST_CYCLES * longest, scale)
        yield StationTimeout(station, parameter.code, shortest, lowest, high)


def _rounded_up(seconds: float, step: float) -> float:
    return round(math.ceil(round(seconds / step, 6)) * step, 6)
