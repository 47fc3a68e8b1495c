"""Limits of `tui/safety.py`: each is tested on both sides, by figures that do not follow it."""

from __future__ import annotations

import ast
import asyncio
import itertools
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from types import SimpleNamespace
from typing import Any, cast

import pytest
from textual.events import Key

from tests.session.fake_clock import FakeClock
from tui import safety
from tui.bus.errors import LineClosed, LineLost, NoAnswer
from tui.bus.fake import FakeLine
from tui.bus.gateway.server import Awake
from tui.bus.leases import WriteLeases
from tui.bus.limits import CAUTIOUS
from tui.bus.line import timing_of
from tui.bus.line_events import EventHub
from tui.bus.link import SerialLink
from tui.bus.model import LineStatus, Priority, Timing
from tui.bus.poll_plan import PlannedRead
from tui.bus.program import KEEPER, Program
from tui.bus.requests import Read, WriteOne
from tui.bus.schedule.alive_reads import AliveReads
from tui.bus.schedule.last_way import LastWay
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job, SentStops
from tui.bus.schedule.unsent import fail_lost
from tui.bus.share import heartbeat, keeper_share, sharing
from tui.bus.share.attached import Client
from tui.bus.share.heartbeat import HeartbeatSender, programs_back
from tui.bus.share.messages import VERSION, Asking
from tui.bus.share.owner_watch import OwnerWatch
from tui.bus.share.place import Owner
from tui.bus.share.polls import PollsServed
from tui.bus.stop_counts import StopCounts
from tui.drive.orders import chart_codes
from tui.drive.profile import library
from tui.screens.dialogs.question import Question
from tui.screens.frame_source import _seen
from tui.screens.monitor.run_line import RunLine
from tui.session.command import motor_stop, under_way
from tui.session.command.access import CommandAccess
from tui.session.command.commander import Commander
from tui.session.command.last_known import is_likely_to_run
from tui.session.command.stop import Stopper
from tui.session.drive import DriveSession
from tui.session.gateway.drives import GatewayDrives
from tui.session.gateway.resting import RestingDrives
from tui.session.gateway.started import StartedMotors
from tui.session.gateway.writes import GatewayWrite
from tui.session.monitor.line_watch import LineWatch
from tui.session.monitor.snapshot import Snapshot
from tui.session.read.reader import Reader
from tui.session.read.slots import Slots
from tui.session.settings.watched_values import WatchedValues
from tui.session.sharing.handover import Handover
from tui.session.sharing.observer_poller import ObserverPoller
from tui.session.sharing.orphan_motors import OrphanMotorGuard
from tui.session.starts.starts import Starts
from tui.terminal import type_ahead
from tui.terminal.reader import Bursts
from tui.terminal.stroke import Stroke, attach
from tui.terminal.tokens import KeyToken

from .sources import PACKAGE, tree_of

READY, RUNNING = 0x0231, 0x0637
"""Status words of an Altivar 71: at standstill, and running."""


class Now:
    """A clock that advances only by the test; also replaces the module `time`."""

    def __init__(self) -> None:
        self.seconds = 1000.0

    def __call__(self) -> float:
        return self.seconds

    monotonic = __call__

    async def sleep(self, seconds: float) -> None:
        self.seconds += seconds
        await asyncio.sleep(0)


class ThreadTime(Now):
    """The same for the module `time` of a thread, in which to sleep moves it."""

    def sleep(self, seconds: float) -> None:  # type: ignore[override]
        self.seconds += seconds


def names() -> list[str]:
    return [
        node.target.id
        for node in tree_of(PACKAGE / "safety.py").body
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
    ]


def test_each_limit_has_its_unit_and_its_reason() -> None:
    body = tree_of(PACKAGE / "safety.py").body
    texts = {}
    for node, after in itertools.pairwise(body):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            match after:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    texts[node.target.id] = text
    units = ("Seconds", "Share", "Times", "Cycles", "Replies", "Keep-alive reads")
    assert [n for n in names() if not texts.get(n, "").startswith(units)] == []
    assert [n for n in names() if len(texts[n].split()) < 8] == []


# Arming and commands


def test_drive_is_armed_for_a_minute_without_a_key() -> None:
    clock = FakeClock()
    session = DriveSession(FakeLine({1: {}}), 1, library.load("atv71"), clock=clock)
    session.arming.arm()
    clock.advance(58)
    assert session.arming.armed
    clock.advance(4)
    assert not session.arming.armed


@pytest.mark.parametrize(("after", "renewed"), [(0.9, False), (1.1, True)])
def test_lease_is_renewed_each_second(
    after: float, renewed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = Now()
    sent: list[object] = []
    monkeypatch.setattr("tui.bus.leases.time", now)
    leases = WriteLeases("me", StopCounts(), sent.append)
    leases.arm(1, 10.0, b"care")
    assert leases.of("me")[1].until == 1011.0
    now.seconds += after
    leases.stay_armed(1, 10.0)
    assert (leases.of("me")[1].until == 1011.0 + after) is renewed


@pytest.mark.parametrize(("waits", "refused"), [(1.8, False), (2.2, True)])
async def test_drive_has_two_seconds_for_a_step(waits: float, refused: bool) -> None:
    clock = Now()

    async def state(_: object) -> SimpleNamespace:
        return SimpleNamespace(id="ready" if clock() - 1000.0 >= waits else "off")

    access = SimpleNamespace(session=SimpleNamespace(clock=clock), state=state)
    found = await CommandAccess.wait_for(cast(Any, access), cast(Any, None), ["ready"])
    assert (found.id != "ready") is refused


def test_start_waits_five_seconds_for_the_disk() -> None:
    default = Starts.begin.__defaults__
    assert default is not None
    assert 4 <= default[-1] <= 6


# Programs on a line


class PausedTime:
    """Time in which programs may come back."""

    def __init__(self) -> None:
        self.now = 0.0

    async def pause(self, seconds: float) -> None:
        self.now += seconds

    def waited(self, *, greets: bool) -> float:
        asyncio.run(programs_back(lambda: greets, lambda: self.now, self.pause))
        return self.now


def test_programs_have_two_to_six_seconds_to_reconnect() -> None:
    assert 1.7 < PausedTime().waited(greets=False) < 2.3
    assert 5.7 < PausedTime().waited(greets=True) < 6.3


def client(heard: float = 0.0) -> Client:
    writer = cast(Any, SimpleNamespace(transport=SimpleNamespace(is_closing=lambda: True)))
    return Client(Program("remote", "panel", 77, "", ""), writer, EventHub(), heard=heard)


@pytest.mark.parametrize(("after", "silent"), [(1.8, False), (2.2, True)])
def test_client_without_a_heartbeat_is_silent_after_two_seconds(after: float, silent: bool) -> None:
    remote = client()
    assert [remote.is_silent(after, 10) for _ in range(12)][-1] is silent


@pytest.mark.parametrize(("after", "due"), [(9.0, (3,)), (11.0, ())])
def test_stop_of_an_ended_program_is_due_for_ten_seconds(
    after: float, due: tuple[int, ...]
) -> None:
    remote = client()
    remote.stops_due[3] = 0.0
    assert remote.due_stops(after) == due


# Stops


def job(priority: Priority = Priority.STOP, when: float = 0.0) -> Job:
    made = Job(WriteOne(1, 8501, 0), priority, CAUTIOUS)
    made.requested = when
    return made


@pytest.mark.parametrize(("after", "kept"), [(590.0, True), (610.0, False)])
def test_stop_is_kept_for_ten_minutes_while_the_line_is_lost(after: float, kept: bool) -> None:
    found = fail_lost(job(), "lost", LineLost, after, keeps=True)
    assert (found is not None) is kept


@pytest.mark.parametrize(("after", "repeat"), [(2.8, True), (3.2, False)])
def test_equal_stop_is_a_repeat_for_three_seconds(after: float, repeat: bool) -> None:
    stops = SentStops()
    stops.count(job(), 0.0, acknowledged=True)
    assert stops.yields(job(), after) is repeat


@pytest.mark.parametrize(("sent", "repeat"), [(4, False), (5, True)])
def test_unacknowledged_stop_is_first_until_it_was_sent_five_times(sent: int, repeat: bool) -> None:
    stops = SentStops()
    for number in range(sent):
        stops.count(job(), number / 100, acknowledged=False)
    assert stops.yields(job(), 0.1) is repeat


@pytest.mark.parametrize(("after", "known"), [(590.0, True), (610.0, False)])
def test_next_owner_learns_of_stops_of_ten_minutes(
    after: float, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = Now()
    monkeypatch.setattr("tui.bus.stop_counts.time", now)
    counts = StopCounts()
    counts.learn_times({1: 1000.0})
    now.seconds += after
    assert (1 in counts.late_times) is known


def session_showing(status: int) -> tuple[DriveSession, FakeClock]:
    clock = FakeClock()
    session = DriveSession(FakeLine({1: {}}), 1, library.load("atv71"), clock=clock)
    session.image.confirm("ETA", status, clock.monotonic())
    return session, clock


@pytest.mark.parametrize(("after", "running"), [(8.0, True), (12.0, False)])
def test_motor_counts_as_running_for_ten_seconds(after: float, running: bool) -> None:
    session, clock = session_showing(RUNNING)
    clock.advance(after)
    assert is_likely_to_run(session) is running


# Age of values


@pytest.mark.parametrize(
    ("period", "after", "stale"),
    [(1.0, 2.9, False), (1.0, 3.1, True), (0.1, 1.4, False), (0.1, 1.6, True)],
)
def test_values_are_stale_after_three_cycles_and_not_before_one_and_a_half_seconds(
    period: float, after: float, stale: bool
) -> None:
    taken = SimpleNamespace(time=0.0, period=period)
    assert Snapshot.is_stale(cast(Snapshot, taken), after) is stale


# Replies


def devices() -> Devices:
    return Devices(Timing(), mistakable=True)


def test_reply_has_four_times_the_worst_turnaround() -> None:
    found = devices()
    found.answered(1, Read(1, 0, 1).expectation(), 0.1, 0.0)
    assert 0.35 < found.time_out(1, 3, Priority.POLL) < 0.45


def test_known_device_pauses_after_three_missed_replies() -> None:
    found, expected = devices(), Read(1, 0, 1).expectation()
    found.answered(1, expected, 0.01, 0.0)
    for number in range(2):
        found.silent(1, expected, float(number), number + 0.5)
        assert found.backed_off(1, Priority.POLL, number + 0.5) is None
    found.silent(1, expected, 2.0, 2.5)
    assert found.backed_off(1, Priority.POLL, 2.5) is not None


def test_late_reply_is_awaited_for_twice_the_worst_lateness_and_ten_seconds_at_most() -> None:
    found, expected = devices(), Read(1, 0, 1).expectation()
    usual = max(Timing().late_reply, Timing().first_timeout)
    for lateness, waits in ((4.0, 8.0), (20.0, 10.0)):
        found[1].lateness = lateness
        found.may_come(1, expected, 0.0, 0.0)
        assert found[1].outstanding[-1].expires == pytest.approx(max(usual, waits), abs=0.5)


def test_line_keeps_quiet_for_a_late_device_for_a_third_of_the_timeout_at_most() -> None:
    found = devices()
    found[1].lateness = 100.0
    found.may_come(1, Read(1, 0, 1).expectation(), 0.0, 0.0)
    assert 0.2 < found.quiet_until / Timing().first_timeout < 0.4


def test_reply_may_be_late_by_twice_a_timeout_that_a_person_has_set() -> None:
    link = SerialLink("/dev/ttyUSB0", timeout=10.0)
    assert 15.0 < timing_of(link).late_reply < 25.0


# Programs on a line, by the clock of a test


def owner_watch(now: Now) -> OwnerWatch:
    return OwnerWatch(now, Owner(VERSION, Program("k", KEEPER, 1), "socket"))


@pytest.mark.parametrize(("gap", "awake"), [(0.25, True), (0.35, False)])
def test_program_was_awake_if_it_checked_each_third_of_a_second(gap: float, awake: bool) -> None:
    now = Now()
    watch = owner_watch(now)
    for _ in range(3):
        now.seconds += gap
        watch.look(attached=True)
    assert (watch._awake == 1000.0) is awake


async def test_owner_that_was_suspended_for_more_than_0_7_seconds_sends_stops_only() -> None:
    now, dispatcher = Now(), SimpleNamespace(held_back=bool)
    inside = cast(Any, SimpleNamespace(clock=now, dispatcher=dispatcher))
    sender = HeartbeatSender(inside, tuple, lambda: None)
    sender.start()
    now.seconds += 0.6
    assert not dispatcher.held_back()
    now.seconds += 0.2
    assert dispatcher.held_back()
    sender.close()


def test_client_is_checked_ten_times_before_it_counts_as_frozen() -> None:
    """A computer that is short of time may give no turn to a program that is well."""
    assert 8 <= heartbeat.LOOKS_IN_VAIN <= 12


class Thread:
    """The thread of a heartbeat, which ends after its first turn."""

    def __init__(self) -> None:
        self.beats = 0
        self.turns = 0
        self.waited = 0.0
        self._turned = 1000.0
        self._ended = self

    def is_set(self) -> bool:
        self.turns += 1
        return self.turns > 1

    def wait(self, seconds: float) -> None:
        self.waited = seconds

    def _beat(self, connection: object) -> None:
        assert connection is None
        self.beats += 1


@pytest.mark.parametrize(("after", "beats"), [(2.8, 1), (3.2, 0)])
def test_heartbeat_ends_if_the_loop_hangs_for_three_seconds(
    after: float, beats: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, thread = Now(), Thread()
    monkeypatch.setattr(heartbeat, "monotonic", now)
    now.seconds += after
    heartbeat.Heartbeat._work(cast(Any, thread))
    assert thread.beats == beats
    assert 4 <= safety.SILENT_CLIENT / thread.waited <= 8, "beats in the time of a silent client"


def test_holder_has_half_a_second_to_accept_a_heartbeat(monkeypatch: pytest.MonkeyPatch) -> None:
    waited = []

    def reached(_: object, within: float) -> None:
        waited.append(within)
        raise OSError

    monkeypatch.setattr(heartbeat, "reached", reached)
    beat = cast(Any, SimpleNamespace(_holder="socket", _greeting=b""))
    assert heartbeat.Heartbeat._beat(beat, None) is None
    assert 0.4 < waited[0] < 0.6


# Stops, by the clock of a test


async def test_stop_is_sent_five_times_until_the_drive_answers() -> None:
    tries, reported, silent = [], [], []

    async def carry_out() -> None:
        tries.append(1)
        raise NoAnswer(1, 6, 8501, "no answer")

    stop = SimpleNamespace(
        carry_out=carry_out, session=None, ordered=0.0, tell_silent=lambda: silent.append(1)
    )
    stopper = SimpleNamespace(_say=lambda *what: reported.append(what))
    await Stopper._carry_out(cast(Any, stopper), cast(Any, stop))
    assert (len(tries), len(reported), len(silent)) == (5, 1, 5)


@pytest.mark.parametrize(
    ("motion", "ends"), [("running", 1.5), ("stopping", 60.0)], ids=["not-obeyed", "slow-ramp"]
)
async def test_stop_shows_an_effect_in_1_5_seconds_and_is_followed_for_a_minute(
    motion: str, ends: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = Now()

    async def nothing(*_: object) -> None:
        pass

    async def moves(_: object) -> tuple[str, float]:
        return motion, 20.0

    monkeypatch.setattr(motor_stop, "check_byte_order", nothing)
    monkeypatch.setattr(motor_stop, "last_word", lambda *_: None)
    monkeypatch.setattr(motor_stop, "run_by_others", lambda _: "")
    stop = SimpleNamespace(
        reader=None, session=SimpleNamespace(clock=now), ordered=1000.0, _motion=moves,
        _tell=lambda *_: None, _with_way=str, _why_not=lambda _: "it turns",
    )  # fmt: skip
    order = cast(Any, SimpleNamespace(name="ramp"))
    assert await motor_stop.MotorStop._follow(cast(Any, stop), cast(Any, None), order)
    assert ends <= now.seconds - 1000.0 < ends + 0.5


def test_stop_after_an_internal_error_waits_0_3_seconds_for_the_exchange_in_flight(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    waited = []
    loop = SimpleNamespace(call_later=lambda seconds, _: waited.append(seconds))
    monkeypatch.setattr(asyncio, "get_running_loop", lambda: loop)
    way = SimpleNamespace(_waiting=[], master="open", _send_now=None, _wake=lambda: None)
    LastWay.put(cast(Any, way), [], lambda _: None)
    assert 0.2 < waited[0] < 0.4


class AtOnce:
    """A thread whose work is done when it starts."""

    def __init__(self, target: Callable[[], None], **_: object) -> None:
        self.start = target


def test_stop_around_a_loop_that_hangs_begins_in_0_25_s_and_is_repeated_each_second(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now, times = ThreadTime(), list[float]()
    monkeypatch.setattr(under_way, "time", now)
    monkeypatch.setattr(under_way, "threading", SimpleNamespace(Thread=AtOnce))
    stop = SimpleNamespace(sent=False, over=False, begun=False)

    def refused(_: tuple[int, ...]) -> None:
        times.append(now.seconds)
        stop.over = len(times) == 4
        raise OSError("it does not answer")

    line = SimpleNamespace(facts=SimpleNamespace(voice=SimpleNamespace(stop_directly=refused)))
    stop.session = SimpleNamespace(line=line, device=1)
    work = SimpleNamespace(stop=stop, is_lost=lambda *_: now.seconds > 1100.0)
    last: list[object] = []
    under_way.watch_first_frames([cast(Any, work)], Timing(), lambda *what: last.append(what))
    assert last == []
    assert 0.2 < times[0] - 1000.0 < 0.4
    assert [0.9 < after - before < 1.2 for before, after in itertools.pairwise(times)] == [True] * 3


# Programs that hang, by the clock of a test


class Hanging:
    """The process of a keeper that hangs."""

    remedy = ""

    def __init__(self) -> None:
        self.kills = 0

    def kill(self) -> bool:
        self.kills += 1
        return True


def watched_for(seconds: float, *, attached: bool = True, stops: bool = False) -> OwnerWatch:
    """A look each tenth of a second at an owner that sends nothing."""
    now = Now()
    watch = owner_watch(now)
    watch._process = cast(Any, Hanging())
    if stops:
        watch.note_stop()
    for _ in range(round(seconds * 10)):
        now.seconds += 0.1
        watch.look(attached=attached)
    return watch


@pytest.mark.parametrize(("seconds", "frozen"), [(0.9, False), (1.2, True)])
def test_owner_without_a_heartbeat_counts_as_frozen_after_a_second(
    seconds: float, frozen: bool
) -> None:
    assert watched_for(seconds).frozen is frozen


@pytest.mark.parametrize(("seconds", "kills"), [(2.8, 0), (3.2, 1)])
def test_keeper_that_sends_nothing_is_replaced_after_three_seconds(
    seconds: float, kills: int
) -> None:
    assert cast(Any, watched_for(seconds)._process).kills == kills


@pytest.mark.parametrize(
    ("attached", "seconds", "kills"),
    [(True, 0.8, 0), (True, 1.2, 1), (False, 1.8, 0), (False, 2.2, 1)],
)
def test_keeper_has_a_second_for_a_greeting_and_a_second_for_a_stop(
    attached: bool, seconds: float, kills: int
) -> None:
    watch = watched_for(seconds, attached=attached, stops=True)
    assert cast(Any, watch._process).kills == kills


@pytest.mark.parametrize(("after", "woke"), [(1.8, False), (2.2, True)])
def test_gateway_was_suspended_after_two_seconds_without_a_turn(after: float, woke: bool) -> None:
    now = Now()
    awake = Awake(now)
    now.seconds += after
    assert awake.just_woke is woke
    awake.look()
    assert awake.just_woke is woke


class Once(Exception):
    """Ends work after its first turn."""


async def test_alarm_ends_a_keeper_after_two_seconds_without_a_turn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alarms: list[float] = []

    async def sleep(_: float) -> None:
        raise Once

    monkeypatch.setattr(keeper_share, "asyncio", SimpleNamespace(sleep=sleep))
    share = SimpleNamespace(_keeping=SimpleNamespace(alarm=alarms.append))
    with pytest.raises(Once):
        await keeper_share.KeeperShare._renew_alarm(cast(Any, share))
    assert 1.5 < alarms[0] < 2.5


def test_keeper_waits_ten_seconds_for_the_next_program(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []
    loop = SimpleNamespace(call_later=lambda seconds, _: waits.append(seconds))
    monkeypatch.setattr(asyncio, "get_running_loop", lambda: loop)
    share = SimpleNamespace(
        _moved=asyncio.Event(), _ending=None, _here=(), _needed=True, _end_unneeded=None,
        _inside=SimpleNamespace(state=lambda: SimpleNamespace(status=LineStatus.CONNECTED)),
    )  # fmt: skip
    keeper_share.KeeperShare.moved(cast(Any, share), arrived=False)
    share._ending = None
    keeper_share.KeeperShare._end_unneeded(cast(Any, share))
    assert [8 < seconds < 12 for seconds in waits] == [True, True]


# Keys


@pytest.mark.parametrize(("after", "early"), [(0.9, True), (1.1, False)])
def test_question_that_appears_on_its_own_accepts_an_answer_after_a_second(
    after: float, early: bool
) -> None:
    clock = SimpleNamespace(monotonic=lambda: after)
    question = SimpleNamespace(
        _drawn=0.0, _typed_at=-9.0, by_itself=True, app=SimpleNamespace(panel_clock=clock)
    )
    assert Question._is_early(cast(Any, question)) is early


@pytest.mark.parametrize(("after", "counts"), [(0.25, False), (0.35, True)])
def test_enter_counts_after_the_run_line_was_shown_for_0_3_seconds(
    after: float, counts: bool
) -> None:
    assert RunLine.counts(cast(Any, SimpleNamespace(opened=0.0)), after) is counts


@pytest.mark.parametrize(("after", "alone"), [(0.04, False), (0.06, True)])
def test_key_is_alone_if_no_other_follows_within_50_milliseconds(after: float, alone: bool) -> None:
    bursts = Bursts()
    bursts.key(KeyToken("r", "r", 1.0, 1.0))
    assert bool(bursts.given(1.0 + after)) is alone


@pytest.mark.parametrize(("after", "acts"), [(2.8, True), (3.2, False)])
def test_key_acts_within_three_seconds(
    after: float, acts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = Now()
    monkeypatch.setattr(type_ahead, "time", now)
    event = Key("r", "r")
    attach(event, Stroke(now.seconds, 0, alone=True))
    now.seconds += after
    keys = SimpleNamespace(
        _stamps=SimpleNamespace(stop_stamp=int), _harmless=lambda _: False, _count=lambda _: None
    )
    assert type_ahead.TypeAhead._admits(cast(Any, keys), event) is acts


# A drive that another program requests


@pytest.mark.parametrize(("after", "given"), [(1.8, True), (2.2, False)])
def test_drive_is_given_without_an_answer_if_it_stood_still_two_seconds_ago(
    after: float, given: bool
) -> None:
    session, clock = session_showing(READY)
    clock.advance(after)
    replies: list[bool] = []
    handover = SimpleNamespace(
        _session_of=lambda _: session, _reply=lambda *_, yes: replies.append(yes)
    )
    Handover._decide(cast(Any, handover), 1, cast(Any, None))
    assert replies == [given]


async def test_request_for_a_drive_is_decided_after_15_seconds() -> None:
    waits: list[float] = []

    async def sleep(seconds: float) -> None:
        waits.append(seconds)

    clock = SimpleNamespace(sleep=sleep, monotonic=float)
    handover = SimpleNamespace(_clock=clock, requests={})
    await Handover._expire(cast(Any, handover), cast(Any, SimpleNamespace(device=1)))
    assert 13 < waits[0] < 17


# Motors of programs that ended


@pytest.mark.parametrize(("acts_after", "grace"), [(0.0, 2.0), (4.0, 4.0), (60.0, 10.0)])
async def test_motor_may_be_taken_over_for_two_to_ten_seconds(
    acts_after: float, grace: float
) -> None:
    ends: list[float] = []

    def announce(_device: int, _program: object, end: float, **_: object) -> None:
        ends.append(end)
        raise Once

    starts = SimpleNamespace(is_alive=lambda _: False)
    guard = SimpleNamespace(_starts=starts, _clock=Now(), _announce=announce)
    record = SimpleNamespace(device=1, acts_after=acts_after)
    with pytest.raises(Once):
        await OrphanMotorGuard._stop_unless_taken(
            cast(Any, guard), cast(Any, record), cast(Any, None), takers=True, left=1000.0
        )
    assert ends == [pytest.approx(1000.0 + grace)]


async def test_motor_on_a_lost_line_is_stopped_for_ten_minutes() -> None:
    now = Now()

    async def until_ended(_: object) -> None:
        pass

    guard = SimpleNamespace(
        _clock=now, _lost={}, _until_ended=until_ended, _is_connected=bool, _tell=lambda *_: None,
        _line=SimpleNamespace(facts=SimpleNamespace(tell_all=lambda *_: None)),
    )  # fmt: skip
    session = SimpleNamespace(device=1)
    assert not await OrphanMotorGuard._ended_by_loss(cast(Any, guard), cast(Any, session))
    assert 595.0 < now.seconds - 1000.0 < 605.0


async def test_stop_waits_a_second_for_a_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []

    async def opened(_path: str, _find: object, _drop: object, within: float) -> None:
        waits.append(within)
        raise Once

    monkeypatch.setattr(sharing, "opened_beside", opened)
    shared = SimpleNamespace(
        _lock=SimpleNamespace(held=False), _off=False, _keeper=False, _inside=None,
        _place=SimpleNamespace(lock_path=""), _find_holder=None, _drop_lock=None,
    )  # fmt: skip
    with pytest.raises(Once):
        await sharing.Sharing.own(cast(Any, shared), lambda *_: None)
    assert 0.8 < waits[0] < 1.2


# Age of values before a command


@pytest.mark.parametrize(("after", "fresh"), [(0.8, True), (1.2, False)])
async def test_drive_is_armed_by_a_state_of_the_last_second(after: float, fresh: bool) -> None:
    session, clock = session_showing(READY)
    clock.advance(after)
    queued: list[object] = []
    session.work.put = lambda *given: queued.append(given)  # type: ignore[method-assign]
    commander = SimpleNamespace(session=session)
    Commander.arm(cast(Any, commander))
    assert bool(queued) is not fresh
    stop = SimpleNamespace(session=session)
    assert ("ETA" in motor_stop.MotorStop._sure(cast(Any, stop), ["ETA"])) is fresh


@pytest.mark.parametrize(("after", "off"), [(2.8, False), (3.2, True)])
def test_drive_that_was_silent_for_three_seconds_was_switched_off(after: float, off: bool) -> None:
    session, clock = session_showing(READY)
    resets: list[bool] = []
    values = WatchedValues(session, lambda: "ready", lambda: resets.append(True))
    values._silent = clock.monotonic()
    clock.advance(after)
    values._look_for_a_reset()
    assert resets == [True] * off


@pytest.mark.parametrize(("after", "polls"), [(2.2, True), (2.8, False)])
def test_drive_is_polled_for_a_quarter_of_its_timeout_after_a_heartbeat(
    after: float, polls: bool
) -> None:
    poller = SimpleNamespace(
        orphan=False, _sign=float, _requested=0.1, _stands=lambda _: False, _now=lambda: after,
        _timeout=lambda: 10.0, _silence=float,
    )  # fmt: skip
    assert ObserverPoller._may_ask(cast(Any, poller)) is polls


def test_device_is_read_four_times_in_its_timeout() -> None:
    alive = SimpleNamespace(device=1, timeout=8.0)
    reads = SimpleNamespace(_devices={1: SimpleNamespace(heard=100.0)}, _since={1: 0.0}, _jobs={})
    due = AliveReads._look(cast(Any, reads), "me", cast(Any, alive), 100.0)
    assert 1.5 < due - 100.0 < 2.5


# Clients of Modbus TCP


async def test_write_of_a_client_may_wait_for_ten_seconds() -> None:
    armed = []

    async def write(*_: object, **__: object) -> None:
        pass

    leases = SimpleNamespace(arm=lambda device, seconds, care: armed.append(seconds))
    line = SimpleNamespace(facts=SimpleNamespace(leases=leases), write=write)
    session = SimpleNamespace(device=1, line=line, care=lambda: b"")
    requested = SimpleNamespace(function=6, address=1, values=[1])
    pending = SimpleNamespace(_session=session, _requested=requested, _voided=lambda: "")
    with suppress(AttributeError):  # the reply is not made up
        await GatewayWrite._exchange(cast(Any, pending), Priority.OPERATOR_WRITE, [])
    assert 8 < armed[0] < 12


@pytest.mark.parametrize(("after", "known"), [(1.8, True), (2.2, False)])
async def test_word_counts_as_just_read_for_two_seconds(
    after: float, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, clock = session_showing(RUNNING)
    clock.advance(after)

    async def read(*_: object, **__: object) -> None:
        pass

    monkeypatch.setattr(Reader, "read", read)
    for found in (
        await GatewayWrite._read(cast(Any, SimpleNamespace(_session=session)), ["ETA"]),
        session.image.fresh(2.0),
    ):
        assert ("ETA" in found) is known


@pytest.mark.parametrize(("after", "at_rest"), [(1.8, True), (2.2, False)])
async def test_state_counts_as_just_seen_for_two_seconds(after: float, at_rest: bool) -> None:
    session, clock = session_showing(READY)
    clock.advance(after)

    async def read(*_: object, **__: object) -> None:
        pass

    reader = SimpleNamespace(profile=session.profile, session=session, read=read)
    assert await RestingDrives._is_at_rest(cast(Any, None), cast(Any, reader)) is at_rest


async def test_gateway_reads_a_drive_at_rest_twice_in_its_timeout() -> None:
    slept: list[float] = []

    async def sleep(seconds: float) -> None:
        slept.append(seconds)
        if len(slept) == 2:
            raise LineClosed

    async def rests(_: object) -> bool:
        return True

    timeout = SimpleNamespace(known=True, watch=SimpleNamespace(timeout=10.0))
    clock = SimpleNamespace(monotonic=lambda: 1000.0, sleep=sleep)
    session = SimpleNamespace(clock=clock, timeout=None, profile=None, line=None)
    resting = SimpleNamespace(
        _silence=lambda _: 60.0, _is_at_rest=rests, _keep_alive=lambda _, rests: None
    )

    async def learn(*_: object) -> object:
        return timeout

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("tui.session.gateway.resting.Reader", lambda _: None)
        patched.setattr("tui.session.gateway.resting.read_timeout", learn)
        patched.setattr("tui.session.gateway.resting._timeout", lambda _: 10.0)
        await RestingDrives._work(cast(Any, resting), cast(Any, session))
    assert 4 < slept[1] < 6, "the first was before its timeout was read"


async def test_gateway_that_ends_waits_ten_seconds_for_its_motors() -> None:
    waited: list[float] = []
    stopper = SimpleNamespace(
        stop=lambda *_, **__: None, wait=lambda _, seconds: waited.append(seconds)
    )
    keeper = SimpleNamespace(holds=lambda _: True, close=lambda: None)
    started = SimpleNamespace(
        _unsubscribe=lambda: None, _sessions={1: None}, _keeper=keeper, _looks={},
        _line=None, _journal=None,
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("tui.session.gateway.started.Stopper", lambda *_: stopper)
        await StartedMotors.end(cast(Any, started))
    assert len(waited) == 1
    assert 8 < waited[0] < 12


async def test_word_that_chooses_the_chart_may_be_two_seconds_old() -> None:
    ages = {}

    async def read_raw(_: object, code: str, __: object, age: float) -> int:
        ages[code] = age
        return 0

    session = SimpleNamespace(profile=library.load("atv71"))
    (chart, *_) = chart_codes(session.profile)
    drives = SimpleNamespace(_read_raw=read_raw)
    await GatewayDrives.read_deciding(
        cast(Any, drives), cast(Any, session), [chart, "ETA"], hurry=True
    )
    assert 1.5 < ages[chart] < 2.5
    assert ages["ETA"] == 0.0


@pytest.mark.parametrize(("late", "sent"), [(1.8, True), (2.2, False)])
def test_command_of_an_attached_program_is_sent_within_two_seconds(late: float, sent: bool) -> None:
    submitted: list[Job] = []
    inside = SimpleNamespace(clock=lambda: 100.0, submit=submitted.append)
    request = WriteOne(1, 8501, 15)
    message = Asking(
        1, type(request).__name__, asdict(request), Priority.OPERATOR_WRITE,
        replaceable=False, max_age=0.0, stamp=0, requested=100.0 - late,
    )  # fmt: skip
    client().ask(cast(Any, inside), message)
    assert bool(submitted) is sent


# What the screens show of a drive without a monitor


@pytest.mark.parametrize(("after", "shown"), [(9.0, None), (11.0, 11.0)])
def test_state_of_a_drive_without_a_monitor_has_an_age_after_ten_seconds(
    after: float, shown: float | None
) -> None:
    look = SimpleNamespace(time=0.0, error="", state="state", readings={})
    console = cast(Any, SimpleNamespace(latest=None))
    assert _seen(console, cast(Any, look), after)[1] == shown


@pytest.mark.parametrize(("after", "awake"), [(0.7, True), (0.9, False)])
def test_block_is_compared_again_after_0_8_seconds_without_a_reply(
    after: float, awake: bool
) -> None:
    now = Now()
    slots = Slots(FakeLine({1: {}}), 1, library.load("atv31"), cast(Any, now))
    slots.heard()
    slots._in_force["NM1"] = 3
    now.seconds += after
    assert ("NM1" in slots.in_force()) is awake


@pytest.mark.parametrize(("after", "warned"), [(4.5, False), (5.5, True)])
def test_drive_is_reported_after_half_of_its_timeout(after: float, warned: bool) -> None:
    clock = FakeClock()
    session = SimpleNamespace(clock=clock, device=1, profile=None)
    kept = SimpleNamespace(session=session)
    watch = SimpleNamespace(
        _kept={1: kept},
        _watch=lambda _: SimpleNamespace(active=True, timeout=10.0),
        _heard=lambda _: clock.monotonic() - after,
        _line=SimpleNamespace(facts=SimpleNamespace(paused={})),
    )
    assert bool(LineWatch.warnings(cast(Any, watch))) is warned


@pytest.mark.parametrize(("after", "reads"), [(4.5, False), (5.5, True)])
async def test_poll_uses_a_word_that_scales_others_for_five_seconds(
    after: float, reads: bool
) -> None:
    taken: list[object] = []
    now = Now()
    known = SimpleNamespace(time=now() - after)
    image = SimpleNamespace(get=lambda _: known, trusted={"S"}, refused={})

    async def take(codes: frozenset[str], _: object) -> None:
        taken.extend(codes)

    reader = SimpleNamespace(
        profile={"V": None}, session=SimpleNamespace(clock=now, image=image), _take=take
    )
    reader._is_known = lambda *what: Reader._is_known(cast(Any, reader), *what)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("tui.session.read.reader.sources_of", lambda _: ["S"])
        await Reader._read_sources(cast(Any, reader), ["V"], Priority.POLL)
    assert bool(taken) is reads


async def test_poll_uses_values_of_other_programs_of_half_a_cycle() -> None:
    sent: list[Any] = []
    inside = SimpleNamespace(clock=lambda: 100.0, pace=SimpleNamespace(stretch=1.0))
    inside.submit = sent.append
    plan = SimpleNamespace(
        message=SimpleNamespace(plan=SimpleNamespace(device=1, period=2.0)),
        client=SimpleNamespace(limits={}, program=SimpleNamespace(id="p")),
        read_at={},
    )
    with pytest.MonkeyPatch.context() as patched, suppress(asyncio.TimeoutError):
        patched.setattr("tui.bus.share.polls._ended", lambda _: asyncio.Future())
        work = PollsServed._read(
            cast(Any, SimpleNamespace(_inside=inside)), cast(Any, plan), PlannedRead(1, 1, 3)
        )
        await asyncio.wait_for(work, 0.01)
    assert 0.8 < sent[0].max_age < 1.2
