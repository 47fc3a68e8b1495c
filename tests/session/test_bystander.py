"""Polling by an observer keeps no motor running whose commander has died."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.limits import GRACE_SHARE
from tui.session.drive import DriveSession
from tui.session.sharing.observer_poller import (
    ACTED_AFTER,
    COMMANDER_SILENT,
    UNKNOWN_TIMEOUT_ACTED,
    ObserverPoller,
)
from tui.session.timeout_report import Timeout, TimeoutWatch

TTO = 10.0


@dataclass
class Bench:
    """An observed drive, at a time that the test sets."""

    time: float = 100.0
    sign: float | None = None
    """Time of the last message of the client that started the motor."""
    heard: float = 100.0
    latest: Any = None
    timeout: Timeout | None = field(
        default_factory=lambda: Timeout(known=True, watch=TimeoutWatch(TTO, None))
    )

    def __post_init__(self) -> None:
        line = SimpleNamespace(device_state=lambda _: SimpleNamespace(heard=self.heard))
        session = SimpleNamespace(line=line, device=1)
        self.session = session
        self.looks_on = ObserverPoller(
            cast(DriveSession, session), lambda: self.sign, lambda: self.latest, lambda: self.time
        )

    def asks(self, after: float = 1.0) -> bool:
        """Return True if the drive is polled some seconds later; it answers then."""
        self.time += after
        self.session.timeout = self.timeout
        why = self.looks_on.pause_reason()
        assert why in ("", COMMANDER_SILENT)
        assert self.looks_on.waits == bool(why)
        if not why:
            self.heard = self.time
        return not why

    def saw(self, motion: str, error: str = "") -> None:
        """Set the result of the last cycle to the current time."""
        state = SimpleNamespace(motion=motion)
        self.latest = SimpleNamespace(state=state, error=error, time=self.time)


def test_drive_without_a_commander_is_polled() -> None:
    bench = Bench()
    assert all(bench.asks() for _ in range(5))


def test_drive_is_polled_for_a_while_after_each_heartbeat_of_its_commander() -> None:
    bench = Bench()
    bench.saw("running")
    for _ in range(3):
        bench.sign = bench.time
        assert bench.asks(0.5)
        assert bench.asks(GRACE_SHARE * TTO - 0.5)
    assert not bench.asks(0.1), "the client has died"
    # nothing restarts its timeout; once it has expired, the drive is read
    assert not bench.asks(TTO - 0.2)
    assert bench.asks(ACTED_AFTER + 0.2)
    assert not bench.asks()


def test_drive_of_a_slow_commander_is_polled_once_per_heartbeat() -> None:
    bench = Bench()
    bench.saw("running")
    for _ in range(3):
        bench.sign = bench.time
        assert bench.asks(GRACE_SHARE * TTO + 1.0)
        assert not bench.asks()


def test_motor_at_standstill_is_still_polled() -> None:
    bench = Bench()
    bench.sign = bench.time
    assert bench.asks()
    bench.saw("fault")
    assert bench.asks(), "no dead commander resets it"
    bench.saw("stopped")
    assert bench.asks()
    assert bench.asks()
    bench.saw("stopped", error="No answer.")
    assert not bench.asks(GRACE_SHARE * TTO)
    bench.saw("stopped")
    bench.time += 1
    bench.sign = bench.time
    assert bench.asks(), "it was told something since"
    assert not bench.asks(GRACE_SHARE * TTO), "and was not seen since"


@pytest.mark.parametrize(
    ("timeout", "silence"),
    [(None, UNKNOWN_TIMEOUT_ACTED), (Timeout(known=False), UNKNOWN_TIMEOUT_ACTED)],
)
def test_unknown_timeout_counts_as_long(timeout: Timeout | None, silence: float) -> None:
    bench = Bench(timeout=timeout, sign=0.0)
    assert not bench.asks(silence - 1.0)
    assert bench.asks(2.0)


def test_drive_without_a_timeout_is_still_polled() -> None:
    bench = Bench(timeout=Timeout(known=True), sign=0.0)
    assert bench.asks()
    assert bench.asks()


def test_motor_left_by_an_exited_program_is_not_kept_alive() -> None:
    bench = Bench()
    bench.looks_on.orphan = True
    bench.saw("running")
    assert not bench.asks()
    assert bench.asks(TTO + ACTED_AFTER)
    bench.saw("stopped")
    assert bench.asks()
    assert not bench.looks_on.orphan
    bench.saw("running")
    assert bench.asks(), "somebody else has started it since"
