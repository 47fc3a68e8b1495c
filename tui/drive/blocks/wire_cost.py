"""Time of an assignment on the wire, savings, the best assignment, and its requests.

For families without blocks: the time of reading adjacent parameters in one request, and the reads
that save most.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from tui.wire.frames import read_frame, read_write_frame, write_frame

from ..profile.profile import Profile
from ..profile.schema import Block, Parameter
from ..read_plan import ReadRequest, WireTiming, plan_reads, request_of, run_length
from ..values import word_count
from .assignment import Assignment, empty, slot_target
from .picking import raw_of
from .slot_rules import reason_against


@dataclass(frozen=True, slots=True)
class Cost:
    """Cost of reading a set of parameters."""

    microseconds: int
    requests: int
    """Number of requests, including those that check a scanner's slots."""


@dataclass(frozen=True, slots=True)
class Saving:
    """Cost of the same set with two assignments."""

    before: Cost
    after: Cost

    @property
    def microseconds(self) -> int:
        """Savings of the second one; negative if it costs more."""
        return self.before.microseconds - self.after.microseconds


@dataclass(frozen=True, slots=True)
class Stretch:
    """A read of adjacent words: the request, its parameters, its time and its savings."""

    request: ReadRequest
    codes: tuple[str, ...]
    """Codes of the requested parameters in it."""
    beside: tuple[str, ...]
    """Codes of other parameters in it; they cost only the time of their words."""
    cost: int
    """Microseconds."""
    alone: int
    """Microseconds to read the requested ones one by one."""

    @property
    def saves(self) -> int:
        """Microseconds that the stretch saves."""
        return self.alone - self.cost


def cost(
    profile: Profile,
    codes: Iterable[str],
    timing: WireTiming,
    slots: Mapping[str, int],
) -> Cost:
    """Return the cost of reading these with the slots in force, by the cheapest plan."""
    plan = plan_reads(profile, codes, timing, slots)
    return Cost(plan.microseconds, len(plan.requests) + len(plan.checks))


def saving(
    profile: Profile,
    codes: Collection[str],
    timing: WireTiming,
    before: Mapping[str, int],
    after: Mapping[str, int],
) -> Saving:
    """Return the cost of reading these with the present and with the proposed slots."""
    return Saving(
        cost(profile, codes, timing, before),
        cost(profile, codes, timing, after),
    )


def span(plan: Assignment) -> tuple[int, int] | None:
    """Return address and number of words of the request for all slots in use; None if none is
    used."""
    block, length = plan.block, plan.length
    if not length:
        return None
    return block.address, min(max(length, block.min_words), block.max_words)


def reach(profile: Profile, plan: Assignment, codes: Collection[str]) -> range:
    """Return the places that one write of these parameters covers, from first to last."""
    block = plan.block
    named = [
        place
        for place, raw in enumerate(plan.raws)
        if (parameter := slot_target(profile, block, raw)) is not None and parameter.code in codes
    ]
    if not named:
        return range(0)
    first = 0 if block.fixed_start else named[0]
    end = max(named[-1] + 1, first + block.min_words)
    return range(first, min(end, len(plan.raws)))


def together(
    profile: Profile, inputs: Assignment | None, outputs: Assignment | None, direction: str
) -> tuple[Assignment | None, Assignment | None]:
    """Return inputs and outputs for one request: both with function 23, else those of the
    direction."""
    if profile.function(23) is not None:
        return inputs, outputs
    return (inputs, None) if direction == "read" else (None, outputs)


def block_request(
    profile: Profile,
    device: int,
    inputs: Assignment | None,
    outputs: Assignment | None,
    words: Sequence[int] = (),
    places: range | None = None,
) -> bytes:
    """Return the request that uses an assignment; empty if no slot is in use.

    If inputs and outputs are in use, and the drive has function 23, one request does both.
    Otherwise it reads the inputs, or writes the outputs if there are no inputs. `words` are written
    to the outputs, with zeros for missing ones; with `places`, only those are written.
    """
    read = span(inputs) if inputs else None
    write = span(outputs) if outputs else None
    if write and outputs and places is not None:
        write = (outputs.block.address + places.start, len(places))
    filled = (*words, *([0] * write[1]))[: write[1]] if write else ()
    if read and write and profile.function(23) is not None:
        return read_write_frame(device, *read, write[0], filled)
    if read:
        return read_frame(device, *read)
    return write_frame(device, write[0], filled) if write else b""


def microseconds(
    profile: Profile,
    timing: WireTiming,
    inputs: Assignment | None,
    outputs: Assignment | None,
) -> int:
    """Return the time of the exchange that `frame` begins, with its reply; 0 if no slot is used."""
    read = span(inputs) if inputs else None
    write = span(outputs) if outputs else None
    if read and write and profile.function(23) is not None:
        seconds = timing.read_write(read[1], write[1])
    elif read:
        seconds = timing.read(read[1])
    else:
        seconds = timing.write(write[1], multiple=True) if write else 0.0
    return round(seconds * 1e6)


def stretches(
    profile: Profile,
    codes: Iterable[str],
    timing: WireTiming,
) -> list[Stretch]:
    """Return the reads of adjacent words that save most for these parameters, best first.

    Each parameter counts for one read only. Empty if the drive reads single words only.
    """
    wanted = (profile[code] for code in dict.fromkeys(codes))
    left = sorted((p for p in wanted if p.is_register), key=lambda p: p.address)
    found: list[Stretch] = []
    while left:
        runs = (
            left[first:end] for first in range(len(left)) for end in range(first + 2, len(left) + 1)
        )
        made = (_stretch(profile, run, timing) for run in runs)
        best = max((s for s in made if s and s.saves > 0), key=lambda s: s.saves, default=None)
        if best is None:
            break
        found.append(best)
        left = [p for p in left if p.code not in best.codes]
    return found


def _stretch(
    profile: Profile,
    run: Sequence[Parameter],
    timing: WireTiming,
) -> Stretch | None:
    count = run_length(profile, run)
    if count is None:
        return None
    codes = tuple(p.code for p in run)
    request = request_of(run)
    inside = range(request.address, request.address + count)
    beside = tuple(
        p.code
        for at in inside
        if (p := profile.at(at)) is not None and p.code not in codes and p.access != "w"
    )
    alone = sum(timing.read(word_count(p)) for p in run)
    return Stretch(request, codes, beside, round(timing.read(count) * 1e6), round(alone * 1e6))


def best_assignment(
    profile: Profile,
    block: Block,
    codes: Sequence[str],
    timing: WireTiming,
    others: Mapping[str, int],
) -> Assignment:
    """Return the assignment of a block with which these parameters are read fastest.

    A greedy search fills the slots one by one, and returns the best of all lengths, because the
    first slots may cost more than they save. `others` are the slots of other blocks.
    """
    left = [code for code in codes if not reason_against(profile, block, profile[code])]

    def takes(plan: Assignment) -> int:
        return cost(profile, codes, timing, {**others, **plan.slots}).microseconds

    plan = best = empty(block)
    least = takes(plan)
    for place in range(len(block.slots)):
        if not left:
            break
        tried = {c: plan.with_raw(place, raw_of(profile, block, profile[c])) for c in left}
        code = min(tried, key=lambda c: takes(tried[c]))
        left.remove(code)
        plan = tried[code]
        if (now := takes(plan)) < least:
            least, best = now, plan
    return best
