"""Conditions that block a command, by the interlocks of each family that has some."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tui.drive.command_blocked import blocked_reason
from tui.drive.orders import MOVING_ORDERS, STOP_ORDERS
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart, Interlock, OrderId

LOCKED = ["atv21", "atv31", "atv312", "atv71"]
"""Families with interlocks."""


def interlocks(family: str) -> Iterator[tuple[Chart, Interlock]]:
    for chart in library.load(family).data.charts:
        for lock in chart.interlocks:
            yield chart, lock


def refusal(profile: Profile, chart: Chart, id: OrderId, raws: dict[str, int]) -> str:
    held = blocked_reason(profile, chart, id, raws)
    return held.text if held is not None else ""


def words_of(chart: Chart, lock: Interlock) -> dict[str, int]:
    """Words under which no interlock but this one could hold a command back, and it decides."""
    raws = {
        interlock.parameter: interlock.values[0]
        for interlock in chart.interlocks
        if not interlock.when
    }
    raws |= {
        interlock.parameter: raws.get(interlock.parameter, 0) | interlock.values[0]
        for interlock in chart.interlocks
    }
    return raws | {when.parameter: when.values[0] for when in lock.when}


@pytest.mark.parametrize("family", LOCKED)
def test_unread_word_blocks_every_moving_command(family: str) -> None:
    for chart, lock in interlocks(family):
        raws = {c: raw for c, raw in words_of(chart, lock).items() if c != lock.parameter}
        for id in lock.orders or MOVING_ORDERS:
            assert "was not read, and may block this" in refusal(
                library.load(family), chart, id, raws
            ), (
                id,
                lock.parameter,
            )


@pytest.mark.parametrize("family", LOCKED)
def test_no_interlock_blocks_a_stop(family: str) -> None:
    for chart, lock in interlocks(family):
        for id in STOP_ORDERS:
            assert refusal(library.load(family), chart, id, {}) == "", (id, lock.parameter)


@pytest.mark.parametrize("family", LOCKED)
def test_wrong_value_blocks_a_command_with_advice(family: str) -> None:
    for chart, lock in interlocks(family):
        raws = words_of(chart, lock)
        wrong = next(bit for bit in (1 << n for n in range(16)) if lock.mask & bit)
        raws[lock.parameter] = raws[lock.parameter] ^ wrong
        if raws[lock.parameter] & lock.mask in lock.values:
            continue
        for id in lock.orders or MOVING_ORDERS:
            assert refusal(library.load(family), chart, id, raws), (id, lock.parameter)
