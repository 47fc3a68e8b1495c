"""How words are written and parameters read afterwards with the least time on the wire.

A drive with function 23 writes and reads in one exchange: the reading rides on the write.
Exact for what it considers: every run of neighbours that may ride, with the best split of the
others before and behind it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from .profile import Profile
from .read_plan import (
    ReadPlan,
    ReadRequest,
    WireTiming,
    cheapest,
    plan_reads,
    request_of,
    run_length,
)
from .schema import Parameter


@dataclass(frozen=True, slots=True)
class WritePlan:
    """A write, what is read in the same exchange by function 23, and what is read after it."""

    address: int
    words: int
    riding: ReadRequest | None
    reads: tuple[ReadRequest, ...]
    seconds: float

    @property
    def microseconds(self) -> int:
        """Time on the wire in whole microseconds."""
        return round(self.seconds * 1e6)


def plan_write(
    profile: Profile,
    address: int,
    words: int,
    codes: Iterable[str],
    timing: WireTiming,
    unreadable: Collection[str] = (),
) -> WritePlan:
    """The cheapest way to write so many words and then read these parameters.

    Raises DriveError for a parameter that can only be written, UnknownParameter for one that
    the profile does not have.
    """
    wanted = list(dict.fromkeys(codes))
    alone = plan_reads(profile, wanted, timing, unreadable=unreadable)
    plain = WritePlan(
        address, words, None, alone.requests, _write(profile, words, timing) + alone.seconds
    )
    ridden = _riding(profile, address, words, [profile[c] for c in wanted], timing, unreadable)
    return ridden if ridden is not None and ridden.seconds < plain.seconds else plain


def _write(profile: Profile, words: int, timing: WireTiming) -> float:
    return timing.write(words, multiple=words > 1 or profile.function(6) is None)


def _riding(
    profile: Profile,
    address: int,
    words: int,
    parameters: list[Parameter],
    timing: WireTiming,
    unreadable: Collection[str],
) -> WritePlan | None:
    """The cheapest plan in which some run rides on the write; None where none can."""
    function = profile.function(23)
    if function is None or words > (function.max_write or 0) or not parameters:
        return None
    longest = function.max_read or 0
    ordered = sorted(parameters, key=lambda p: p.address)
    before = [seconds for seconds, _ in cheapest(profile, ordered, timing, unreadable)]
    behind = [
        sum(timing.read(r.count) for r in _rest(profile, ordered[at:], timing, unreadable))
        for at in range(len(ordered) + 1)
    ]
    best: tuple[float, int, int] | None = None
    for start in range(len(ordered)):
        for end in range(start + 1, len(ordered) + 1):
            count = run_length(profile, ordered[start:end], unreadable, longest)
            if count is None:
                continue
            seconds = before[start] + timing.read_write(count, words) + behind[end]
            best = min(best or (seconds, start, end), (seconds, start, end))
    if best is None:
        return None
    seconds, start, end = best
    reads = (
        *_rest(profile, ordered[:start], timing, unreadable),
        *_rest(profile, ordered[end:], timing, unreadable),
    )
    return WritePlan(address, words, request_of(ordered[start:end]), reads, seconds)


def _rest(
    profile: Profile,
    parameters: list[Parameter],
    timing: WireTiming,
    unreadable: Collection[str],
) -> tuple[ReadRequest, ...]:
    plan: ReadPlan = plan_reads(profile, [p.code for p in parameters], timing, None, unreadable)
    return plan.requests
