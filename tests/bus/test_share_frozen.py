"""Frozen programs on a line: their drives are free, their pending writes cancelled."""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Callable
from typing import Any

import pytest

from tests.limits import SILENT_OWNER
from tests.line_events import on_event
from tui.bus.api import LineStatus
from tui.bus.errors import LineError
from tui.bus.line_events import ControlDenied, ProgramLost, StateChanged
from tui.bus.share.client import STOOD_STILL

from .conftest import Share
from .peer import PtyPeer, eventually, honest
from .sharing import frozen, knows

RUN, OTHER = 15, 4


async def come(condition: Callable[[], bool]) -> None:
    """Wait for something while the test's own tasks go on."""
    await asyncio.to_thread(eventually, condition)


async def test_frozen_client_counts_as_gone_and_loses_its_drives(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other, third = (lines.open(name) for name in ("watch", "run", "panel"))
        gone: list[str] = []
        denied: list[str] = []
        on_event(owner.facts, ProgramLost, lambda event: gone.append(event.program.name))
        on_event(
            other.facts, ControlDenied, lambda event: denied.append(f"{event.device}: {event.why}")
        )
        assert other.facts.claim(1) == ""
        eventually(lambda: owner.facts.commander(1) is not None)
        with frozen(other):
            run = asyncio.create_task(other.write(1, 1, [RUN]))
            await come(lambda: gone == ["run"])
            # another program gets the drive, and is not disturbed
            await come(lambda: third.facts.commander(1) is None)
            assert third.facts.claim(1) == ""
            await third.write(1, 1, [OTHER])
        with pytest.raises(LineError):
            await run
        await come(lambda: denied == [f"1: {STOOD_STILL}"])
        await come(lambda: knows(owner, "run"))
        assert peer.words_written == [(1, OTHER)]
        await come(lambda: other.facts.commander(1) == third.facts.me)
        assert (await other.read(1, 5)).words == (5,)


async def test_owner_that_was_suspended_keeps_its_clients(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("watch"), lines.open("run")
        gone: list[str] = []
        on_event(owner.facts, ProgramLost, lambda event: gone.append(event.program.name))
        other.facts.claim(1)
        eventually(lambda: owner.facts.commander(1) is not None)
        with frozen(other):
            with frozen(owner):
                await asyncio.sleep(2.6)
            # by now it has checked the heartbeat twice
            await asyncio.sleep(0.5)
        await other.read(1, 5)
        await asyncio.sleep(0.5)
        assert gone == []
        assert owner.facts.commander(1) is not None


async def test_idle_client_is_kept(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, _ = lines.open("watch"), lines.open("panel")
        gone: list[str] = []
        on_event(owner.facts, ProgramLost, lambda event: gone.append(event.program.name))
        await asyncio.sleep(2.8)
        assert gone == []


async def test_hung_disk_delays_neither_the_line_nor_its_heartbeat(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    goes_on, hangs, access = threading.Event(), threading.Event(), os.access

    def hanging(*args: Any) -> bool:
        hangs.set()
        goes_on.wait(60)
        return access(*args)

    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("watch"), lines.open("panel")
        monkeypatch.setattr("tui.bus.share.greeting.os.access", hanging)
        try:
            await come(hangs.is_set)
            reasons: list[str] = []
            on_event(other.facts, StateChanged, lambda event: reasons.append(event.state.reason))
            for count in range(1, 8):
                assert (await other.read(1, 5, count)).words == tuple(range(5, 5 + count))
                await asyncio.sleep(SILENT_OWNER / 4)
            assert reasons == []
            assert owner.state.status is LineStatus.CONNECTED
        finally:
            goes_on.set()
