"""A stop while the loop of the line hangs in its program: the keeper carries it out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.limits import HANGS_AFTER
from tui.bus.api import LineStatus, LineWorker
from tui.bus.fake import FakeLine
from tui.bus.model import Timing
from tui.drive.profile import library
from tui.session.command import under_way
from tui.session.command.stop import Stopper
from tui.session.drive import DriveSession
from tui.session.journal import Journal

from .test_handover import Heard

DRIVES = (1, 2, 3)


class NeverBegins:
    """Work that waits for a loop which hangs."""

    def cancel(self) -> None:
        """It never ends."""

    def done(self) -> bool:
        return False


class HungLine(FakeLine):
    """A line whose loop accepts no new work."""

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        return NeverBegins()


def stopped(line: FakeLine) -> Heard:
    """Notices of other programs about a stop of all drives."""
    voice = line.facts.voice = Heard()
    stopper = Stopper(line, Journal())
    stopper.stop([DriveSession(line, drive, library.load("atv71")) for drive in DRIVES])
    return voice


async def direct_stop(voice: Heard) -> tuple[object, ...] | None:
    """The first direct stop, if one is sent within some seconds."""
    for _ in range(500):
        if found := [pair for pair in voice.output if pair[0] == "directly"]:
            return found[0]
        await asyncio.sleep(0.01)
    return None


async def test_keeper_stops_drives_whose_stop_does_not_begin() -> None:
    voice = stopped(HungLine({drive: {} for drive in DRIVES}))
    assert await direct_stop(voice) == ("directly", DRIVES)


async def test_direct_stop_is_repeated_until_the_keeper_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(under_way, "STOP_REPEATED_EVERY", 0.05)
    tries: list[tuple[int, ...]] = []

    class Silent(Heard):
        def stop_directly(self, devices: tuple[int, ...]) -> None:
            tries.append(devices)
            if len(tries) < 3:
                raise OSError("it does not answer")

    line = HungLine({drive: {} for drive in DRIVES})
    line.facts.voice = Silent()
    stopper = Stopper(line, Journal())
    stopper.stop([DriveSession(line, drive, library.load("atv71")) for drive in DRIVES])
    for _ in range(500):
        if len(tries) >= 3:
            break
        await asyncio.sleep(0.01)
    await asyncio.sleep(0.5)
    assert tries == [DRIVES] * 3


async def test_working_loop_sends_no_direct_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(under_way, "HANGS_AFTER", 3.0)
    voice = stopped(FakeLine({drive: {} for drive in DRIVES}))
    assert await direct_stop(voice) is None


def test_hung_loop_is_detected_before_a_second_key_press() -> None:
    assert HANGS_AFTER <= 0.3


# -- the watch over first frames, in time that passes by sleeping only -----------------------------


class Watched:
    """Stops under way; `then` changes them at a time, `sent` is what the watch did, and when."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, voice: bool = True) -> None:
        self.now = 0.0
        self.sent: list[tuple[object, ...]] = []
        self.then: dict[float, Callable[[], object]] = {}
        self.threads: list[dict[str, object]] = []
        self._monkeypatch = monkeypatch
        self.line = FakeLine()
        if voice:
            self.line.facts.voice = cast(Any, self)
        monkeypatch.setattr(under_way, "time", self)
        monkeypatch.setattr(under_way, "threading", SimpleNamespace(Thread=self._thread))

    def stop_directly(self, devices: tuple[int, ...]) -> None:
        self.sent.append((round(self.now, 2), "directly", *devices))

    def _thread(self, *, target: Callable[[], None], **how: object) -> SimpleNamespace:
        self.threads.append(how)
        return SimpleNamespace(start=target)

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        for when in [when for when in self.then if self.now >= when]:
            self.then.pop(when)()

    def work(self, device: int, *, begun: bool = False, done: bool = False) -> Any:
        session = SimpleNamespace(device=device, line=self.line, arming=SimpleNamespace(times=2))
        stop = SimpleNamespace(
            session=session, begun=begun, sent=False, over=False, ordered=7.0, wanted="stop"
        )
        worker = SimpleNamespace(done=lambda: done)
        return under_way.UnderWay(cast(Any, stop), cast(Any, worker), 2)

    def watch(self, *works: Any) -> list[tuple[object, ...]]:
        def send_last(session: Any, ordered: float, error: Exception) -> None:
            self.sent.append((round(self.now, 2), session.device, ordered, f"{error}"))

        under_way.watch_first_frames(works, Timing(first_timeout=1.0), send_last)
        return self.sent


LATE = "its frame was not sent in time"


def test_stop_that_does_not_begin_is_sent_directly_then_by_its_prepared_frames(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watched(monkeypatch)
    assert here.watch(here.work(1)) == [(0.3, "directly", 1), (1.05, 1, 7.0, LATE)]


def test_stop_that_began_has_the_time_of_the_reads_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watched(monkeypatch)
    found = here.watch(here.work(1, begun=True), here.work(2, begun=True))
    assert found == [(1.35, "directly", 1, 2), (7.65, 1, 7.0, LATE), (7.65, 2, 7.0, LATE)]


def test_limits_of_the_watch_are_exceeded_at_a_later_moment_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    exact = {"STANDSTILL_POLL_INTERVAL": 0.25, "HANGS_AFTER": 0.75, "FIRST_FRAME_EACH": 0.25}
    for name, seconds in exact.items():  # each moment is then exact, too
        monkeypatch.setattr(under_way, name, seconds)
    here = Watched(monkeypatch)
    assert here.watch(here.work(1)) == [(1.0, "directly", 1), (1.25, 1, 7.0, LATE)]
    here = Watched(monkeypatch)
    assert here.watch(here.work(1, begun=True)) == [(2.25, "directly", 1), (7.5, 1, 7.0, LATE)]


def test_stop_whose_work_ended_unsent_is_sent_immediately(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Watched(monkeypatch)
    assert here.watch(here.work(1, begun=True, done=True)) == [(0.15, 1, 7.0, LATE)]


@pytest.mark.parametrize("how", ["sent", "over"])
def test_stop_that_was_sent_or_replaced_is_watched_no_longer(
    how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Watched(monkeypatch)
    work = here.work(1)
    here.then[0.1] = lambda: setattr(work.stop, how, True)
    assert here.watch(work) == []
    assert here.now == 0.15
    assert here.threads == [{"name": "stops sent", "daemon": True}]
    assert here.watch() == []
    assert len(here.threads) == 1, "a key that is held down starts no thread for each repeat"


def test_stop_that_does_not_begin_on_a_lost_line_waits_for_the_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here = Watched(monkeypatch, voice=False)
    here.line.become(LineStatus.LOST)
    assert here.watch(here.work(1)) == [(7.35, 1, 7.0, LATE)]


def test_equal_stop_adds_nothing_while_its_words_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Watched(monkeypatch)
    work, done = here.work(1), here.work(1, done=True)
    assert work.goes_out(work.stop.session, "stop")
    assert not done.goes_out(done.stop.session, "stop")
    assert not work.goes_out(work.stop.session, "quick-stop")
    assert not work.goes_out(done.stop.session, "stop")
    work.stop.session.arming.times += 1
    assert not work.goes_out(work.stop.session, "stop"), "it was armed since"
    work.stop.session.arming.times -= 1
    work.stop.sent = True
    assert not work.goes_out(work.stop.session, "stop")
