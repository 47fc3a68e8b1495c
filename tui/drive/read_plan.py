"""Planning of the requests that read a set of parameters with the least time on the wire.

The result is optimal for these choices: every split of the addresses into reads of adjacent words
that the drive allows, each with or without one part of an indirect block or scanner table with
known slots.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from .errors import DriveError
from .profile.profile import Profile
from .profile.schema import Block, Parameter, ReadFunction
from .values import word_count

REQUEST_CHARACTERS = 8
"""Characters of a function 3 request: address, function, start, count, checksum."""
REPLY_CHARACTERS = 5
"""Characters of its reply in addition to the words: address, function, byte count, checksum."""
WRITE_ONE_CHARACTERS = 8
"""Characters of a function 6 request, and of its reply: address, function, register, word,
checksum; the reply of function 16 has as many."""
WRITE_MANY_CHARACTERS = 9
"""Characters of a function 16 request in addition to the words."""
READ_WRITE_CHARACTERS = 13
"""Characters of a function 23 request in addition to the written words."""


@dataclass(frozen=True, slots=True)
class WireTiming:
    """Time of an exchange on the line, in seconds."""

    character: float = 11 / 19200
    silence: float = 3.5 * 11 / 19200
    turnaround: float = 0.005

    def read(self, words: int) -> float:
        """Return the seconds of a read of `words` words, from its request to the next request.

        The turnaround counts from the end of the request to the start of the reply.
        """
        return self._exchange(REQUEST_CHARACTERS + REPLY_CHARACTERS + 2 * words)

    def write(self, words: int, *, multiple: bool) -> float:
        """Return the seconds of a write, with function 16 if `multiple`, else function 6."""
        request = WRITE_MANY_CHARACTERS + 2 * words if multiple else WRITE_ONE_CHARACTERS
        return self._exchange(request + WRITE_ONE_CHARACTERS)

    def read_write(self, read: int, written: int) -> float:
        """Return the seconds of an exchange with function 23."""
        return self._exchange(READ_WRITE_CHARACTERS + 2 * written + REPLY_CHARACTERS + 2 * read)

    def _exchange(self, characters: int) -> float:
        # the turnaround includes the inter-frame gap by which the drive detects the frame's end
        waits = max(self.turnaround, self.silence) + self.silence
        return characters * self.character + waits


@dataclass(frozen=True, slots=True)
class Place:
    """Place of a parameter's words in a reply: the offset of the first one."""

    code: str
    offset: int


@dataclass(frozen=True, slots=True)
class ReadRequest:
    """One read and the parameters found in its reply."""

    address: int
    count: int
    places: tuple[Place, ...]
    function: ReadFunction = 3


@dataclass(frozen=True, slots=True)
class SlotCheck:
    """A read of slots after their block; the block counts only if they have these values."""

    request: ReadRequest
    slots: Mapping[str, int]
    governs: tuple[str, ...]
    """Codes whose values are invalid if a slot has another value."""


@dataclass(frozen=True, slots=True)
class ReadPlan:
    """Requests in the order of their addresses, and their time on the wire in seconds."""

    requests: tuple[ReadRequest, ...]
    seconds: float
    checks: tuple[SlotCheck, ...] = ()
    """Sent after the requests; their time is in `seconds`."""

    @property
    def microseconds(self) -> int:
        """The same time in whole microseconds."""
        return round(self.seconds * 1e6)


def plan_reads(
    profile: Profile,
    codes: Iterable[str],
    timing: WireTiming = WireTiming(),
    slots: Mapping[str, int] | None = None,
    unreadable: Collection[str] = (),
) -> ReadPlan:
    """Return the cheapest requests for these parameters.

    `slots` are raw values of block and scanner slots that are known to be active; a block without a
    known slot is not used. Slots that take effect immediately may be changed by others at any time,
    so they are read after each use, which the time includes. `unreadable` are codes that this drive
    refused: no read covers them. Raises DriveError for a parameter that can only be written,
    UnknownParameter for a missing one.
    """
    wanted = {code: profile[code] for code in dict.fromkeys(codes)}
    for parameter in wanted.values():
        if parameter.access == "w":
            raise DriveError(f"{parameter.code} of {profile.name} can only be written.")
    best: ReadPlan | None = None
    options = [
        [
            stretch
            for stretch in _stretches(profile, block, slots or {})
            if stretch.reads_any(wanted)
        ]
        for block in profile.data.blocks
    ]
    for choice in product(*([None, *stretches] for stretches in options)):
        used = [stretch for stretch in choice if stretch is not None]
        covered = {place.code for stretch in used for place in stretch.request.places}
        rest = [p for code, p in wanted.items() if code not in covered]
        requests = [
            *_runs(profile, rest, timing, unreadable),
            *(_only(stretch.request, wanted) for stretch in used),
        ]
        checks = [
            check for stretch in used for check in _checks(profile, stretch, timing, unreadable)
        ]
        seconds = sum(timing.read(r.count) for r in (*requests, *(c.request for c in checks)))
        if best is None or (seconds, len(requests)) < (best.seconds, len(best.requests)):
            best = ReadPlan(
                tuple(sorted(requests, key=lambda r: r.address)), seconds, tuple(checks)
            )
    return best or ReadPlan((), 0.0)


def _only(request: ReadRequest, wanted: Mapping[str, Parameter]) -> ReadRequest:
    places = tuple(place for place in request.places if place.code in wanted)
    return ReadRequest(request.address, request.count, places, request.function)


@dataclass(frozen=True, slots=True)
class _Stretch:
    """One read of a block, and the slots that it depends on."""

    request: ReadRequest
    slots: Mapping[str, int]
    checked: bool

    def reads_any(self, wanted: Mapping[str, Parameter]) -> bool:
        """Return True if it reads any of these parameters."""
        return any(place.code in wanted for place in self.request.places)


def _stretches(profile: Profile, block: Block, slots: Mapping[str, int]) -> Iterator[_Stretch]:
    """Yield every read of a block from one known slot to another.

    Unknown slots in between are skipped in an indirect block. A read of a scanner may end at an
    unused slot, but not cover one.
    """
    if block.direction != "read":
        return
    over_holes = block.effective == "after-reset"
    assigned = [_assigned(profile, block, slots.get(slot)) for slot in block.slots]
    first_ones = [0] if block.fixed_start else range(len(assigned))
    for first in first_ones:
        places: list[Place] = []
        for offset, code in enumerate(assigned[first : first + block.max_words]):
            if code is None:
                if over_holes:
                    continue
                break
            places.append(Place(code, offset))
            if offset + 1 >= block.min_words:
                names = [block.slots[first + place.offset] for place in places]
                yield _Stretch(
                    ReadRequest(block.address + first, offset + 1, tuple(places)),
                    {name: slots[name] for name in names},
                    checked=block.effective == "at-once",
                )


def _checks(
    profile: Profile, stretch: _Stretch, timing: WireTiming, unreadable: Collection[str]
) -> list[SlotCheck]:
    """Return the reads that verify, after a stretch, that its slots have not changed."""
    if not stretch.checked:
        return []
    slots = [profile[code] for code in stretch.slots]
    governs = tuple(place.code for place in stretch.request.places)
    return [
        SlotCheck(request, {p.code: stretch.slots[p.code] for p in request.places}, governs)
        for request in _runs(profile, slots, timing, unreadable)
    ]


def block_places(profile: Profile, slots: Mapping[str, int]) -> dict[int, str]:
    """Return the code in each register of a block or scanner, by the raw values of its slots."""
    return {
        block.address + offset: code
        for block in profile.data.blocks
        if block.direction == "read"
        for offset, slot in enumerate(block.slots)
        if (code := _assigned(profile, block, slots.get(slot))) is not None
    }


def _assigned(profile: Profile, block: Block, raw: int | None) -> str | None:
    """Return the code that a slot's raw value selects; None if it is unused or unknown."""
    if raw is None:
        return None
    if block.selects_by == "address":
        parameter = profile.at(raw) if raw else None
        return parameter.code if parameter and word_count(parameter) == 1 else None
    return next((c.parameter for c in block.choices if c.raw == raw), None)


def _runs(
    profile: Profile,
    parameters: Iterable[Parameter],
    timing: WireTiming,
    unreadable: Collection[str],
) -> list[ReadRequest]:
    """Return the cheapest split of parameters into reads of adjacent words, by dynamic
    programming."""
    wanted = sorted(parameters, key=lambda p: p.address)
    found: list[ReadRequest] = []
    for function in sorted({p.function for p in wanted}):
        ordered = [p for p in wanted if p.function == function]
        best = _cheapest(profile, ordered, timing, unreadable)
        runs: list[ReadRequest] = []
        end = len(ordered)
        while end:
            start = best[end][1]
            runs.append(request_of(ordered[start:end]))
            end = start
        found += runs[::-1]
    return found


def _cheapest(
    profile: Profile,
    ordered: Sequence[Parameter],
    timing: WireTiming,
    unreadable: Collection[str] = (),
) -> list[tuple[float, int]]:
    """Return, for each prefix of `ordered`, its least time in seconds and the last run's start."""
    best: list[tuple[float, int]] = [(0.0, 0)]
    longest = _longest(profile, ordered[0])
    known_to: dict[int, int] = {}
    for end in range(1, len(ordered) + 1):
        last, stop = ordered[end - 1].address, 0
        choices = []
        for start in reversed(range(end)):
            first = ordered[start]
            if start < end - 1 and last - first.address >= longest:
                break  # too long, as is every read that begins earlier
            stop = max(stop, first.address + word_count(first))
            count = stop - first.address
            if start == end - 1 or _is_allowed(profile, first, count, unreadable, known_to):
                choices.append((best[start][0] + timing.read(count), start))
        best.append(min(choices))
    return best


def _span(run: Sequence[Parameter]) -> int:
    return max(p.address + word_count(p) for p in run) - run[0].address


def _longest(profile: Profile, parameter: Parameter) -> int:
    """Return the most words that the function of this parameter reads at once."""
    function = profile.function(parameter.function)
    return (function.max_read if function else None) or 1


def request_of(run: Sequence[Parameter]) -> ReadRequest:
    """Return the request for a run of adjacent parameters, in the order of their addresses."""
    first = run[0].address
    places = tuple(Place(p.code, p.address - first) for p in run)
    return ReadRequest(first, _span(run), places, run[0].function)


def run_length(profile: Profile, run: Sequence[Parameter]) -> int | None:
    """Return the number of words of a read over this run; None if the drive does not allow it."""
    count = _span(run)
    return count if len(run) == 1 or _is_allowed(profile, run[0], count, (), {}) else None


def _is_allowed(
    profile: Profile,
    first: Parameter,
    count: int,
    unreadable: Collection[str],
    known_to: dict[int, int],
) -> bool:
    """Return True if the drive allows a read of several parameters in so many words."""
    if count == 1:
        return True
    reading = profile.data.reading
    if reading.single_words_only or count > _longest(profile, first):
        return False
    end = first.address + count
    return reading.gaps_readable or _known_to(profile, first, unreadable, known_to) >= end


def _known_to(
    profile: Profile, first: Parameter, unreadable: Collection[str], found: dict[int, int]
) -> int:
    """Return the first address from a parameter on that cannot be read.

    `found` holds the results of this function for earlier parameters in the same space.
    """
    passed, at = [], first.address
    while at not in found:
        parameter = profile.at(at, first.function)
        if parameter is None or parameter.access == "w" or parameter.code in unreadable:
            found[at] = at
        else:
            passed.append(at)
            at += word_count(parameter)
    end = found[at]
    found.update(dict.fromkeys(passed, end))
    return end
