"""A device that is left alone: only what belongs to a stop goes out to it."""

from __future__ import annotations

import asyncio

import pytest

from tui.bus.api import Priority
from tui.bus.errors import RequestRefused

from .conftest import OpenLine
from .peer import PtyPeer, honest


async def test_only_a_stop_asks_a_device_that_is_left_alone(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        line.facts.hush(1, "It is being proved.")
        for priority in (Priority.FEED, Priority.OPERATOR_READ, Priority.POLL):
            with pytest.raises(RequestRefused, match="being proved"):
                await line.read(1, 5, priority=priority)
        with pytest.raises(RequestRefused, match="being proved"):
            await line.write(1, 5, [1])
        assert not peer.requests
        assert (await line.read(1, 5, priority=Priority.STOP)).words == (5,)
        assert (await line.read(2, 6)).words == (6,)
        line.facts.unhush(1)
        assert (await asyncio.wait_for(line.read(1, 7), 10.0)).words == (7,)
