"""A line in its keeper: its alarm, and stops before the line is quiet."""

from __future__ import annotations

import asyncio
import os
import time
from functools import partial
from pathlib import Path

from tui.bus.api import Priority
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.program import KEEPER, Program
from tui.bus.share.keeper_share import ALARM_AFTER, PROCESS_ENDS_WITHIN, KeeperShare, Keeping
from tui.bus.share.messages import VERSION
from tui.bus.share.place import STARTING, Owner, OwnerLock

from .peer import PtyPeer, honest
from .sharing import QUICK, SharedLines, place_in

QUIET = 6.0
"""Seconds in which a reply may still come to the keeper before."""


async def test_a_keeper_renews_its_alarm_and_sends_early_stops(tmp_path: Path) -> None:
    place, alarms = place_in(tmp_path), list[float]()
    lock = OwnerLock(place)
    assert lock.take()
    quiet = time.monotonic() + QUIET
    lock.tell(Owner(VERSION, Program(STARTING, KEEPER, os.getpid()), "", quiet))
    keeping = Keeping(os.dup(lock.descriptor), (), lambda: None, lambda: False, alarms.append)
    lock.hand_over()
    with PtyPeer(honest) as peer:
        me = Program("k", KEEPER, os.getpid())
        keeper = Line(
            SerialLink(peer.path),
            timing=QUICK,
            place=place,
            program=me,
            share=partial(KeeperShare, keeping),
        )
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
