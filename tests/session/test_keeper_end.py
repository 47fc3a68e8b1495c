"""Start and end of a keeper, and what it leaves to the next program; without a line."""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest

from tui.bus.line import timing_of
from tui.bus.line_events import NoticeReceived, ProgramsChanged
from tui.bus.link import parse_link
from tui.bus.model import LineStatus
from tui.bus.program import KEEPER, Program
from tui.bus.share.keeper_share import Keeping
from tui.bus.share.keeping import KeeperOrder
from tui.bus.share.messages import VERSION
from tui.keeper import process
from tui.keeper.process import Keeper
from tui.session.events import EventLog


class Timed:
    """Time that passes by sleeping only."""

    def __init__(self) -> None:
        self.now = 100.0
        self.slept: list[float] = []

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


class Bench:
    """A keeper whose line and motors the test sets."""

    def __init__(self, others: int = 0, connected: bool = True, ordered: bool = False) -> None:
        self.keeper = cast(Any, object.__new__(Keeper))
        self.events: list[tuple[object, ...]] = []
        self.facts = SimpleNamespace(others=[object()] * others)
        status = LineStatus.CONNECTED if connected else LineStatus.LOST
        self.keeper._line = SimpleNamespace(facts=self.facts, state=SimpleNamespace(status=status))
        self.keeper._guardian = SimpleNamespace(busy=False)
        self.keeper._ordered = ordered
        self.keeper._ended = threading.Event()
        self.keeper._events = SimpleNamespace(add=lambda *what: self.events.append(what))

    def stops_a_motor(self) -> None:
        self.keeper._guardian.busy = True


@pytest.mark.parametrize(("connected", "seconds"), [(True, 60.0), (False, 2.0)])
@pytest.mark.parametrize("ordered", [True, False])
@pytest.mark.parametrize("others", [0, 1])
def test_keeper_waits_for_a_motor_for_a_minute_but_not_for_a_lost_line(
    connected: bool, seconds: float, ordered: bool, others: int
) -> None:
    bench = Bench(others, connected, ordered)
    bench.stops_a_motor()
    assert bench.keeper._is_needed(0.0)
    assert bench.keeper._is_needed(seconds - 0.1)
    # programs that are attached have ten seconds of their own
    assert not bench.keeper._is_needed(seconds if not (others and ordered) else max(seconds, 10.0))


@pytest.mark.parametrize(
    ("others", "ordered", "waited", "needed"),
    [
        (1, True, 0.0, True),
        (1, True, 9.9, True),
        (1, True, 10.0, False),
        (1, False, 0.0, False),
        (0, True, 0.0, False),
        (0, False, 0.0, False),
    ],
)
@pytest.mark.parametrize("connected", [True, False])
def test_keeper_that_must_end_gives_programs_ten_seconds_to_leave(
    others: int, ordered: bool, waited: float, needed: bool, connected: bool
) -> None:
    assert Bench(others, connected, ordered).keeper._is_needed(waited) is needed


def test_keeper_looks_after_a_motor_in_steps_until_it_is_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    time = Timed()
    monkeypatch.setattr(process, "time", time)
    bench = Bench()
    looks: list[float] = []

    def cares() -> bool:
        looks.append(time.now)
        assert len(looks) < 1000, "it never rests between two looks"
        return time.now < 103.0

    bench.keeper.cares = cares
    bench.keeper._ended.set()
    bench.keeper._until_unneeded()
    assert 103.0 <= time.now < 104.0
    assert max(time.slept) <= 1.0


@pytest.mark.parametrize("ordered", [True, False])
def test_keeper_goes_on_if_a_program_attached_since_unless_it_is_ordered_to_end(
    ordered: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process, "time", Timed())
    bench = Bench(others=1)
    bench.keeper.cares = lambda: False
    waits: list[bool] = []

    def wait() -> None:
        waits.append(bench.keeper._ended.is_set())
        if len(waits) == 2:
            bench.facts.others.clear()  # the last one leaves

    bench.keeper._ended.set()
    monkeypatch.setattr(process, "wait_for", lambda _: wait())
    if ordered:
        bench.keeper.end()
    bench.keeper._until_unneeded()
    assert waits == ([True] if ordered else [True, False])


def test_order_to_end_is_remembered_and_wakes_the_keeper() -> None:
    bench = Bench()
    bench.keeper.end()
    assert (bench.keeper._ordered, bench.keeper._ended.is_set()) == (True, True)


@pytest.mark.parametrize(("device", "kept"), [(3, 3), (0, None)])
def test_notice_that_no_program_hears_is_left_to_the_next_one(
    device: int, kept: int | None
) -> None:
    bench = Bench()
    bench.keeper._hear(NoticeReceived(device, "The motor was stopped."))
    assert bench.events == [("told", "The motor was stopped.", kept)]


def test_notice_that_a_program_hears_is_not_left() -> None:
    bench = Bench(others=1)
    bench.keeper._hear(NoticeReceived(3, "The motor was stopped."))
    alone = Bench()
    alone.keeper._hear(ProgramsChanged())
    assert bench.events == alone.events == []


def test_keeper_cares_while_a_motor_is_being_stopped() -> None:
    bench = Bench()
    assert not bench.keeper.cares()
    bench.stops_a_motor()
    assert bench.keeper.cares()


# -- its start -------------------------------------------------------------------------------------

ORDER = KeeperOrder(
    line="/dev/ttyUSB7", key="usb7", lock_folder="/run/locks", socket_folders=("/run/lines",),
    group=None, before=(Program("gone", "panel", 77),),
)  # fmt: skip
START_OF_A_KEEPER = 20.0
"""Seconds after which a keeper that never began has ended."""


class Begun:
    """The process of a keeper: what it does to itself is recorded in its order, not done."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, version: int = VERSION) -> None:
        self.did: list[tuple[object, ...]] = []
        self.handlers: dict[int, object] = {}
        self.keeper = SimpleNamespace(
            end=lambda: self.did.append(("end",)), work=lambda: self.did.append(("work",))
        )
        order = msgspec.json.encode(msgspec.structs.replace(ORDER, version=version))
        stdin = SimpleNamespace(buffer=io.BytesIO(order), fileno=lambda: 0)
        monkeypatch.setattr(sys, "stdin", stdin)
        monkeypatch.setattr(sys, "argv", ["keeper", "9"])
        monkeypatch.setattr(os, "dup2", self._redirect)
        monkeypatch.setattr(signal, "signal", self._handle)
        for name in ("pthread_sigmask", "setitimer"):
            monkeypatch.setattr(signal, name, self._note(name))
        monkeypatch.setattr(process, "start_logging", self._note("log"))
        monkeypatch.setattr(process, "Keeper", self._made)

    def _note(self, name: str) -> Callable[..., None]:
        return lambda *arguments: self.did.append((name, *arguments))

    def _redirect(self, source: int, target: int) -> None:
        self.did.append(("dup2", os.readlink(f"/proc/self/fd/{source}"), target))

    def _handle(self, number: int, handler: object) -> None:
        self.handlers[number] = handler

    def _made(self, order: KeeperOrder, lock: int) -> object:
        self.did.append(("keeper", order, lock))
        return self.keeper


def test_keeper_begins_without_input_and_ends_if_it_never_holds_its_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun = Begun(monkeypatch)
    process.main()
    assert begun.did == [
        ("dup2", os.devnull, 0),
        ("pthread_sigmask", signal.SIG_SETMASK, ()),
        ("setitimer", signal.ITIMER_REAL, START_OF_A_KEEPER),
        ("log", 0),
        ("keeper", ORDER, 9),
        ("work",),
    ]


def test_keeper_ends_by_signals_that_order_it_and_survives_those_of_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun = Begun(monkeypatch)
    process.main()
    ignored = ("SIGHUP", "SIGUSR1", "SIGUSR2", "SIGTSTP", "SIGTTIN", "SIGTTOU")
    ending = ("SIGTERM", "SIGINT", "SIGQUIT")
    for name in ignored:
        assert begun.handlers.pop(getattr(signal, name)) is signal.SIG_IGN, name
    assert begun.handlers.pop(signal.SIGALRM) is signal.SIG_DFL, "ends it if its loop hangs"
    assert sorted(begun.handlers) == sorted(getattr(signal, name) for name in ending)
    del begun.did[:]
    for number, handler in begun.handlers.items():
        cast("Callable[[int, object], None]", handler)(number, None)
    assert begun.did == [("end",)] * len(ending)


def test_keeper_of_another_version_does_not_touch_the_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun = Begun(monkeypatch, VERSION + 1)
    with pytest.raises(SystemExit, match="has another version"):
        process.main()
    assert begun.did == []


def test_keeper_has_its_line_shared_gated_and_under_its_lock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: dict[str, Any] = {}
    alarms: list[tuple[object, ...]] = []

    def line(link: object, **rest: Any) -> object:
        made.update(rest, link=link)
        return SimpleNamespace(
            facts=SimpleNamespace(events=SimpleNamespace(subscribe=heard.append))
        )

    heard: list[object] = []
    monkeypatch.setattr(process, "Line", line)
    monkeypatch.setattr(process, "record_line", lambda *these: ("recorder", *these))
    monkeypatch.setattr(process, "Journal", lambda: "journal")
    monkeypatch.setattr(process, "OrphanMotorGuard", lambda *these: made.update(guard=these))
    monkeypatch.setattr(process, "EventNotes", lambda *these: made.update(notes=these))
    monkeypatch.setattr(signal, "setitimer", lambda *these: alarms.append(these))
    keeper = cast(Any, Keeper(ORDER, 9))
    assert made["link"] == parse_link(ORDER.line)
    assert made["timing"] == replace(timing_of(made["link"]), trace_length=20_000)
    assert made["place"] == ORDER.place
    assert made["program"].name == KEEPER
    assert made["gated"] is True
    assert made["guard"] == (keeper._line, "journal")
    assert made["notes"] == (keeper._line.facts, keeper._events)
    assert keeper._recorder == ("recorder", keeper._line, ORDER.place.name)
    assert heard == [keeper._hear]
    assert isinstance(keeper._events, EventLog)
    (keeping,) = made["share"].args
    assert isinstance(keeping, Keeping)
    assert (keeping.lock, keeping.before) == (9, ORDER.before)
    assert not keeper._ordered
    keeping.end()
    assert keeper._ended.is_set()
    keeper._guardian = SimpleNamespace(busy=True)
    assert keeping.cares()
    keeping.alarm(2.0)
    assert alarms == [(signal.ITIMER_REAL, 2.0)]


def test_keeper_opens_its_line_and_closes_it_before_its_guard_journal_and_recorder() -> None:
    bench, did = Bench(), []

    def part(name: str, does: str) -> SimpleNamespace:
        return SimpleNamespace(**{does: lambda: did.append(f"{does} {name}")})

    bench.keeper._journal, bench.keeper._guardian = part("journal", "close"), part("guard", "close")
    line = part("line", "open")
    line.close = part("line", "close").close
    bench.keeper._line = line
    bench.keeper._recorder = part("recorder", "close")
    bench.keeper._until_unneeded = lambda: did.append("waits")
    bench.keeper.work()
    assert did == [
        "open line",
        "waits",
        "close line",
        "close guard",
        "close journal",
        "close recorder",
    ]
