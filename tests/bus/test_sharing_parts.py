"""Parts of the sharing of a line: its owner, all attempts with their times, and all messages.

The lock, the owner and its client are substitutes, and time passes only while the sharing waits.
"""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import AsyncMock, Mock

import pytest

from tests.limits import STOP_DISK_WITHIN
from tui.bus.errors import LineLost, NotShared
from tui.bus.link import SerialLink
from tui.bus.model import LineStatus
from tui.bus.program import KEEPER, Program, pid_namespace
from tui.bus.share import sharing as sharings
from tui.bus.share.client import OwnerAway
from tui.bus.share.greeting import Greeting
from tui.bus.share.messages import VERSION, Goodbye, packed
from tui.bus.share.place import Owner, SharePlace
from tui.bus.share.sharing import DISK_WITHIN, UNKEPT, Sharing
from tui.bus.shared_state import SharedState

ME = Program("me", "panel", 7)
PLACE = SharePlace("usb7", Path("/run/locks"), (Path("/run/lines"),))
HOLDER = Owner(VERSION, Program("o", "run", 8), "/run/lines/o")
STARTS = Owner(VERSION, Program("starting", KEEPER, 9), "")
BEGUN = 100.0


class Bench:
    """A sharing, and in their order the steps that it took with their times."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, keeper: bool = False) -> None:
        self.now = BEGUN
        self.did: list[tuple[object, ...]] = []
        self.reports: list[tuple[float, LineStatus, str]] = []
        self.takes: list[bool] = []
        self.owners: list[Owner | None] = []
        self.serves: list[tuple[bool, float]] = []
        """By attachment: whether the owner took this program in, and for how long."""
        self.disk: Exception | None = None
        self.starts: Any = lambda started: started(55)
        self.lock = SimpleNamespace(
            held=False, deaths=(), descriptor=3, take=self._take, give_back=self._note("give back"),
            hand_over=self._note("hand over"), tell=self._note("tell"),
        )  # fmt: skip
        monkeypatch.setattr(sharings, "OwnerLock", lambda place: self.lock)
        monkeypatch.setattr(sharings, "owner_of", lambda place: self._owner())
        monkeypatch.setattr(sharings, "opened_beside", self._beside)
        monkeypatch.setattr(sharings, "ShareClient", self._client)
        monkeypatch.setattr(sharings, "ShareServer", self._server)
        monkeypatch.setattr(sharings, "start_keeper", self._start)
        waits = SimpleNamespace(sleep=self._sleep, Event=asyncio.Event)
        monkeypatch.setattr(sharings, "asyncio", waits)
        self.inside = Mock(link=SerialLink("/dev/x"), facts=SharedState(ME))
        self.inside.clock = lambda: self.now
        self.inside.timing.late_reply = 2.0
        self.inside.dispatcher.proof.doubt = self._note("doubt until")
        self.it = Sharing(PLACE, self.inside, keeper=keeper)
        self.server: Any = None
        self.server_error: OSError | None = None

    def _note(self, name: str) -> Any:
        return lambda *with_: self.did.append((name, *with_))

    def _owner(self) -> Owner | None:
        return self.owners.pop(0) if len(self.owners) > 1 else self.owners[0]

    def _take(self) -> bool:
        taken = self.takes.pop(0) if self.takes else False
        self.lock.held = taken
        return taken

    async def _beside(self, path: str, find: Any, drop: Any, within: float) -> Any:
        self.did.append(("find", path, within))
        drop(None)
        assert self.did.pop() == ("hand over",), "a lock that comes too late is released"
        if self.disk is not None:
            raise self.disk
        return find()

    async def _sleep(self, seconds: float) -> None:
        self.now += seconds

    def _client(self, *given: Any) -> Any:
        inside, owner, say = given
        assert (inside, say) == (self.inside, self.say)
        taken_in, seconds = self.serves.pop(0)
        client = SimpleNamespace(
            taken_in=False, watching=SimpleNamespace(frozen=seconds == 7.0), again=None,
            pass_on=lambda message: message == b"yes",
        )  # fmt: skip

        async def serve() -> None:
            client.taken_in = taken_in
            state = (self.it.frozen, self.it.pass_on(b"yes"), self.it.pass_on(b"no"))
            self.did.append(("attend", owner.program.name, client.again, *state, self.it.starts))
            self.now += seconds
            if not seconds:
                raise OwnerAway

        client.serve = serve
        return client

    def _server(self, *given: Any) -> Any:
        assert given == (PLACE, self.lock, self.inside, self.it)

        async def start() -> None:
            self.did.append(("serve",))
            if self.server_error is not None:
                raise self.server_error

        async def close() -> None:
            self.did.append(("close server",))

        self.server = SimpleNamespace(
            start=start, close=close, tell_state=self._note("tell the state")
        )
        return self.server

    def _start(self, order: Any, descriptor: int, started: Any) -> Any:
        self.did.append(("start", order.line, order.key, order.before, descriptor))
        self.starts(started)
        return lambda: True

    def say(self, status: LineStatus, text: str, error: object) -> None:
        assert error is None
        self.reports.append((round(self.now - BEGUN, 2), status, text))

    async def own(self) -> None:
        await self.it.own(self.say)


async def test_free_line_is_owned_and_served_once(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.takes, bench.owners = [True], [None]
    await bench.own()
    assert bench.did == [
        ("find", str(PLACE.lock_path), STOP_DISK_WITHIN),
        ("tell", Owner(VERSION, ME, "", 0.0, {})),
        ("serve",),
        ("doubt until", 0.0),
    ]
    del bench.did[:]
    await bench.own()
    assert bench.did == bench.reports == []
    bench.it.tell_state()
    assert bench.did.pop() == ("tell the state",)
    assert not bench.it.frozen
    assert not bench.it.pass_on(b"yes")
    assert not await bench.it.makes_way()
    await bench.it.close(0.0)
    assert bench.did == [("close server",), ("give back", None)]
    bench.it.tell_state()
    assert len(bench.did) == 2, "it has no server any more"


@pytest.mark.parametrize(
    ("owner", "who", "seconds"),
    [(None, "another program", 3.0), (HOLDER, "run (pid 8)", 3.0),
     (STARTS, "keeper (pid 9)", 20.0)],
)  # fmt: skip
async def test_owner_that_never_answers_is_given_up_after_its_time(
    owner: Owner | None, who: str, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.share.place.has_ended", lambda program: False)
    bench = Bench(monkeypatch)
    bench.owners, bench.serves = [owner], [(False, 0.0)] * 2000
    with pytest.raises(NotShared) as refused:
        await bench.own()
    assert str(refused.value) == f"{who} holds the line and cannot be reached. Close it."
    assert seconds < bench.now - BEGUN < seconds + 0.05
    assert bench.reports == [], "it was never attached"
    assert bench.it.starts == (owner is STARTS and bench.now < BEGUN + 20.0)
    looks = [step for step in bench.did if step[0] == "find"]
    assert len(looks) == pytest.approx(seconds / 0.02, abs=3)


async def test_time_without_an_owner_is_reported_once_and_after_each_attachment(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    bench = Bench(monkeypatch)
    bench.owners = [HOLDER, *[None] * 40, HOLDER, *[None] * 40, None]
    bench.serves = [(True, 7.0), (True, 5.0)]
    bench.takes = [False] * 82 + [True]
    await bench.own()
    away = "The process that held the line has ended; the next one starts."
    assert bench.reports == [
        (7.52, LineStatus.CONNECTING, away),
        (7.0 + 0.8 + 5.0 + 0.52, LineStatus.CONNECTING, away),
    ]
    assert [step for step in bench.did if step[0] == "attend"] == [
        ("attend", "run", False, True, True, False, False),
        ("attend", "run", True, False, True, False, False),
    ]
    assert bench.did[-1] == ("doubt until", 0.0)
    assert caplog.messages == ["run (pid 8) no longer owns the line"] * 2


@pytest.mark.internal_errors
@pytest.mark.parametrize("keeper", [True, False])
@pytest.mark.parametrize(
    ("error", "why"),
    [(OSError(13, "Permission denied"), "Permission denied"), (OSError("odd"), "odd"),
     (LineLost("lost"), "the system does not answer")],
)  # fmt: skip
async def test_line_whose_lock_cannot_be_used_is_held_without_it(
    error: Exception, why: str, keeper: bool, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    bench = Bench(monkeypatch, keeper=keeper)
    notices: list[Any] = []
    bench.inside.facts.events.subscribe(notices.append)
    bench.disk = error
    await bench.own()
    within = DISK_WITHIN if keeper else STOP_DISK_WITHIN
    assert bench.did == [("find", str(PLACE.lock_path), within)]
    assert caplog.messages == [f"the line cannot be shared: {why}"]
    text = UNKEPT.format(why=f"has no folder that can be used ({why})") if keeper else ""
    assert bench.inside.facts.unkept == text
    assert [(notice.device, notice.text) for notice in notices] == ([(0, text)] if keeper else [])
    await bench.own()
    await bench.it.close(1.0)
    # a thread that still uses the lock gives it back
    assert bench.did[1:] == (
        []
        if isinstance(error, LineLost)
        else [("give back", Owner(VERSION, ME, "", BEGUN + 1.0, {}))]
    )


async def test_keeper_gets_the_lock_and_this_program_waits_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = Bench(monkeypatch, keeper=True)
    left = Owner(VERSION, Program("x", KEEPER, 5), "/run/old", 105.0, {3: 90.0})
    bench.takes, bench.owners = [True, False, True], [left, left, HOLDER, left]
    bench.serves = [(False, 0.0), (True, 1.0)]
    bench.inside.facts.departed = (HOLDER.program,)
    bench.inside.facts.unkept = "as before"
    monkeypatch.setattr("tui.bus.stop_counts.time.monotonic", lambda: BEGUN)

    def hand_over() -> None:
        bench.lock.held = False
        bench.did.append(("hand over",))

    def start(started: Any) -> None:
        assert not bench.it.starts
        started(55)
        bench.lock.deaths = (1.0, 2.0, 3.0)

    bench.lock.hand_over, bench.starts = hand_over, start
    await bench.own()
    keeper = Program("starting", KEEPER, 55, space=pid_namespace())
    find = ("find", str(PLACE.lock_path), DISK_WITHIN)
    assert bench.did == [
        find,
        ("start", "serial:/dev/x,19200,8E1", "usb7", (HOLDER.program, ME), 3),
        # the last owner was killed, so that a reply to it may come
        ("tell", Owner(VERSION, keeper, "", BEGUN + 2.0, {3: 90.0})),
        ("hand over",),
        ("attend", "keeper", False, False, True, False, True),
        find,
        ("attend", "run", False, False, True, False, False),
        find,
        ("tell", Owner(VERSION, ME, "", BEGUN + 1.02 + 2.0, {3: 90.0})),
        ("serve",),
        ("doubt until", BEGUN + 1.02 + 2.0),
    ]
    assert bench.inside.facts.unkept == UNKEPT.format(why="has died 3 times within a minute")


@pytest.mark.internal_errors
@pytest.mark.parametrize(
    ("error", "why"), [(OSError(12, "No memory"), "No memory"), (OSError("odd"), "odd")]
)
async def test_program_without_a_keeper_holds_the_line_itself(
    error: OSError, why: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench(monkeypatch, keeper=True)
    bench.takes, bench.owners = [True], [None]
    bench.starts = Mock(side_effect=error)
    await bench.own()
    assert bench.inside.facts.unkept == UNKEPT.format(why=f"could not be started ({why})")
    assert bench.did[-2:] == [("serve",), ("doubt until", 0.0)]
    assert caplog.messages == [f"the keeper of the line could not be started: {error}"]
    assert not bench.it.starts


@pytest.mark.internal_errors
async def test_keeper_is_not_started_once_the_line_is_held_without_the_lock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench = Bench(monkeypatch, keeper=True)
    bench.disk, bench.takes, bench.owners = LineLost("slow"), [True], [None]
    await bench.own()
    assert bench.it._find_holder() == (
        None, "could not be started (it comes too late: this program holds the line)"
    )  # fmt: skip


@pytest.mark.internal_errors
async def test_program_that_cannot_serve_others_is_alone(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench(monkeypatch)
    bench.inside.facts.set_programs((ME, HOLDER.program))
    bench.takes, bench.owners, bench.server_error = [True], [None], OSError("full")
    await bench.own()
    assert bench.inside.facts.programs == (ME,)
    assert caplog.messages == ["the line cannot be shared: full"]
    assert bench.did[-1] == ("doubt until", 0.0)


@pytest.mark.parametrize(
    ("quiet_until", "socket", "doubted"),
    [(BEGUN + 5, "", 5.0), (BEGUN + 500, "", 30.0), (BEGUN - 5, "", -5.0), (BEGUN + 5, "/s", 2.0)],
)
async def test_replies_are_doubted_as_long_as_the_last_owner_says(
    quiet_until: float, socket: str, doubted: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(monkeypatch)
    bench.takes, bench.owners = [True], [Owner(VERSION, ME, socket, quiet_until)]
    await bench.own()
    until = max(0.0, BEGUN + doubted)
    assert bench.did[-1] == ("doubt until", until)
    await bench.it.close(1.0)
    rest = max(1.0, until - BEGUN)
    assert bench.did[-1:] == [("give back", Owner(VERSION, ME, "", BEGUN + rest))]


@pytest.mark.parametrize(("quiet", "rest"), [(0.0, 0.0), (-1.0, 0.0), (4.0, 4.0)])
async def test_closed_port_leaves_its_quiet_time(
    quiet: float, rest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(monkeypatch)
    bench.it.rest(quiet)
    bench.it.rest(quiet / 2)
    await bench.it.close(0.0)
    last = Owner(VERSION, ME, "", BEGUN + rest) if rest else None
    assert bench.did == [("give back", last)]
    await bench.it.pause(0.3)
    assert bench.now == BEGUN + 0.3


async def test_stops_are_left_to_the_next_owner(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.inside.facts.give_stop((3,), "space")
    stopped = bench.inside.facts.stops.late_times
    await bench.it.close(0.0)
    assert bench.did == [("give back", Owner(VERSION, ME, "", 0.0, stopped))]


@pytest.mark.parametrize("free", [True, False])
async def test_owner_makes_way_for_a_program_that_says_goodbye(free: bool) -> None:
    holder, reader = Mock(makes_way=AsyncMock(return_value=free)), asyncio.StreamReader()
    reader.feed_data(packed(Goodbye()))
    greeting = Greeting(Mock(), None, holder, Mock())
    assert await greeting.heard(reader, Mock(), {}) is None
    holder.makes_way.assert_awaited_once_with()
