"""All periods of a line grow by one factor when together they do not fit."""

from __future__ import annotations

from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.bus.schedule.pace import SHARE, Pace


def test_line_with_spare_time_keeps_every_period() -> None:
    pace = Pace()
    assert pace.claim("a", 1, 0.02, 0.1) == 0.1
    assert pace.claim("b", 1, 0.05, 0.1) == 0.1


@given(st.lists(st.tuples(st.floats(0.001, 1.0), st.floats(0.05, 10.0)), min_size=1, max_size=31))
def test_periods_are_lengthened_by_one_factor_until_they_fit(
    wishes: list[tuple[float, float]],
) -> None:
    pace = Pace()
    for who, (seconds, period) in enumerate(wishes):
        pace.claim(who, who, seconds, period)
    held = [pace.claim(who, who, *wish) for who, wish in enumerate(wishes)]
    factors = [got / period for got, (_, period) in zip(held, wishes, strict=True)]
    assert factors == pytest.approx([factors[0]] * len(factors))
    load = sum(seconds / got for got, (seconds, _) in zip(held, wishes, strict=True))
    assert load <= SHARE * (1 + 1e-9)
    assert factors[0] == 1.0 or load == pytest.approx(SHARE)


def test_detached_client_releases_its_time() -> None:
    pace = Pace()
    pace.claim("a", 1, 0.09, 0.1)
    assert pace.claim("b", 1, 0.09, 0.1) == pytest.approx(0.2)
    pace.release("a")
    pace.release("never there")
    assert pace.claim("b", 1, 0.09, 0.1) == pytest.approx(0.1)


def test_same_read_of_two_programs_is_sent_once() -> None:
    pace = Pace()
    pace.others = {1: 0.8}
    assert pace.claim("a", 1, 0.08, 0.1) == pytest.approx(0.1)
    assert pace.claim("b", 2, 0.08, 0.1) == pytest.approx(0.1 * 1.6 / SHARE)


def test_wishes_are_summed_under_the_lock_under_which_they_change() -> None:
    pace, locked = Pace(), []

    class Wishes(dict[object, tuple[int, float]]):
        def values(self) -> Any:
            locked.append(pace._lock.locked())
            return super().values()

    pace._wishes = cast(Any, Wishes({"a": (1, 0.25), "b": (1, 0.5), "c": (2, 0.125)}))
    assert pace.own == {1: 0.75, 2: 0.125}
    assert locked == [True]
    assert not pace._lock.locked()
