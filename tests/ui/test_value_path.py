"""Number of modules and carriers that a value passes, from the transport to the line on Monitor."""

from __future__ import annotations

import asyncio
from threading import Event
from typing import Any

import pytest

from tests.hops import Trail
from tui.session.connect.open_line import open_line as really_open
from tui.simulator import Simulation

from . import test_command_flows as flows
from .test_flows import shown, until

RAW, SHOWN = 2513, "251.3"
"""The mains voltage of the drive: no other register or text is like it."""
MOST_MODULES, MOST_CARRIERS = 9, 6
SECONDS = 1.5
"""Some cycles of the monitor, and looks of the screen."""
MOST_WAITS = 20
"""Waits of that many seconds until the value has got there, at most."""
FIRST, LAST = "bus/transport/tcp", "widgets/lines"
HANDED_OVER = {("bus/schedule/dispatcher", "bus/line"): "Reply"}
"""The answer of a job, which is a future: the loop hands it over, not a call."""


@pytest.mark.sweep
async def test_value_passes_few_modules_and_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    class Mains(Simulation):
        def start(self) -> None:
            super().start()
            drive: Any = self.drive(1)
            mains = RAW / 10 / drive._body.rating.voltage
            kind = type(drive._load)
            drive._load.__class__ = type("Load", (kind,), {"mains": property(lambda _: mains)})

    monkeypatch.setattr(flows, "Simulation", Mains)
    # a program that holds its line itself: through a keeper, a message takes the place of the wire
    monkeypatch.setattr(
        flows, "open_line", lambda text, **how: really_open(text, **{**how, "keeper": False})
    )
    trail, found = Trail(RAW, SHOWN, dict(HANDED_OVER)), Event()

    async def in_the_loop_of_the_line() -> None:
        with trail.watching():
            await asyncio.to_thread(found.wait, MOST_WAITS * SECONDS + 60)

    async with flows.bench("atv71") as bench:
        assert bench.app.opened is not None
        bench.app.opened.line.spawn(in_the_loop_of_the_line, "watching")
        with trail.watching():
            # all values, in the place of the curve: a line that stays the same is not drawn again
            await bench.pilot.press("tab")
            await until(bench.pilot, lambda: SHOWN in shown(bench.app, "curve"))
            # on a busy machine the first cycles take long, as each call is recorded
            for _ in range(MOST_WAITS):
                await asyncio.sleep(SECONDS)
                if trail.way(FIRST, LAST):
                    break
        found.set()
    way = trail.way(FIRST, LAST)
    carriers = trail.carriers(way)
    assert way, f"the value does not get there: {trail.edges}"
    assert len(way) <= MOST_MODULES, way
    assert len(carriers) <= MOST_CARRIERS, carriers
