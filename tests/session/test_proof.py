"""Assignment of an indirect block, identified by its words: never wrongly, and soon if possible."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.blocks import block_of
from tui.drive.profile import library
from tui.drive.values import decode, type_range
from tui.session.read.proof import SlotEvidence, SlotMatch
from tui.session.reading import Reading
from tui.session.shown import Quality

PROFILE = library.load("atv21")
BLOCK = block_of(PROFILE, "read")
CODES = [choice.parameter for choice in BLOCK.choices]
RAWS = {choice.parameter: choice.raw for choice in BLOCK.choices}


@dataclass(frozen=True)
class Signal:
    """A value that stays, ramps evenly, or fluctuates."""

    base: int
    slope: float = 0.0
    noise: int = 0

    def at(self, time: float, chance: random.Random) -> int:
        return round(self.base + self.slope * time) + chance.randint(-self.noise, self.noise)


signals = st.builds(
    Signal,
    base=st.sampled_from([0, 1, 2, 100, 105, 3500, 3520, 7000]),
    slope=st.sampled_from([0.0, 0.0, 0.0, 300.0, -50.0]),
    noise=st.sampled_from([0, 0, 1, 2, 20]),
)


def reading(code: str, raw: int) -> Reading:
    parameter = PROFILE[code]
    return Reading(
        parameter,
        raw,
        decode(parameter, raw, PROFILE.names(parameter), PROFILE.scale(parameter, {}, set())),
        Quality.GOOD,
        0.0,
    )


def compared(
    behind: Mapping[str, str],
    signal: Mapping[str, Signal],
    rounds: int,
    chance: random.Random,
    chosen: Mapping[str, str] | None = None,
) -> SlotEvidence:
    """Evidence after this many rounds; `behind` is the real assignment of the slots."""
    proof = SlotEvidence(PROFILE, BLOCK)
    now = 0.0

    def raw(code: str) -> int:
        """Current values of the drive: at the end of its range a value stays."""
        low, high = type_range(PROFILE[code])
        return min(max(low, signal[code].at(now, chance)), high)

    def ask(code: str) -> Reading:
        nonlocal now
        now += 0.03
        return reading(code, raw(code))

    for _ in range(rounds):
        for code in CODES:
            before = {code: ask(code)}
            now += 0.03
            words = [raw(behind[slot]) & 0xFFFF for slot in BLOCK.slots]
            proof.note(words, before, {code: ask(code)})
        proof.conclude({slot: RAWS[c] for slot, c in (chosen or behind).items()})
    return proof


APART = {code: Signal(1000 + 1000 * place) for place, code in enumerate(CODES)}
CHOSEN = dict(zip(BLOCK.slots, CODES, strict=False))


def test_unique_match_is_confirmed() -> None:
    proof = compared(CHOSEN, APART, 3, random.Random(1))
    assert all(proof.holds(slot, RAWS[code]) for slot, code in CHOSEN.items())
    assert proof.open_codes({slot: RAWS[code] for slot, code in CHOSEN.items()}) == []


def test_two_comparisons_are_not_enough() -> None:
    proof = compared(CHOSEN, APART, 2, random.Random(1))
    assert not any(proof.holds(slot, RAWS[code]) for slot, code in CHOSEN.items())


def test_replacement_for_an_assignment_is_reported() -> None:
    behind = dict.fromkeys(BLOCK.slots, CODES[2])
    proof = compared(behind, APART, 2, random.Random(1), CHOSEN)
    assert {proof.returned_code(slot) for slot in BLOCK.slots} == {""}
    assert not any(proof.excludes(slot, RAWS[code]) for slot, code in CHOSEN.items())
    proof = compared(behind, APART, 3, random.Random(1), CHOSEN)
    assert {proof.returned_code(slot) for slot in BLOCK.slots} == {CODES[2]}
    excluded = [slot for slot, code in CHOSEN.items() if proof.excludes(slot, RAWS[code])]
    assert excluded == [slot for slot in BLOCK.slots if slot != "F877"]
    # equal values cannot be distinguished from each other, but from the assigned one
    alike = APART | {CODES[5]: APART[CODES[2]]}
    proof = compared(behind, alike, 3, random.Random(1), CHOSEN)
    assert proof.returned_code("F875") == ""
    assert proof.excludes("F875", RAWS[CODES[0]])


@pytest.mark.parametrize(
    ("code", "rounds", "verdict"),
    [
        ("FE03", [], SlotMatch.UNREAD),
        ("FE03", [(100, 100, 100)], SlotMatch.SAME),
        ("FE03", [(100, 101, 100)], SlotMatch.DIFFERS),
        ("FE03", [(100, 102, 104)], SlotMatch.MOVING),
        ("FE03", [(104, 96, 100)], SlotMatch.MOVING),  # as far again as between them
        ("FE03", [(104, 95, 100)], SlotMatch.DIFFERS),
        ("FE03", [(100, 100, 100), (200, 200, 200)], SlotMatch.SAME),
        ("FE03", [(100, 100, 100), (200, 201, 200)], SlotMatch.MOVING),
        ("FE03", [(100, 101, 100), (200, 201, 200)], SlotMatch.DIFFERS),
        ("FD01", [(0b100, 0b001, 0b001)], SlotMatch.MOVING),  # every bit as in one of them
        ("FD01", [(0b100, 0b011, 0b001)], SlotMatch.DIFFERS),
    ],
)
def test_words_are_compared_over_rounds(
    code: str, rounds: list[tuple[int, int, int]], verdict: SlotMatch
) -> None:
    proof = SlotEvidence(PROFILE, BLOCK)
    for first, word, second in rounds:
        proof.note([word], {code: reading(code, first)}, {code: reading(code, second)})
    assert proof.verdict("F875", code) is verdict
    assert proof.verdict("F876", code) is SlotMatch.UNREAD


def test_linear_ramp_does_not_hide_the_value_of_a_slot() -> None:
    signal = APART | {CODES[1]: Signal(2500, slope=300.0), CODES[3]: Signal(5200, slope=600.0)}
    proof = compared(CHOSEN, signal, 6, random.Random(1))
    assert all(proof.holds(slot, RAWS[code]) for slot, code in CHOSEN.items())


def test_equal_values_confirm_nothing_and_block_no_other_slot() -> None:
    signal = APART | {CODES[1]: Signal(0), CODES[4]: Signal(0)}
    proof = compared(CHOSEN, signal, 6, random.Random(1))
    held = [slot for slot, code in CHOSEN.items() if proof.holds(slot, RAWS[code])]
    assert held == [slot for slot in BLOCK.slots if slot not in ("F876", "F879")]


def test_uncompared_parameter_leaves_all_slots_unconfirmed() -> None:
    proof = SlotEvidence(PROFILE, BLOCK)
    for _ in range(5):
        for code in CODES[:-1]:
            row = {code: reading(code, APART[code].base)}
            proof.note([APART[c].base for c in CODES[:5]], row, row)
    proof.conclude({"F875": RAWS["FD01"]})
    assert not proof.holds("F875", RAWS["FD01"])
    assert CODES[-1] in proof.open_codes({"F875": RAWS["FD01"]})


def test_excluded_slot_may_start_again() -> None:
    chosen = {"F875": CODES[0]}
    raws = {"F875": RAWS[CODES[0]]}
    wrong = compared(dict.fromkeys(BLOCK.slots, CODES[2]), APART, 3, random.Random(1), chosen)
    assert not wrong.holds("F875", RAWS[CODES[0]])
    wrong.begin()
    for _ in range(3):
        for code in CODES:
            row = {code: reading(code, APART[code].base)}
            wrong.note([APART[CODES[0]].base] * 5, row, row)
    wrong.conclude(raws)
    assert wrong.holds("F875", RAWS[CODES[0]])


@settings(deadline=None, max_examples=300)
@given(
    signal=st.lists(signals, min_size=len(CODES), max_size=len(CODES)),
    behind=st.lists(st.sampled_from(CODES), min_size=5, max_size=5),
    chosen=st.lists(st.sampled_from(CODES), min_size=5, max_size=5),
    rounds=st.integers(3, 8),
    seed=st.integers(0, 2**16),
)
@pytest.mark.sweep
def test_only_true_assignments_are_confirmed(
    signal: list[Signal], behind: list[str], chosen: list[str], rounds: int, seed: int
) -> None:
    """Whatever the values do, a place is never taken for another parameter's."""
    chance = random.Random(seed)
    real = dict(zip(BLOCK.slots, behind, strict=True))
    wanted = dict(zip(BLOCK.slots, chosen, strict=True))
    given = {
        # words of bits neither tremble nor go evenly
        code: Signal(item.base) if PROFILE[code].bits else item
        for code, item in zip(CODES, signal, strict=True)
    }
    proof = compared(real, given, rounds, chance, wanted)
    for slot, code in real.items():
        assert proof.returned_code(slot) in ("", code), (slot, code)
        # a fluctuating value may miss its own two readings by chance: its slot is not used then
        assert given[code].noise or not proof.excludes(slot, RAWS[code]), (slot, code)
        for other in CODES:
            if other != code:
                assert not proof.holds(slot, RAWS[other]), (slot, code, other)


def test_nothing_is_confirmed_before_a_comparison() -> None:
    reported: Callable[[str, int], bool] = SlotEvidence(PROFILE, BLOCK).holds
    assert not any(reported(slot, raw) for slot in BLOCK.slots for raw in (0, *RAWS.values(), 99))
