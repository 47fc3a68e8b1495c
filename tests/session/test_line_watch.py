"""Keeping drives with a timeout alive: read in time, before polls, and reported."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import suppress
from dataclasses import replace
from threading import Thread
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.waiting import until
from tui.bus.api import DeviceState, LineWorker, Priority
from tui.bus.errors import LineLost, NoAnswer
from tui.bus.keep_alive import KeepAlive
from tui.drive.chart import ENABLED_KINDS
from tui.session.connect.address_prober import known_profiles
from tui.session.drive import DriveSession
from tui.session.monitor import line_watch as line_watches
from tui.session.monitor.line_watch import GLANCE, LineWatch
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.unknown_drive_poller import UnknownDrivePoller
from tui.session.read.presence import UNKNOWN_TIMEOUT
from tui.session.timeout_report import TimeoutWatch

from .fakes import OneDrive, parameter, profile_of

STATE, TIME_OUT = 10, 50
PROFILE = profile_of(
    parameter("STATE", STATE),
    parameter("TTO", TIME_OUT, unit="s", scale="0.1"),
    communication_fault={
        "timeout": "TTO",
        "off": 0,
        "starts": "With the first request.",
        "source": "manual",
    },
    charts=[
        {
            "id": "drivecom",
            "name": "Drivecom",
            "kind": "drivecom",
            "status": "STATE",
            "states": [{"id": "run", "name": "Run", "kind": "running", "mask": 3, "value": 1}],
        }
    ],
)


class BackgroundListener(OneDrive):
    """Record the priority of reads of the drive, and keep its workers."""

    def __init__(self, tenths: int) -> None:
        super().__init__({STATE: 1, TIME_OUT: tenths})
        self.heard: float | None = None
        self.looked: list[tuple[int, Priority]] = []
        self.workers: list[LineWorker] = []
        self.answers = asyncio.Event()
        """True if polls are answered by now."""
        self.answers.set()

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        self.looked.append((registers.start, priority))
        if priority is Priority.POLL:
            await self.answers.wait()
        self.heard = time.monotonic()

    def device_state(self, device: int) -> DeviceState:
        return replace(super().device_state(device), heard=self.heard)

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        self.workers.append(super().spawn(work, name))
        return self.workers[-1]


class Kept:
    """A watched drive with this many tenths of a second to its timeout."""

    def __init__(self, tenths: int) -> None:
        self.line = BackgroundListener(tenths)
        session = DriveSession(self.line, 1, PROFILE)
        self.watch = LineWatch(self.line)
        self.watch.keep(session, Monitor(session))

    async def end(self) -> None:
        self.watch.stop()
        for worker in self.line.workers:
            with suppress(asyncio.CancelledError):
                await cast("asyncio.Task[object]", worker)


@pytest.fixture
async def keep() -> AsyncIterator[Callable[[int], Kept]]:
    """Looks after drives until the test has ended."""
    made: list[Kept] = []

    def keep_alive(tenths: int) -> Kept:
        made.append(Kept(tenths))
        return made[-1]

    yield keep_alive
    for kept in made:
        await kept.end()


def kept_alive(line: BackgroundListener) -> list[KeepAlive]:
    """Devices that the holder of the line keeps alive."""
    return line.facts.keep_alives.of(line.facts.me.id)


async def test_drive_is_kept_alive_by_its_own_timeout(keep: Callable[[int], Kept]) -> None:
    kept = keep(35)
    await until(lambda: kept.watch.watch(1) is not None)
    assert kept_alive(kept.line) == [KeepAlive(1, 3.5, STATE)]
    # the holder of the line reads, and no worker of this program
    assert Priority.FEED not in [priority for _, priority in kept.line.looked]
    kept.watch.stop()
    assert kept_alive(kept.line) == []


@pytest.mark.parametrize(("silent", "reported"), [(40.0, False), (60.0, True), (150.0, True)])
async def test_drive_silent_for_half_its_timeout_is_reported(
    keep: Callable[[int], Kept], silent: float, reported: bool
) -> None:
    kept = keep(1000)
    await until(lambda: kept.watch.watch(1) is not None)
    kept.line.heard = time.monotonic() - silent
    warnings = kept.watch.warnings()
    assert bool(warnings) is reported
    for warning in warnings:
        assert warning.device == 1
        assert warning.watch.timeout == 100.0
        assert warning.left == pytest.approx(100.0 - silent, abs=10.0)
    kept.line.facts.pause_polling(1, "its timeout is being tested")
    assert kept.watch.warnings() == []


async def test_drive_without_a_timeout_is_neither_kept_alive_nor_reported(
    keep: Callable[[int], Kept],
) -> None:
    kept = keep(0)
    await until(lambda: (TIME_OUT, Priority.POLL) in kept.line.looked)
    kept.line.heard = time.monotonic() - 1000
    assert kept.watch.watch(1) is None
    assert kept.watch.warnings() == []
    assert kept.watch.pending_timeouts() == {}
    await until(lambda: kept_alive(kept.line) == [])


async def test_drive_of_unknown_family_is_kept_alive_until_it_is_known() -> None:
    line = BackgroundListener(20)
    strangers = UnknownDrivePoller(line)
    strangers.keep(7)
    await until(lambda: kept_alive(line) != [])
    assert [(alive.device, alive.timeout) for alive in kept_alive(line)] == [(7, UNKNOWN_TIMEOUT)]
    strangers.stop()
    assert kept_alive(line) == []


async def test_unknown_drive_is_kept_alive_if_its_work_is_faster_than_the_caller(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On a busy computer the drive was not polled at all, and would have tripped."""
    line = BackgroundListener(20)
    strangers, spawn = UnknownDrivePoller(line), line.spawn
    begun: list[Thread] = []
    known_profiles()  # the work needs them, and the next time it is fast

    def spawn_and_pause(work: Callable[[], Coroutine[Any, Any, None]], name: str) -> LineWorker:
        begun.append(Thread(target=lambda: asyncio.run(work())))
        begun[0].start()
        begun[0].join(0.3)  # it would be done by then
        return spawn(asyncio.Event().wait, name)

    monkeypatch.setattr(line, "spawn", spawn_and_pause)
    strangers.keep(7)
    begun[0].join()
    assert [alive.device for alive in kept_alive(line)] == [7]
    strangers.stop()


async def test_unknown_drive_that_is_let_go_as_it_is_found_is_not_kept_alive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = BackgroundListener(20)
    strangers, keep_alives = UnknownDrivePoller(line), line.facts.keep_alives
    keep, others = keep_alives.keep, [Thread(target=strangers.let_go, args=(7,))]

    def let_go_first(alive: KeepAlive) -> None:
        for thread in others:
            thread.start()
            thread.join(0.05)  # it waits for the lock
        keep(alive)

    monkeypatch.setattr(keep_alives, "keep", let_go_first)
    strangers.keep(7)
    await until(lambda: others[0].ident is not None and not others[0].is_alive())
    await until(lambda: kept_alive(line) == [])
    strangers.stop()


async def test_drive_is_kept_alive_while_its_timeout_is_learned(
    keep: Callable[[int], Kept],
) -> None:
    """Polls wait for seconds after the silence at a word that it does not have."""
    kept = keep(70)
    kept.line.answers.clear()
    assert kept_alive(kept.line) == [KeepAlive(1, UNKNOWN_TIMEOUT, STATE)]
    assert kept.watch.watch(1) is None
    kept.line.answers.set()
    await until(lambda: kept.watch.watch(1) is not None)


async def test_drive_is_checked_soon_after_a_stop_has_ended(
    keep: Callable[[int], Kept], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Line showed STOPPING for up to 3 s after the report that the motor is stopped."""
    monkeypatch.setattr("tui.session.monitor.line_watch.EARLY", 0.01)
    monkeypatch.setattr("tui.session.monitor.line_watch.GLANCE", 6000.0)
    kept = keep(35)
    await until(lambda: 1 in kept.watch.looks)
    before = kept.watch.looks[1].time
    kept.watch._kept[1].session.request_full_read()
    await until(lambda: kept.watch.looks[1].time > before)


# -- step by step, without a wire ------------------------------------------------------------------

TRIPS = TimeoutWatch(10.0, None)


class Watched:
    """A line watch of drives whose states a test sets; it starts no work."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        self.done: list[object] = []
        self.begun = False
        keep_alives = SimpleNamespace(
            keep=lambda read: self.done.append(("keep", read)),
            let_go=lambda device: self.done.append(("let go", device)),
        )
        self.line = SimpleNamespace(
            facts=SimpleNamespace(keep_alives=keep_alives, paused={}), spawn=self._spawn,
            device_state=lambda device: SimpleNamespace(heard=self.heard),
        )  # fmt: skip
        self.heard: float | None = None
        monkeypatch.setattr(line_watches, "has_begun", lambda _: self.begun)
        monkeypatch.setattr(line_watches, "Reader", lambda session: f"reader {session.device}")
        monkeypatch.setattr(
            line_watches, "alive_read", lambda session, seconds: (session.device, seconds)
        )
        self.watch = LineWatch(cast(Any, self.line))

    def _spawn(self, work: object, name: str) -> Any:
        self.done.append(name)
        return SimpleNamespace(cancel=lambda: self.done.append(f"cancel {name}"))

    async def _sleep(self, seconds: float) -> None:
        self.done.append(seconds)
        self.now += seconds

    def session(self, device: int = 1, *, has_timeout: bool = True) -> Any:
        clock = SimpleNamespace(
            monotonic=lambda: self.now, line_time=lambda heard: heard, sleep=self._sleep,
            wall=lambda: 5000.0,
        )  # fmt: skip
        data = SimpleNamespace(communication_fault={} if has_timeout else None)
        order = SimpleNamespace(forget=lambda: self.done.append(f"forget {device}"))
        return SimpleNamespace(
            device=device, clock=clock, profile=SimpleNamespace(data=data), commanded=True,
            commanded_at=None, byte_order=order, full_reads_requested=4,
        )  # fmt: skip

    def keep(self, device: int = 1, **how: Any) -> Any:
        monitor = SimpleNamespace(latest=None, running=False)
        self.watch.keep(self.session(device, **how), cast(Any, monitor))
        return self.watch._kept[device]

    def look(self, device: int = 1, motion: str | None = "running", **more: Any) -> None:
        state = None if motion is None else SimpleNamespace(motion=motion, local=False)
        usual: dict[str, Any] = {"state": state, "time": 50.0, "before": None}
        self.watch._looks[device] = cast(Any, SimpleNamespace(**{**usual, **more}))


def test_drive_that_is_kept_again_replaces_the_earlier_one(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Watched(monkeypatch)
    first = here.keep()
    workers = ["learner 1", "line_watch 1", "identity 1"]
    ended = [f"cancel {worker}" for worker in workers]
    assert here.done == [("keep", (1, UNKNOWN_TIMEOUT)), *workers]
    assert (first.since, first.reader, first.watch, first.learned) == (
        100.0,
        "reader 1",
        None,
        None,
    )
    here.done.clear()
    here.keep()
    assert here.done == [*ended, ("let go", 1), ("keep", (1, UNKNOWN_TIMEOUT)), *workers]
    here.done.clear()
    here.look()
    here.watch.stop()
    assert here.done == [*ended, ("let go", 1)]
    assert (here.watch.looks, here.watch.states) == ({}, {})


def test_keep_alive_read_ends_with_the_timeout_or_without_a_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watched(monkeypatch)
    kept = here.keep()
    here.done.clear()
    here.watch._keep_alive(kept, 5.0)
    here.watch._keep_alive(kept, None)
    monkeypatch.setattr(line_watches, "alive_read", lambda *_: None)
    here.watch._keep_alive(kept, 5.0)
    assert here.done == [("keep", (1, 5.0)), ("let go", 1), ("let go", 1)]


@pytest.mark.parametrize(
    ("look", "latest", "error", "motion"),
    [
        (50.0, 60.0, "", "stopped"), (50.0, 50.0, "", "running"), (50.0, 40.0, "", "running"),
        (50.0, 60.0, "no answer", "running"), (None, 40.0, "", "stopped"),
        (None, 40.0, "no answer", None), (None, None, "", None),
    ],
)  # fmt: skip
def test_state_of_a_drive_is_the_newest_one_that_was_read(
    look: float | None, latest: float | None, error: str, motion: str | None,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = Watched(monkeypatch)
    kept = here.keep()
    if look is not None:
        here.look(time=look)
    if latest is not None:
        state = SimpleNamespace(motion="stopped", local=False)
        kept.monitor.latest = SimpleNamespace(time=latest, error=error, state=state)
    found = here.watch.states.get(1)
    assert (found.motion if found else None) == motion
    assert here.watch.runs(1) == (motion == "running")
    assert here.watch.turns(1) == {"running": True, "stopped": False, None: None}[motion]


@pytest.mark.parametrize(
    ("motion", "turns"),
    [
        ("running", True), ("starting", True), ("stopping", True), ("stopped", False),
        ("fault", False), ("unknown", None), (None, None),
    ],
)  # fmt: skip
def test_drive_may_turn_its_motor_in_enabled_states(
    motion: str | None, turns: bool | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    if motion is not None and motion != "unknown":
        turns = motion in ENABLED_KINDS
    here = Watched(monkeypatch)
    here.keep()
    here.look(motion=motion)
    assert here.watch.turns(1) is turns
    assert here.watch.turns(2) is None


def test_lost_drive_still_has_its_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Watched(monkeypatch)
    here.keep()
    here.keep(2)
    fault = SimpleNamespace(motion="fault", local=False)
    here.look(motion=None, before=SimpleNamespace(state=fault))
    here.look(2, before=SimpleNamespace(state=fault))
    assert here.watch.states[1] is cast(Any, fault)
    assert here.watch.states[2].motion == "running"


@pytest.mark.parametrize(
    ("motion", "seen", "ordered", "commanded", "counts"),
    [
        ("running", 50.0, None, True, True), ("running", 50.0, None, False, False),
        ("stopped", 50.0, None, True, False), ("stopped", 50.0, 49.9, True, False),
        ("stopped", 50.0, 50.0, True, True), ("stopped", 50.0, 50.1, True, True),
        ("unknown", 50.0, 10.0, True, True), (None, 50.0, None, True, True),
        ("stopping", 50.0, 10.0, True, False),
    ],
)  # fmt: skip
def test_commanded_motor_may_turn_until_a_later_read_shows_it_at_rest(
    motion: str | None, seen: float, ordered: float | None, commanded: bool, counts: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = Watched(monkeypatch)
    kept = here.keep()
    kept.session.commanded, kept.session.commanded_at = commanded, ordered
    here.look(motion=motion, time=seen)
    assert here.watch.under_command() == ([kept.session] if counts else [])


def test_timeout_is_pending_if_it_acts_and_would_change_anything(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watched(monkeypatch)
    kept = here.keep()
    assert here.watch.watch(1) is None
    assert here.watch.watch(2) is None
    assert here.watch.pending_timeouts() == {}
    assert [session.device for session in here.watch.unread()] == [1]
    here.keep(2, has_timeout=False)
    assert [session.device for session in here.watch.unread()] == [1]
    kept.watch, kept.learned, here.begun = TRIPS, 90.0, True
    assert here.watch.unread() == []
    assert here.watch.pending_timeouts() == {1: TRIPS}
    here.begun = False
    assert here.watch.pending_timeouts() == {}
    here.look()
    assert here.watch.pending_timeouts() == {1: TRIPS}, "it runs by the line"
    here.look(state=SimpleNamespace(motion="running", local=True))
    assert here.watch.pending_timeouts() == {}
    here.begun = True
    quiet = SimpleNamespace(never_set=False, trips=False)
    kept.watch = TimeoutWatch(10.0, cast(Any, quiet))
    assert here.watch.pending_timeouts() == {1: kept.watch}
    here.look(motion="stopped")
    assert here.watch.pending_timeouts() == {}, "at rest it changes nothing"
    quiet.never_set = True
    here.look()
    assert here.watch.pending_timeouts() == {}


@pytest.mark.parametrize(
    ("heard", "silent", "warned"),
    [(95.0, 5.0, False), (94.9, 5.1, True), (None, 5.0, False), (None, 5.1, True)],
)
def test_warning_counts_from_the_last_reply_or_from_the_begin(
    heard: float | None, silent: float, warned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Watched(monkeypatch)
    kept = here.keep()
    kept.since, kept.watch, here.heard, here.begun = 100.0 - silent, TRIPS, heard, True
    found = here.watch.warnings()
    assert [each.device for each in found] == [1] * warned
    assert all(each.left == pytest.approx(10.0 - silent) for each in found)
    here.begun = False
    assert here.watch.warnings() == []


@pytest.mark.parametrize(
    ("result", "forgets", "pause"),
    [
        (0.5, False, 0.5), (0.001, False, 0.02), (NoAnswer(1, 3, 1), False, 1.0),
        (LineLost("unplugged"), True, 1.0), (ZeroDivisionError(), False, 3.0),
    ],
)  # fmt: skip
@pytest.mark.internal_errors
async def test_step_is_repeated_after_its_pause_whatever_happens(
    result: float | Exception, forgets: bool, pause: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Watched(monkeypatch)
    kept = here.keep()
    here.done.clear()
    tries = [result, result]

    async def step(given: object) -> float:
        assert given is kept
        if not tries:
            raise asyncio.CancelledError
        if isinstance(found := tries.pop(), Exception):
            raise found
        return found

    with pytest.raises(asyncio.CancelledError):
        await here.watch._again(kept, step)
    assert here.done == ["forget 1", pause] * 2 if forgets else here.done == [pause] * 2


async def test_check_comes_early_once_a_full_read_is_requested(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watched(monkeypatch)
    kept = here.keep()
    begun: list[float] = []

    async def step(_: object) -> float:
        begun.append(round(here.now - 100.0, 3))
        if len(begun) == 4:
            raise asyncio.CancelledError
        if len(begun) == 3:
            kept.session.full_reads_requested += 1  # by this check itself
        return 1.0

    sleep = here._sleep

    async def request(seconds: float) -> None:
        assert seconds <= line_watches.EARLY
        await sleep(seconds)
        if len(begun) == 2:
            kept.session.full_reads_requested += 1

    kept.session.clock.sleep = request
    with pytest.raises(asyncio.CancelledError):
        await here.watch._again(kept, step, early=True)
    early = 1.0 + line_watches.EARLY
    assert begun == pytest.approx([0.0, 1.0, early, early + 1.0], abs=0.001)


@pytest.mark.parametrize(("timeout", "pause"), [(4.0, 0.5), (8.0, 1.0), (80.0, 1.0), (None, 1.0)])
def test_drive_that_failed_is_read_again_within_half_of_its_time(
    timeout: float | None, pause: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Watched(monkeypatch).keep()
    kept.watch = None if timeout is None else TimeoutWatch(timeout, None)
    assert LineWatch._after_failure(kept) == pause


@pytest.mark.parametrize(("drives", "seconds"), [(1, 3.0), (20, 3.0), (24, 3.6)])
def test_many_drives_are_checked_less_often(
    drives: int, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Watched(monkeypatch)
    for device in range(drives):
        here.keep(device)
    assert here.watch.glance_period == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("watch", "known", "kept_for"),
    [(TRIPS, True, 10.0), (None, True, None), (None, False, UNKNOWN_TIMEOUT), (TRIPS, False, 10.0)],
)
async def test_drive_is_kept_alive_by_what_was_learned_of_it(
    watch: TimeoutWatch | None, known: bool, kept_for: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Watched(monkeypatch)
    kept, found = here.keep(), SimpleNamespace(watch=watch, known=known)
    steps: list[object] = []

    async def check(*those: object) -> None:
        steps.append(those)

    async def read(*those: object) -> Any:
        steps.append(those)
        return found

    monkeypatch.setattr(line_watches, "check_byte_order", check)
    monkeypatch.setattr(line_watches, "read_timeout", read)
    monkeypatch.setattr(line_watches, "deciding_codes", lambda _: ("CHCF",))
    here.done.clear()
    assert await here.watch._learn(kept) == 20.0
    assert steps == [("reader 1", Priority.POLL), ("reader 1", Priority.POLL, ("CHCF",))]
    assert (kept.watch, kept.learned, kept.session.timeout) == (watch, 100.0, found)
    expected = ("let go", 1) if kept_for is None else ("keep", (1, kept_for))
    assert here.done == [expected]
    here.keep()
    here.done.clear()
    await here.watch._learn(kept)
    assert here.done == [], "another session of the drive is kept now"


@pytest.mark.parametrize(
    ("running", "learned", "error", "begun", "pause", "timeout"),
    [
        (True, 90.0, None, True, 0.3, None), (False, 90.0, None, True, 3.0, 10.0),
        (False, None, None, True, 0.3, 10.0), (False, 90.0, None, False, 3.0, None),
        (False, 90.0, NoAnswer(1, 3, 1), True, 3.0, 10.0),
    ],
)  # fmt: skip
async def test_check_of_a_drive_has_its_state_or_its_error(
    running: bool, learned: float | None, error: Exception | None, begun: bool, pause: float,
    timeout: float | None, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = Watched(monkeypatch)
    kept = here.keep()
    here.begun, kept.watch, kept.learned, kept.monitor.running = begun, TRIPS, learned, running
    state = SimpleNamespace(motion="stopped", local=False)
    reads: list[object] = []
    noted: list[object] = []

    fresh = SimpleNamespace(aged=lambda now, longest: "read")

    async def read(codes: list[str], **how: object) -> dict[str, object]:
        reads.append((codes, how))
        if error is not None:
            raise error
        return {"RFR": fresh}

    kept.reader = SimpleNamespace(read=read)
    kept.monitor.add_to_trend = noted.append
    channels = {"CHCF": SimpleNamespace(access="rw-stopped"), "CHAN": SimpleNamespace(access="r")}
    kept.session.profile = channels
    kept.session.image = SimpleNamespace(get=lambda code: "held" if code == "CHCF" else None)
    monkeypatch.setattr(line_watches, "_state_codes", lambda _: ["ETA"])
    monkeypatch.setattr(line_watches, "_glance_codes", lambda _: ["RFR"])
    monkeypatch.setattr(line_watches, "unread_limit", lambda _: ["NCR"])
    monkeypatch.setattr(line_watches, "channel_codes", lambda _: ["CHCF", "CHAN"])
    used: list[object] = []

    def state_of(profile: object, readings: object) -> Any:
        used.append(readings)
        return state

    monkeypatch.setattr(line_watches, "drive_state", state_of)
    onsets: list[object] = []
    here.watch.onsets = cast(Any, SimpleNamespace(note=lambda *those: onsets.append(those)))
    before: Any = SimpleNamespace(error="", before=None, state=state, time=1.0)
    here.watch._looks[1] = before
    assert await here.watch._glance(kept) == pytest.approx(pause)
    if running:
        assert reads == noted == []
        return
    assert reads == [(["ETA", "RFR", "NCR", "CHAN"], {"priority": Priority.POLL})]
    look = cast(Any, here.watch.looks[1])
    assert noted == [look]
    assert (look.time, look.timeout) == (100.0, timeout)
    if error is None:
        assert (look.state, look.error, look.readings) == (state, "", {"RFR": "read"})
        assert (look.before, look.contact) == (None, "answers")
        assert used == [{"CHCF": "held", "RFR": "read"}]
        assert onsets == [(1, state, 5000.0)]
    else:
        assert (look.state, look.error, look.readings) == (None, str(error), {})
        assert (look.before, look.contact) == (before, "silent")
        assert onsets == []
    here.keep()
    noted.clear()
    await here.watch._glance(kept)
    assert noted == [], "another session of the drive is kept now"


@pytest.mark.internal_errors
async def test_internal_error_with_one_drive_does_not_end_its_checks(
    caplog: pytest.LogCaptureFixture,
) -> None:
    slept: list[float] = []

    async def sleep(seconds: float) -> None:
        slept.append(seconds)
        if len(slept) == 2:
            raise asyncio.CancelledError

    async def fails(_: object) -> float:
        raise ValueError("on purpose")

    session = SimpleNamespace(
        device=7, full_reads_requested=0, clock=SimpleNamespace(sleep=sleep)
    )  # fmt: skip
    watch = cast(Any, object.__new__(LineWatch))
    with pytest.raises(asyncio.CancelledError):
        await watch._again(SimpleNamespace(session=session), fails)
    assert slept == [GLANCE] * 2
    assert caplog.messages == ["looking after device 7 failed"] * 2
