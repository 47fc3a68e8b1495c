"""A line in its keeper: its alarm, and stops before the line is quiet."""

from __future__ import annotations

import asyncio
import os
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.limits import ALARM_AFTER
from tui.bus.api import Priority
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.program import KEEPER, Program, pid_namespace
from tui.bus.share.keeper_share import PROCESS_ENDS_WITHIN, KeeperShare, Keeping
from tui.bus.share.messages import VERSION
from tui.bus.share.place import STARTING, Owner, OwnerLock, SharePlace, owner_of

from .peer import PtyPeer, honest
from .sharing import QUICK, SharedLines, place_in

QUIET = 6.0
"""Seconds in which a reply to the previous keeper may still arrive."""


def keeper_line(
    path: str,
    place: SharePlace,
    *,
    quiet: float = 0.0,
    end: Callable[[], None] = lambda: None,
    alarm: Callable[[float], None] = lambda _: None,
) -> Line:
    """The line of a keeper that has inherited its lock."""
    lock = OwnerLock(place)
    assert lock.take()
    lock.tell(Owner(VERSION, Program(STARTING, KEEPER, os.getpid()), "", quiet))
    keeping = Keeping(os.dup(lock.descriptor), (), end, lambda: False, alarm)
    lock.hand_over()
    me = Program("k", KEEPER, os.getpid())
    share = partial(KeeperShare, keeping)
    return Line(SerialLink(path), timing=QUICK, place=place, program=me, share=share)


async def test_keeper_that_cannot_listen_leaves_its_pid_namespace(tmp_path: Path) -> None:
    """Another container must not take its number for that of a process there."""
    place, ended = place_in(tmp_path), threading.Event()
    (tmp_path / "run").touch()
    keeper = keeper_line("/dev/null", place, end=ended.set)
    keeper.open()
    try:
        assert await asyncio.to_thread(ended.wait, 10.0)
        left = owner_of(place)
        assert left is not None
        assert (left.program.id, left.program.space) == (STARTING, pid_namespace())
    finally:
        await asyncio.to_thread(keeper.close)


async def test_keeper_renews_its_alarm_and_sends_early_stops(tmp_path: Path) -> None:
    place, alarms = place_in(tmp_path), list[float]()
    quiet = time.monotonic() + QUIET
    with PtyPeer(honest) as peer:
        keeper = keeper_line(peer.path, place, quiet=quiet, alarm=alarms.append)
        lines = SharedLines(tmp_path, keeper.link)
        try:
            keeper.open()
            panel = lines.open("panel")
            stopped = await panel.write(1, 1, [0], priority=Priority.STOP)
            assert stopped < quiet
        finally:
            lines.close()
            await asyncio.to_thread(keeper.close)
    assert set(alarms[:-1]) == {ALARM_AFTER}
    assert alarms[-1] == PROCESS_ENDS_WITHIN
