"""When a keeper ends, and what it leaves to the next program; without a line or a process."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.line_events import NoticeReceived, ProgramsChanged
from tui.bus.model import LineStatus
from tui.keeper import process
from tui.keeper.process import Keeper


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
    assert not bench.keeper._is_needed(max(seconds, 10.0))


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
    monkeypatch.setattr(bench.keeper._ended, "wait", wait)
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
