"""Read plans: never past a limit, never dearer than any other split, all values covered."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tui.drive.errors import DriveError, UnknownParameter
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import ProfileData
from tui.drive.read_plan import ReadPlan, WireTiming, plan_reads

TIMING = WireTiming(character=11 / 19200, silence=3.5 * 11 / 19200, turnaround=0.005)


def profile_of(
    addresses: Sequence[int],
    *,
    longest: int = 29,
    gaps: bool = False,
    single: bool = False,
    blocks: Sequence[dict[str, object]] = (),
    write_only: Sequence[int] = (),
    wide: Sequence[int] = (),
) -> Profile:
    """A profile with a word P<address> at each address; `wide` ones take the next word as well."""
    tables = {
        "profile": {"id": "plan", "name": "Plan", "vendor": "Nobody", "version": "1"},
        "link": {"baud": 19200, "format": "8E1"},
        "sources": [{"id": "manual", "title": "None"}],
        "functions": [
            {"code": 3, "name": "Read", "max_read": longest},
            {"code": 6, "name": "Write"},
        ],
        "reading": {"gaps_readable": gaps, "single_words_only": single},
        "monitoring": {"values": []},
        "blocks": list(blocks),
        "parameters": [
            {
                "code": f"P{a}",
                "name": f"Word {a}",
                "number": f"W{a}",
                "address": a,
                "access": "w" if a in write_only else "rw",
                "type": "uint32" if a in wide else "uint16",
                "group": "All",
                "source": "manual",
                "confidence": "manual",
            }
            for a in addresses
        ],
    }
    return Profile(msgspec.convert(tables, ProfileData))


def spans(plan: ReadPlan) -> list[tuple[int, int]]:
    return [(request.address, request.count) for request in plan.requests]


def codes(addresses: Sequence[int]) -> list[str]:
    return [f"P{address}" for address in addresses]


def covered(plan: ReadPlan) -> list[str]:
    return sorted(place.code for request in plan.requests for place in request.places)


def test_neighbors_are_read_together() -> None:
    profile = profile_of(range(3201, 3212))
    assert spans(plan_reads(profile, codes([3201, 3202, 3204]), TIMING)) == [(3201, 4)]


def test_unknown_gap_is_not_read() -> None:
    profile = profile_of([10, 11, 13])
    assert spans(plan_reads(profile, codes([10, 11, 13]), TIMING)) == [(10, 2), (13, 1)]


def test_readable_gap_is_read_if_cheaper() -> None:
    profile = profile_of([10, 11, 13, 80], gaps=True)
    assert spans(plan_reads(profile, codes([10, 11, 13, 80]), TIMING)) == [(10, 4), (80, 1)]


def test_longest_read_is_not_exceeded() -> None:
    profile = profile_of(range(100, 160), longest=20)
    plan = plan_reads(profile, codes(range(100, 160)), TIMING)
    assert sorted(count for _, count in spans(plan)) == [20, 20, 20]


def test_second_word_of_the_last_value_counts() -> None:
    profile = profile_of([1, 2, 3, 4], longest=4, wide=[4])
    plan = plan_reads(profile, codes([1, 2, 3, 4]), TIMING)
    assert covered(plan) == codes([1, 2, 3, 4])
    assert sorted(count for _, count in spans(plan)) in ([1, 4], [2, 3])


def test_single_words_only() -> None:
    profile = profile_of([1, 2, 3], single=True)
    assert spans(plan_reads(profile, codes([1, 2, 3]), TIMING)) == [(1, 1), (2, 1), (3, 1)]


def test_refused_parameter_is_not_read_as_a_gap() -> None:
    profile = profile_of([1, 2, 3])
    plan = plan_reads(profile, codes([1, 3]), TIMING, unreadable={"P2"})
    assert spans(plan) == [(1, 1), (3, 1)]


def test_write_only_word_is_refused() -> None:
    profile = profile_of([1, 2], write_only=[2])
    with pytest.raises(DriveError, match="only be written"):
        plan_reads(profile, ["P2"], TIMING)


def test_unknown_code_is_named() -> None:
    with pytest.raises(UnknownParameter, match="'P9'"):
        plan_reads(profile_of([1]), ["P9"], TIMING)


BLOCK = {
    "id": "read-block",
    "name": "Indirect block",
    "direction": "read",
    "address": 0x1875,
    "min_words": 2,
    "max_words": 5,
    "slots": ["P2165", "P2166", "P2167"],
    "selects_by": "choice",
    "choices": [{"raw": 1, "parameter": "P500"}, {"raw": 2, "parameter": "P900"}],
    "fixed_start": True,
    "effective": "after-reset",
}


def test_indirect_block_is_used_if_its_slots_are_known() -> None:
    profile = profile_of([500, 900, 2165, 2166, 2167], single=True, blocks=[BLOCK])
    wanted = codes([500, 900])
    slots = {"P2165": 1, "P2166": 2, "P2167": 0}
    plan = plan_reads(profile, wanted, TIMING, slots=slots)
    assert spans(plan) == [(0x1875, 2)]
    assert covered(plan) == sorted(wanted)
    assert spans(plan_reads(profile, wanted, TIMING)) == [(500, 1), (900, 1)]


def test_unknown_slot_of_an_indirect_block_is_read_as_a_gap() -> None:
    profile = profile_of([500, 900, 2165, 2166, 2167], single=True, blocks=[BLOCK])
    plan = plan_reads(profile, codes([500, 900]), TIMING, slots={"P2165": 2, "P2167": 1})
    (request,) = plan.requests
    assert (request.address, request.count) == (0x1875, 3)
    assert [(place.code, place.offset) for place in request.places] == [("P900", 0), ("P500", 2)]


def test_scanner_read_does_not_include_an_unused_slot() -> None:
    profile = profile_of([500, 900, 1200, 2165, 2166, 2167], single=True, blocks=[SCANNER])
    plan = plan_reads(profile, codes([500, 1200]), TIMING, slots={"P2165": 500, "P2167": 1200})
    assert spans(plan) == [(500, 1), (1200, 1)]


def test_block_with_a_free_first_slot_is_not_used() -> None:
    profile = profile_of([500, 900, 2165, 2166, 2167], single=True, blocks=[BLOCK])
    plan = plan_reads(profile, codes([900]), TIMING, slots={"P2165": 0, "P2166": 2})
    assert spans(plan) == [(900, 1)]


SCANNER = BLOCK | {
    "id": "scanner",
    "address": 700,
    "min_words": 1,
    "max_words": 3,
    "selects_by": "address",
    "fixed_start": False,
    "effective": "at-once",
    "choices": [],
}


def test_changeable_slots_are_read_after_their_block() -> None:
    profile = profile_of([500, 900, 1200, 2165, 2166, 2167], blocks=[SCANNER])
    slots = {"P2165": 500, "P2166": 900, "P2167": 1200}
    plan = plan_reads(profile, codes([500, 900, 1200]), TIMING, slots=slots)
    assert spans(plan) == [(700, 3)]
    (check,) = plan.checks
    assert (check.request.address, check.request.count, check.slots) == (2165, 3, slots)
    assert set(check.governs) == {"P500", "P900", "P1200"}
    assert plan.seconds == pytest.approx(2 * TIMING.read(3))
    assert plan.microseconds == round(plan.seconds * 1e6)


def test_scanner_that_saves_no_time_is_not_used() -> None:
    profile = profile_of([500, 900, 2165, 2166, 2167], blocks=[SCANNER])
    plan = plan_reads(profile, codes([500, 900]), TIMING, slots={"P2165": 500, "P2166": 900})
    # two reads of one word and two reads of two words: the drive is read directly
    assert spans(plan) == [(500, 1), (900, 1)]
    assert plan.checks == ()


ALL_SLOTS = {"P2165": 1, "P2166": 2, "P2167": 3}


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"fixed_start": False}, [(0x1876, 2)]), ({}, [(0x1875, 3)]),
        ({"fixed_start": False, "min_words": 3}, [(0x1875, 3)]),
        ({"min_words": 4}, [(900, 1), (1200, 1)]),
        ({"direction": "write"}, [(900, 1), (1200, 1)]),
    ],
)  # fmt: skip
def test_block_is_read_as_far_as_it_can_be(
    fields: dict[str, object], expected: list[tuple[int, int]]
) -> None:
    choices = [{"raw": raw, "parameter": f"P{a}"} for raw, a in ((1, 500), (2, 900), (3, 1200))]
    block = {**BLOCK, "choices": choices, **fields}
    profile = profile_of([500, 900, 1200, 2165, 2166, 2167], single=True, blocks=[block])
    assert spans(plan_reads(profile, codes([900, 1200]), TIMING, slots=ALL_SLOTS)) == expected


def test_function_without_a_known_limit_reads_word_by_word() -> None:
    profile = profile_of([1, 2, 3])
    only = msgspec.structs.replace(profile.data.functions[0], max_read=None)
    profile = Profile(msgspec.structs.replace(profile.data, functions=[only]))
    assert spans(plan_reads(profile, codes([1, 2, 3]), TIMING)) == [(1, 1), (2, 1), (3, 1)]


def test_words_are_read_by_their_own_function() -> None:
    profile = profile_of([1, 2])
    inputs = [msgspec.structs.replace(p, function=4) for p in profile.data.parameters]
    profile = Profile(msgspec.structs.replace(profile.data, parameters=inputs))
    plan = plan_reads(profile, codes([1]), TIMING)
    assert [(request.address, request.function) for request in plan.requests] == [(1, 4)]


def test_fields_of_one_word_are_read_at_once() -> None:
    profile = profile_of([1, 2], single=True)
    first, second = profile.data.parameters
    fields = [first, msgspec.structs.replace(second, address=1)]
    profile = Profile(msgspec.structs.replace(profile.data, parameters=fields))
    assert spans(plan_reads(profile, codes([1, 2]), TIMING)) == [(1, 1)]


@settings(deadline=None, max_examples=60)
@given(
    slots=st.lists(st.sampled_from([0, 10, 11, 12, 20, 30, 40, 50]), min_size=3, max_size=3),
    wanted=st.sets(st.sampled_from([10, 11, 12, 20, 30, 40, 50]), min_size=1),
    checked=st.booleans(),
)
def test_no_other_use_of_blocks_is_cheaper(
    slots: list[int], wanted: set[int], *, checked: bool
) -> None:
    """Every part of the block, with the best direct reads of the rest."""
    block = SCANNER | {"effective": "at-once" if checked else "after-reset"}
    profile = profile_of([10, 11, 12, 20, 30, 40, 50, 2165, 2166, 2167], blocks=[block])
    known = {f"P{2165 + place}": raw for place, raw in enumerate(slots)}
    plan = plan_reads(profile, codes(sorted(wanted)), TIMING, slots=known)
    assert covered(plan) == sorted(codes(sorted(wanted)))
    costs = [plan_reads(profile, codes(sorted(wanted)), TIMING).seconds]
    for first in range(3):
        for count in range(1, 4 - first):
            used = slots[first : first + count]
            if (not checked or 0 not in used) and wanted & set(used):
                rest = plan_reads(profile, codes(sorted(wanted - set(used))), TIMING).seconds
                costs.append(rest + TIMING.read(count) * (2 if checked else 1))
    assert plan.seconds == pytest.approx(min(costs))


def splits(items: Sequence[int]) -> Iterator[list[Sequence[int]]]:
    """Every way to cut a sorted list into runs."""
    if not items:
        yield []
        return
    for cut in range(1, len(items) + 1):
        for rest in splits(items[cut:]):
            yield [items[:cut], *rest]


@settings(deadline=None)
@given(
    known=st.sets(st.integers(0, 24), min_size=1, max_size=16),
    share=st.randoms(use_true_random=False),
    longest=st.integers(1, 12),
    gaps=st.booleans(),
    turnaround=st.floats(0.0, 0.02),
)
def test_no_other_split_is_cheaper(
    known: set[int], share: object, longest: int, gaps: bool, turnaround: float
) -> None:
    timing = WireTiming(11 / 19200, 3.5 * 11 / 19200, turnaround)
    profile = profile_of(sorted(known), longest=longest, gaps=gaps)
    wanted = sorted(a for a in known if share.random() < 0.6)  # type: ignore[attr-defined]
    plan = plan_reads(profile, codes(wanted), timing)
    assert covered(plan) == sorted(codes(wanted))
    for address, count in spans(plan):
        assert count <= longest
        assert gaps or set(range(address, address + count)) <= known
    cheapest = min(
        sum(timing.read(run[-1] - run[0] + 1) for run in split)
        for split in splits(wanted)
        if all(
            run[-1] - run[0] < longest and (gaps or set(range(run[0], run[-1] + 1)) <= known)
            for run in split
        )
    )
    assert plan.seconds == pytest.approx(cheapest)


def test_read_takes_its_characters_and_its_waits() -> None:
    """8 of the request and 5 around the words, the turnaround, and the silence after the reply."""
    timing = WireTiming(character=1.0, silence=4.0, turnaround=10.0)
    assert [timing.read(words) for words in (1, 2, 10)] == [29.0, 31.0, 47.0]
    assert WireTiming(character=1.0, silence=4.0, turnaround=2.0).read(1) == 23.0


def test_plan_has_its_time_and_is_empty_without_codes() -> None:
    plan = plan_reads(profile_of([1, 2, 3, 40]), ["P1", "P2", "P3", "P40"], TIMING)
    assert spans(plan) == [(1, 3), (40, 1)]
    assert plan.seconds == pytest.approx(TIMING.read(3) + TIMING.read(1))
    assert plan_reads(profile_of([1]), [], TIMING) == ReadPlan((), 0.0)
