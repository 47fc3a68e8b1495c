"""Wait of a new holder for programs to reconnect, by the clock of the test."""

from __future__ import annotations

import asyncio

import pytest

from tests.limits import BACK_AT_LATEST, BACK_WITHIN
from tui.bus.share.heartbeat import BACK_LOOK, programs_back


class StarvedLoop:
    """A loop whose timers run late by this time."""

    def __init__(self, late: float) -> None:
        self.late = late
        self.now = 0.0

    async def pause(self, seconds: float) -> None:
        self.now += seconds + self.late

    def waited(self, *, greets: bool = False) -> float:
        """Seconds after which programs that have not reconnected count as gone."""
        asyncio.run(programs_back(lambda: greets, lambda: self.now, self.pause))
        return self.now


def test_owner_waits_the_normal_time_for_programs_to_return() -> None:
    assert StarvedLoop(0.0).waited() == pytest.approx(BACK_WITHIN, abs=BACK_LOOK)


def test_wait_for_programs_excludes_time_when_the_loop_hung() -> None:
    quota = 0.9 * BACK_LOOK
    assert StarvedLoop(quota).waited() == pytest.approx(1.9 * BACK_WITHIN, abs=2 * BACK_LOOK)


def test_wait_is_extended_for_a_program_that_has_connected() -> None:
    assert StarvedLoop(0.0).waited(greets=True) == pytest.approx(BACK_AT_LATEST, abs=BACK_LOOK)


def test_wait_for_programs_is_bounded_on_a_slow_computer() -> None:
    stall = 1.0
    assert StarvedLoop(stall).waited() <= BACK_AT_LATEST + BACK_LOOK + stall
