"""Stops that begin without a wire: what they replace, and which of several fail."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.errors import LineClosed
from tui.drive.profile import library
from tui.session.command import stop as stops
from tui.session.command.stop import STOP_WAITS, Stopper
from tui.session.command.stop_report import Phase
from tui.session.command.under_way import UnderWay
from tui.session.drive import DriveSession
from tui.session.journal import Journal

from .test_stop_choice import session_of
from .test_stop_followed import PROFILE, OwnTime, Ramp, journal

__all__ = ["journal"]


class Worker:
    """Work that never begins."""

    def __init__(self) -> None:
        self.is_done = self.canceled = False

    def done(self) -> bool:
        return self.is_done

    def cancel(self) -> None:
        self.canceled = True


class Begun:
    """A stopper whose work never begins; `watched` are the arguments of each check."""

    def __init__(self, journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
        self.drive = Ramp(OwnTime(), 0.0)
        self.workers: list[Worker] = []
        self.work: list[tuple[Any, str]] = []
        self.watched: list[Any] = []
        self.sent: list[Any] = []
        cast(Any, self.drive).spawn = self._spawn
        self.stopper = Stopper(self.drive, journal)
        self.stopper._last = cast(Any, SimpleNamespace(send=lambda *of: self.sent.append(of)))
        monkeypatch.setattr(stops, "watch_first_frames", lambda *of: self.watched.append(of))

    def _spawn(self, work: Any, name: str) -> Worker:
        self.work.append((work, name))
        self.workers.append(Worker())
        return self.workers[-1]

    def session(self, device: int = 1) -> DriveSession:
        return DriveSession(self.drive, device, PROFILE, clock=self.drive.clock)

    def begun(self, device: int = 1) -> UnderWay:
        return self.stopper._under_way[device]


def test_stop_ends_the_work_on_its_drive_and_is_watched(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Begun(journal, monkeypatch)
    session = here.session()
    session.arming.arm()
    heard: list[object] = []
    monkeypatch.setattr(here.drive.facts, "give_stop", lambda *of: heard.append(of))
    before = session.work.stops
    here.stopper.stop([session])
    assert heard == [([1], "the stop key")]
    assert session.work.stops == before + 1
    assert not session.arming.armed
    found = here.begun()
    assert here.watched == [([found], here.drive.timing, here.stopper._last.send)]
    assert (found.stop.session, found.stop.order, found.stop.ordered) == (session, "stop", 1000.0)
    assert (found.worker, found.times, found.stop.wave) == (
        here.workers[0], session.arming.times, None,
    )  # fmt: skip
    report = here.stopper.reports[1]
    assert (report.phase, report.text) == (Phase.SENDING, STOP_WAITS)


@pytest.mark.parametrize("change", ["", "sent", "done", "armed", "session", "order"])
def test_stop_that_still_waits_is_not_begun_again_unless_something_has_changed(
    change: str, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Begun(journal, monkeypatch)
    session = again = here.session()
    here.stopper.stop([session])
    first = here.begun()
    assert first.goes_out(session, "stop")
    if change == "sent":
        first.stop.sent = True
    elif change == "done":
        here.workers[0].is_done = True
    elif change == "armed":
        session.arming.arm()
    elif change == "session":
        again = here.session()
    order: Any = "quick-stop" if change == "order" else "stop"
    assert first.goes_out(again, order) == (not change)
    here.stopper.stop([again], order)
    assert len(here.workers) == (2 if change else 1)
    assert (first.stop.over, here.workers[0].canceled) == (bool(change), bool(change))
    assert (here.begun() is first) == (not change)
    assert here.watched[1][0] == ([here.begun()] if change else [])


@pytest.mark.internal_errors
def test_stop_of_one_drive_that_fails_leaves_those_of_the_others(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Begun(journal, monkeypatch)
    sessions = [here.session(device) for device in (1, 2, 3)]
    by_its_own = here.stopper._by_its_own
    errors: dict[int, Exception] = {1: LineClosed("closed"), 2: ZeroDivisionError("odd")}

    def own(session: DriveSession) -> DriveSession:
        if (error := errors.get(session.device)) is not None:
            raise error
        return by_its_own(session)

    cast(Any, here.stopper)._by_its_own = own
    with pytest.raises(LineClosed):
        here.stopper.stop(sessions)
    assert here.sent == [(sessions[1], 1000.0, errors[2])]
    assert [name for _, name in here.work] == ["stop 3"]
    del errors[1]
    here.stopper.stop(sessions)
    behind, name = here.work[-1]
    assert name == "stop all"
    wave = here.begun(1).stop.wave
    assert behind.args == (wave, {2, 3}, [sessions[0]], "stop"), "3 still waits, 2 has failed"


def test_time_is_that_of_the_system_if_the_clock_of_a_drive_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(stops, "time", SimpleNamespace(monotonic=lambda: 5.0))
    clock = SimpleNamespace(monotonic=lambda: 7.0)
    assert stops._now(cast(Any, SimpleNamespace(clock=clock))) == 7.0
    assert stops._now(cast(Any, SimpleNamespace(clock=None))) == 5.0


@pytest.mark.internal_errors
@pytest.mark.parametrize(
    ("answers", "likely", "urgency"),
    [(False, True, 2), (True, True, 0), (None, False, 1), (True, False, 1), (True, None, 1)],
)
def test_running_motors_are_stopped_first_and_silent_drives_last(
    answers: bool | None, likely: bool | None, urgency: int, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    def is_likely(_: object) -> bool:
        return 1 / 0 > 0 if likely is None else likely

    monkeypatch.setattr(stops, "is_likely_to_run", is_likely)
    line = SimpleNamespace(device_state=lambda _: SimpleNamespace(answers=answers))
    session = cast(Any, SimpleNamespace(line=line, device=4))
    assert stops._urgency(session) == urgency
    assert ("device 4 has no place among the stops" in caplog.text) == (likely is None)


def test_session_of_the_own_family_has_the_clock_of_the_drive(journal: Journal) -> None:
    session = session_of("powerdrive", "atv71", own="atv71", reference="ATV71HU15M3")
    session.clock = OwnTime()
    assert Stopper(session.line, journal)._by_its_own(session).clock is session.clock


@pytest.mark.internal_errors
@pytest.mark.parametrize("fails", [True, False])
def test_prepared_frames_are_sent_whatever_ends_the_work(
    fails: bool, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Begun(journal, monkeypatch)
    session, error = here.session(), ZeroDivisionError("odd")
    given: list[object] = []

    def end_work(of: DriveSession, by: str) -> None:
        given.append(by)
        of.work.stops += 1 // (not fails)

    monkeypatch.setattr(stops, "end_work", end_work)
    monkeypatch.setattr(stops, "time", SimpleNamespace(monotonic=lambda: 5.0))
    before = session.work.stops
    here.stopper.send_prepared(session, error)
    assert session.work.stops == before + 1
    assert (given, here.sent) == (["the stop key"], [(session, 5.0, error)])


async def test_phases_of_a_stop_are_in_the_log(
    journal: Journal, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", logger=stops.log.name)
    drive = Ramp(OwnTime(), 0.0)
    stopper = Stopper(drive, journal)
    stopper._say(DriveSession(drive, 4, PROFILE, clock=drive.clock), Phase.FAILED, "why", 990.0)
    assert "stop of device 4: failed, why" in caplog.text


def test_stops_of_several_threads_begin_one_after_another(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Begun(journal, monkeypatch)
    locked: list[bool] = []
    begin, load = here.stopper._begin, library.load

    def begins(*of: Any) -> Any:
        locked.append(here.stopper._lock.locked())
        return begin(*of)

    def loads(family: str) -> Any:
        locked.append(here.stopper._lock.locked())
        return load(family)

    cast(Any, here.stopper)._begin = begins
    wrong = session_of("powerdrive", "atv71", own="atv71", reference="ATV71HU15M3")
    monkeypatch.setattr(library, "load", loads)
    here.stopper.stop([here.session()])
    here.stopper._by_its_own(wrong)
    assert locked == [True, True]
    assert not here.stopper._lock.locked()
