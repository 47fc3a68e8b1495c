"""Stops of all motors as the panel ends: what is ordered, and the result that a person reads."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.screens import last_stops
from tui.screens.last_stops import BY, STANDSTILL_NOT_KNOWN, LastStops, LineStops
from tui.session.command.stop_report import Phase, StopReport


class Fleet:
    """Drives of one line; `fails` are the calls that raise an error."""

    def __init__(self, *devices: int, started: tuple[int, ...] = (), fails: str = "") -> None:
        self.did: list[tuple[object, ...]] = []
        self.fails = fails
        self.clock = 100.0
        self.console = lambda device: f"console {device}"
        self.reports: dict[int, StopReport] = {}
        self.summary = SimpleNamespace(reports=[], ended=True, failed=False)
        self.stopper = SimpleNamespace(wait=self._wait, reports=self.reports)
        self.line_watch = SimpleNamespace(under_command=self._under_command)
        self.sessions = [self._session(device, device in started) for device in devices]
        self.commanded = self.sessions[:1]

    def _session(self, device: int, started: bool) -> Any:
        starts = SimpleNamespace(holds=lambda _: started) if device != 9 else None
        work = SimpleNamespace(stop=lambda by: self._do("work", device, by))
        return SimpleNamespace(device=device, starts=starts, work=work)

    def _do(self, *what: object) -> None:
        self.did.append(what)
        if str(what[0]) in self.fails.split() or f"{what[0]}{what[1]}" in self.fails.split():
            raise RuntimeError(f"{what[0]} failed")

    def _under_command(self) -> list[Any]:
        if "watch" in self.fails:
            raise RuntimeError("the watch failed")
        return self.sessions[1:2]

    def _wait(self, sessions: list[Any], seconds: float) -> Any:
        self._do("wait", tuple(item.device for item in sessions), seconds)
        self.clock += 5.0
        return self.summary

    def stop(self, sessions: list[Any], *, by: str) -> None:
        self._do("stop", *(item.device for item in sessions), by)

    def last_stop(self, error: Exception, console: object) -> None:
        self.did.append(("last", f"{error}", console))


def stops_of(fleet: Fleet, label: str = "") -> LineStops:
    return LineStops(cast(Any, fleet), label)


def test_work_ends_before_the_motors_that_were_started_here_are_stopped() -> None:
    fleet = Fleet(1, 2, 3, started=(2, 3))
    stops = stops_of(fleet)
    stops.order()
    works = [("work", device, BY) for device in (1, 2, 3)]
    assert fleet.did == [*works, ("stop", 2, 3, BY)]
    assert [session.device for session in stops.sessions] == [2, 3]
    assert stops.troubles == {}


def test_line_without_a_motor_is_sent_no_stop() -> None:
    fleet = Fleet(9)
    stops = stops_of(fleet)
    stops.order()
    assert fleet.did == [("work", 9, BY)]
    assert stops.lines() == []


@pytest.mark.internal_errors
def test_work_that_cannot_be_ended_and_a_watch_that_fails_prevent_no_stop() -> None:
    fleet = Fleet(1, 2, fails="work1 watch")
    stops = stops_of(fleet)
    stops.order()
    assert fleet.did == [("work", 1, BY), ("work", 2, BY), ("stop", 1, BY)]


@pytest.mark.internal_errors
def test_error_of_one_motor_prevents_no_stop_of_the_others() -> None:
    fleet = Fleet(1, 2, 3, started=(2, 3), fails="stop2")
    stops = stops_of(fleet)
    stops.order()
    assert fleet.did[3:] == [
        ("stop", 2, 3, BY),
        ("stop", 2, BY),
        ("last", "stop failed", "console 2"),
        ("stop", 3, BY),
    ]
    assert stops.troubles == {2: "stop failed"}
    fleet.fails = ""
    stops.order()
    assert stops.troubles == {}, "the second attempt was sent"


@pytest.mark.internal_errors
def test_prepared_frames_need_the_console_of_the_drive() -> None:
    fleet = Fleet(1, 2, fails="stop")
    fleet.console = cast(Any, lambda device: None)
    stops = stops_of(fleet)
    stops.order()
    assert not [entry for entry in fleet.did if entry[0] == "last"]


@pytest.mark.parametrize(
    ("reports", "ended", "failed", "trouble", "stood"),
    [
        (2, True, False, False, True),
        (1, True, False, False, False),
        (2, False, False, False, False),
        (2, True, True, False, False),
        (1, True, False, True, False),
    ],
)
def test_wait_is_true_if_every_motor_was_read_at_standstill(
    reports: int, ended: bool, failed: bool, trouble: bool, stood: bool
) -> None:
    fleet = Fleet(1, 2)
    stops = stops_of(fleet)
    stops.sessions = fleet.sessions
    if trouble:
        stops.troubles[1] = "why"
    fleet.summary = SimpleNamespace(reports=[object()] * reports, ended=ended, failed=failed)
    assert stops.wait(7.0) is stood
    assert fleet.did == [("wait", (2,) if trouble else (1, 2), 7.0)]
    assert stops.followed


@pytest.mark.internal_errors
def test_wait_that_fails_leaves_it_unknown_if_the_motor_stopped() -> None:
    fleet = Fleet(1, fails="wait")
    stops = stops_of(fleet)
    stops.sessions = fleet.sessions
    fleet.reports[1] = StopReport(1, Phase.STOPPING, "Ramp stop", 0.0, 0.0)
    assert stops.wait(7.0) is False
    assert stops.lines() == [f"Device 1: {STANDSTILL_NOT_KNOWN}"]


@pytest.mark.parametrize(
    ("phase", "text", "line"),
    [
        (Phase.STOPPED, "stopped", "stopped."),
        (Phase.FAILED, "NOT STOPPED: why.", "NOT STOPPED: why."),
        (
            Phase.STOPPING,
            "ramp stop, 12 Hz",
            "NOT STOPPED after 60 s: ramp stop, 12 Hz. Stop it at the machine.",
        ),
        (
            Phase.UNHEEDED,
            "NOT STOPPED: its command source is Terminals.",
            "NOT STOPPED after 60 s: its command source is Terminals. Stop it at the machine.",
        ),
        (None, "", "NOT STOPPED: no stop was sent. Stop it at the machine."),
    ],
)
def test_result_of_each_motor_is_a_line(phase: Phase | None, text: str, line: str) -> None:
    fleet = Fleet(1)
    stops = stops_of(fleet, "pumps: ")
    stops.sessions = fleet.sessions
    if phase is not None:
        fleet.reports[1] = StopReport(1, phase, text, 0.0, 0.0)
    assert stops.lines() == [f"pumps: Device 1: {line}"]
    stops.troubles[1] = "the line is closed"
    expected = "pumps: Device 1: NOT STOPPED: the line is closed. Stop it at the machine."
    assert stops.lines() == [expected]


def test_lines_share_one_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = Fleet(1), Fleet(2, 3)
    time = SimpleNamespace(monotonic=lambda: first.clock)
    monkeypatch.setattr(last_stops, "time", time)
    both = LastStops([stops_of(first, "a: "), stops_of(second)])
    assert both.begun == ""
    for line in both.lines:
        line.sessions = cast(Any, line.fleet).sessions
        cast(Any, line.fleet).summary.reports = line.sessions
    assert both.begun == "Stopping devices a: 1, 2, 3."
    assert LastStops(both.lines[:1]).begun == "Stopping device a: 1."
    assert both.wait()
    assert (first.did, second.did) == ([("wait", (1,), 60.0)], [("wait", (2, 3), 55.0)])
    first.clock = 100.0
    second.summary.failed = True
    assert not both.wait()
    assert both.follow().splitlines() == [text for line in both.lines for text in line.lines()]
    assert both.follow().count("Device") == 3
