"""Line faults on demand: each has the effect of its name, and a seed repeats them."""

from __future__ import annotations

import pytest

from tui.simulator import FaultRates
from tui.simulator.server.faults import FaultPlan
from tui.simulator.server.frames import is_sealed, seal

FRAME = seal(bytes.fromhex("020308002802580 1F40000".replace(" ", "")))


def hit(kind: str, seed: int = 1) -> list[tuple[float, bytes]]:
    return FaultPlan(FaultRates(**{kind: 1.0}), seed).carry(FRAME)  # type: ignore[arg-type]


def test_reply_passes_without_fault_rates() -> None:
    plan = FaultPlan(FaultRates(), 1)
    assert [plan.carry(FRAME) for _ in range(50)] == [[(0.0, FRAME)]] * 50


def test_lost_reply_is_not_sent() -> None:
    assert hit("lost") == []


def test_late_reply_is_delayed_within_its_range() -> None:
    plan = FaultPlan(FaultRates(late=1.0, late_by=(0.2, 0.3)), 1)
    for _ in range(20):
        [(delay, data)] = plan.carry(FRAME)
        assert 0.2 <= delay <= 0.3
        assert data == FRAME


def test_duplicated_reply_is_sent_twice() -> None:
    assert [data for _, data in hit("duplicated")] == [FRAME, FRAME]


@pytest.mark.parametrize("seed", range(20))
def test_truncated_reply_is_shortened(seed: int) -> None:
    [(_, data)] = hit("truncated", seed)
    assert 0 < len(data) < len(FRAME)
    assert FRAME.startswith(data)


@pytest.mark.parametrize("seed", range(20))
def test_corrupted_reply_differs_in_one_bit(seed: int) -> None:
    [(_, data)] = hit("corrupted", seed)
    assert sum((a ^ b).bit_count() for a, b in zip(data, FRAME, strict=True)) == 1
    assert not is_sealed(data)


@pytest.mark.parametrize("seed", range(20))
def test_noise_before_the_reply(seed: int) -> None:
    [(_, data)] = hit("noise", seed)
    assert data.endswith(FRAME)
    assert 1 <= len(data) - len(FRAME) <= 3


@pytest.mark.parametrize("seed", range(20))
def test_foreign_reply_is_valid_with_another_address(seed: int) -> None:
    [(_, data)] = hit("foreign", seed)
    assert is_sealed(data)
    assert data[0] != FRAME[0]
    assert data[1:-2] == FRAME[1:-2]


MIXED = FaultRates(
    late=0.1, lost=0.1, duplicated=0.1, truncated=0.1, corrupted=0.1, noise=0.1, foreign=0.1
)


def test_same_seed_repeats_all_faults() -> None:
    runs = []
    for seed in (7, 7, 8):
        plan = FaultPlan(MIXED, seed)
        runs.append([plan.carry(FRAME) for _ in range(300)])
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_faults_occur_at_their_rates() -> None:
    plan = FaultPlan(MIXED, 3)
    for _ in range(3000):
        plan.carry(FRAME)
    for kind, rate in MIXED.by_kind().items():
        assert 2000 * rate <= plan.hits[kind] <= 4000 * rate, plan.hits
