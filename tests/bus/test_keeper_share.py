"""A line in its keeper: its alarm, and stops before the line is quiet."""

from __future__ import annotations

import asyncio
import os
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from tests.limits import ALARM_AFTER
from tui.bus.api import Priority
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.model import LineStatus
from tui.bus.program import KEEPER, Program, pid_namespace
from tui.bus.share import keeper_share, keeping, sharing
from tui.bus.share.keeper_share import PROCESS_ENDS_WITHIN, KeeperShare, Keeping
from tui.bus.share.messages import VERSION, Goodbye, packed
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


class Unneeded:
    """A keeper's share without a line, and the time that passes while it waits."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self.cares_until, self.ends = 100.0, 0.0, 0
        monkeypatch.setattr(sharing, "OwnerLock", Mock())
        waits = SimpleNamespace(sleep=self._sleep, Event=asyncio.Event)
        monkeypatch.setattr(keeper_share, "asyncio", waits)
        inside: Any = Mock(clock=lambda: self.now)
        inside.dispatcher.proof.repeats_wait = False
        self.proof = inside.dispatcher.proof
        place = SharePlace("usb7", Path("/locks"), ())
        lock = Keeping(3, (), self._end, lambda: self.now < self.cares_until, lambda _: None)
        self.it = KeeperShare(lock, place, inside)
        self.server: Any = SimpleNamespace(serves=False, stops_wait=False)

    async def _sleep(self, seconds: float) -> None:
        self.now += seconds

    def _end(self) -> None:
        self.ends += 1


@pytest.mark.parametrize(
    ("cares", "repeats", "attached", "stops", "ends", "waited"),
    [
        (0.0, False, False, False, True, 0.0),
        (0.5, False, False, False, True, 0.5),
        (9.0, False, False, False, False, 1.0),
        (0.0, True, False, False, False, 1.0),
        (0.0, False, True, False, False, 0.0),
        (0.0, False, False, True, False, 1.0),
    ],
)
async def test_keeper_makes_way_unless_it_is_needed(
    cares: float, repeats: bool, attached: bool, stops: bool, ends: bool, waited: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(keeper_share, "LEAVE_WITHIN", 1.0)
    bench = Unneeded(monkeypatch)
    bench.cares_until = bench.now + cares
    bench.proof.repeats_wait = repeats
    bench.server.serves, bench.server.stops_wait = attached, stops
    bench.it._server = bench.server
    assert await bench.it.makes_way() is ends
    assert bench.ends == ends
    assert waited <= bench.now - 100.0 < waited + 0.02


@pytest.mark.parametrize(("taken_at", "taken"), [(0, True), (3, True), (1000, False)])
@pytest.mark.parametrize("reached", [True, False])
def test_line_is_taken_from_a_keeper_that_ends(
    taken_at: int, taken: bool, reached: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, tries, connections = [100.0], list[float](), list[Any]()

    def reach(path: Path, within: float) -> Any:
        connection = Mock()
        connection.recv.side_effect = [b"a", b"b", b""]
        connections.append((str(path), within, connection))
        if not reached:
            raise OSError("its socket is not there")
        return nullcontext(connection)

    def take() -> bool:
        tries.append(now[0])
        return len(tries) > taken_at

    monkeypatch.setattr(keeping, "reached", reach)
    monkeypatch.setattr(keeping, "monotonic", lambda: now[0])
    monkeypatch.setattr(keeping, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    lock: Any = SimpleNamespace(take=take)
    keeper = Owner(VERSION, Program("k", KEEPER, 5), "/run/k")
    assert keeping.ends_unneeded(keeper, lock) is taken
    assert now[0] - 100.0 == pytest.approx(0.01 * min(taken_at, 100), abs=0.011)
    [(path, within, connection)] = connections
    assert (path, within) == ("/run/k", 1.0)
    if reached:
        connection.sendall.assert_called_once_with(packed(Goodbye()))
        assert connection.recv.call_count == 3, "until it closes the connection"
    assert not keeping.ends_unneeded(Owner(VERSION, Program("p", "panel", 5), "/run/p"), lock)
    assert len(connections) == 1


@pytest.mark.parametrize(
    ("folder", "others", "found"),
    [
        ("/opt/panel", "", "/opt/panel"),
        ("/opt/panel", "/a:/b", "/a:/b:/opt/panel"),
        ("/usr/lib/python3/dist-packages", "/a", "/a"),
        ("/opt/x/.venv/lib/site-packages", None, None),
    ],
)
def test_keeper_finds_this_package_and_the_folders_of_this_program(
    folder: str, others: str | None, found: str | None, monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    environment = {
        "DRIVEPANEL_STATE": "state", "DRIVEPANEL_CONFIG": "", "XDG_RUNTIME_DIR": "/run/x",
        "HOME": "home",
    }  # fmt: skip
    if others is not None:
        environment["PYTHONPATH"] = others
    monkeypatch.setattr(keeping, "__file__", f"{folder}/tui/bus/share/keeping.py")
    monkeypatch.setattr(os, "environ", environment)
    made = keeping._environment()
    assert made == {
        **environment, "DRIVEPANEL_STATE": str(tmp_path / "state"),
        **({} if found is None else {"PYTHONPATH": found}),
    }  # fmt: skip
    assert environment["DRIVEPANEL_STATE"] == "state", "its own is not changed"


async def test_program_that_attaches_ends_the_wait_for_a_lost_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sharing, "OwnerLock", Mock())
    inside: Any = Mock()
    inside.state.return_value.status = LineStatus.LOST
    inside.dispatcher.proof.repeats_wait = False
    keep = Keeping(3, (), lambda: None, lambda: True, lambda _: None)
    share = KeeperShare(keep, SharePlace("usb7", Path("/locks"), ()), inside)
    waiting = asyncio.ensure_future(share.pause(60.0))
    await asyncio.sleep(0)
    share.moved(arrived=False)
    for _ in range(5):
        await asyncio.sleep(0)
    assert not waiting.done(), "one that leaves does not end it"
    share.moved(arrived=True)
    await asyncio.wait_for(waiting, 10.0)
