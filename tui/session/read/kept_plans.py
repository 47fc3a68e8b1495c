"""Cached read plans of one drive, replaced when its turnaround changes."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

from tui.bus.link import Link, TcpLink, character_time, silence
from tui.bus.poll_plan import USUAL_TURNAROUND, PlannedRead
from tui.drive.read_plan import ReadPlan, ReadRequest, WireTiming, plan_reads

from ..drive import DriveSession

TURNAROUND_STEP = 0.001
PLANS_KEPT = 64
"""Most plans in the cache: sets of codes and turnarounds keep changing."""


class KeptPlans:
    """Read plans by codes, slots, refused codes and the drive's turnaround."""

    def __init__(self, session: DriveSession) -> None:
        self._session = session
        self._kept: dict[tuple[Hashable, ...], ReadPlan] = {}
        self._turnaround = 0.0
        """Turnaround in seconds that the plans assume; follows the measured one in steps."""

    def __len__(self) -> int:
        return len(self._kept)

    def clear(self) -> None:
        """Discard all plans."""
        self._kept.clear()

    def plan(self, codes: frozenset[str], slots: Mapping[str, int] | None = None) -> ReadPlan:
        """Return the plan for reading these codes; it may use the given slots of blocks."""
        refused, turnaround = frozenset(self._session.image.refused), self._measured()
        key = (codes, refused, turnaround, tuple(sorted((slots or {}).items())))
        if key not in self._kept:
            while len(self._kept) >= PLANS_KEPT:
                del self._kept[next(iter(self._kept))]
            profile, timing = self._session.profile, timing_on(self._session.line.link, turnaround)
            self._kept[key] = plan_reads(profile, sorted(codes), timing, slots, refused)
        return self._kept[key]

    def _measured(self) -> float:
        """The measured turnaround in steps, so that small changes do not discard plans."""
        measured = self._session.line.device_state(self._session.device).usual_turnaround
        if measured is None:
            return USUAL_TURNAROUND
        if abs(measured - self._turnaround) > max(TURNAROUND_STEP, self._turnaround / 3):
            self._turnaround = round(measured / TURNAROUND_STEP) * TURNAROUND_STEP
        return self._turnaround


def timing_on(link: Link, turnaround: float) -> WireTiming:
    """Return the time of an exchange; over Modbus TCP only the drive takes time."""
    if isinstance(link, TcpLink):
        return WireTiming(character=0.0, silence=0.0, turnaround=turnaround)
    return WireTiming(character_time(link), silence(link), turnaround)


def planned_read(request: ReadRequest) -> PlannedRead:
    """Convert a request for the keeper, which repeats it."""
    return PlannedRead(request.address, request.count, request.function)


def planned_reads(*plans: ReadPlan) -> tuple[PlannedRead, ...]:
    """Return the requests of read plans in the order in which they are sent, without repeats."""
    found: list[ReadRequest] = []
    for plan in plans:
        found += [*plan.requests, *(check.request for check in plan.checks)]
    return tuple(dict.fromkeys(planned_read(request) for request in found))
