"""A device whose polling is paused: only requests of a stop are sent to it."""

from __future__ import annotations

import asyncio

import pytest

from tui.bus.api import Priority
from tui.bus.errors import RequestRefused
from tui.bus.line_events import DevicesStopped, NoticeReceived
from tui.bus.program import Program
from tui.bus.shared_state import SharedState

from .conftest import OpenLine, Share
from .peer import PtyPeer, eventually, honest


async def test_paused_device_is_sent_stops_only(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        line.facts.pause_polling(1, "It is being proved.")
        for priority in (Priority.FEED, Priority.OPERATOR_READ, Priority.POLL):
            with pytest.raises(RequestRefused, match="being proved"):
                await line.read(1, 5, priority=priority)
        with pytest.raises(RequestRefused, match="being proved"):
            await line.write(1, 5, [1])
        assert not peer.requests
        assert (await line.read(1, 5, priority=Priority.STOP)).words == (5,)
        assert (await line.read(2, 6)).words == (6,)
        line.facts.resume_polling(1)
        assert (await asyncio.wait_for(line.read(1, 7), 10.0)).words == (7,)


@pytest.mark.parametrize("stopper", ["panel", "prove", "watch"])
async def test_stop_ends_the_pause_of_polling(share: Share, stopper: str) -> None:
    """A stop follows the device to standstill, and does not wait for the program that paused it."""
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        programs = {name: lines.open(name) for name in ("panel", "prove", "watch")}
        programs["prove"].facts.pause_polling(1, "It is being proved.")
        programs["prove"].facts.pause_polling(2, "It is being proved.")
        await asyncio.to_thread(eventually, lambda: 1 in programs["watch"].facts.paused)
        programs[stopper].facts.give_stop([1], "the stop key")
        assert (await programs[stopper].read(1, 5)).words == (5,)
        await asyncio.to_thread(
            eventually, lambda: all({*program.facts.paused} == {2} for program in programs.values())
        )


def test_stop_by_another_program_ends_the_pause_of_its_devices_only() -> None:
    facts = SharedState()
    for device in (1, 2, 3):
        facts.pause_polling(device, "It is being proved.")
    facts.events.emit(NoticeReceived(3, "no stop"))
    facts.events.emit(DevicesStopped((1, 2), "the stop key", Program("a", "panel", 1)))
    assert {*facts.paused} == {3}
