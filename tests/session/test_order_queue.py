"""Orders to one drive: one after another, ended by a stop, none carried out late."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, cast

import pytest

from tui.bus.line import Line
from tui.drive.orders import OrderRefused
from tui.session.order_queue import BY_STOP, MOST_WAITING, Order, OrderQueue


class Loop:
    """Does the work in the test's own loop."""

    def spawn(self, work: Callable[[], Coroutine[Any, Any, None]], _: str) -> asyncio.Task[None]:
        return asyncio.get_running_loop().create_task(work())


class Told:
    """Orders that tell what became of them."""

    def __init__(self) -> None:
        self.queue = OrderQueue(cast("Line", Loop()), 1)
        self.said: list[str] = []

    def put(self, name: str, seconds: float = 0.0) -> None:
        async def carry_out() -> None:
            try:
                await asyncio.sleep(seconds)
            except asyncio.CancelledError:
                self.said.append(f"{name} cancelled")
                raise
            self.said.append(f"{name} done")

        self.queue.put(Order(carry_out, lambda why: self.said.append(f"{name} {why}")))


async def test_one_after_another() -> None:
    told = Told()
    told.put("a", 0.02)
    told.put("b")
    assert told.queue.busy
    await asyncio.sleep(0.1)
    assert told.said == ["a done", "b done"]
    assert not told.queue.busy


async def test_a_stop_ends_the_one_under_way_and_those_behind_it() -> None:
    told = Told()
    told.put("a", 5.0)
    told.put("b")
    await asyncio.sleep(0.01)
    told.queue.cancel()
    await asyncio.sleep(0.01)
    assert sorted(told.said) == ["a cancelled", f"b {BY_STOP}"]


async def test_an_order_behind_a_stop_neither_waits_for_ever_nor_brings_old_ones_along() -> None:
    told = Told()
    told.put("a")
    # the stop comes before the loop had time to begin
    told.queue.cancel()
    told.put("b")
    await asyncio.sleep(0.05)
    assert told.said == [f"a {BY_STOP}", "b done"]


async def test_too_many_are_refused() -> None:
    told = Told()
    told.put("a", 1.0)
    await asyncio.sleep(0)
    for number in range(MOST_WAITING):
        told.put(str(number))
    with pytest.raises(OrderRefused, match="Earlier orders"):
        told.put("one more")
    told.queue.cancel()
