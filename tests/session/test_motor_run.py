"""One motor from its run command to standstill, in time that passes by sleeping only."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.errors import LineError, NoAnswer
from tui.session.command.stop_report import Phase, StopReport, StopSummary
from tui.session.running import motor_run, watching
from tui.session.running.ending import Ending, MotorStopped, MotorTripped, NotStopped
from tui.session.running.motor_run import MotorRun

POLL = 0.05
NOT_STOPPED = StopReport(1, Phase.FAILED, "NOT STOPPED: why.", 0.0, 0.0)
STOPPED = StopReport(1, Phase.STOPPED, "stopped", 0.0, 0.0)


def state(kind: str = "running", **more: object) -> SimpleNamespace:
    usual = {"fault": None, "local": False, "motion": kind, "headline": f"It is {kind}"}
    return SimpleNamespace(kind=kind, **{**usual, **more})


class Rig:
    """A run whose cycles a test gives in their order; the last one repeats."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *states: SimpleNamespace) -> None:
        self.now = 1000.0
        self.events: list[tuple[str, str]] = []
        self.shown: list[int] = []
        self.warned: list[str] = []
        self.stops: list[tuple[str, str]] = []
        self.results: list[StopReport] = [STOPPED]
        self.after_stop: Callable[[], None] = lambda: None
        self.after_sleep: Callable[[], None] = lambda: None
        self.states = list(states or [state()])
        self.kind_read = "ready"
        """The kind of state that the stop has read last."""
        self.hertz: float | None = 20.0
        self.error = ""
        self.cycle = 0
        self.prepared = 0
        self.ahead = 0.01
        """Seconds from a moment to the cycle that is the latest one then."""
        self.sent: list[Any] = []
        self.learned = True
        self.work = SimpleNamespace(stops=3, stopped_by="")
        self.lost_words = ""
        self.reads: list[object] = []
        frequency = SimpleNamespace(code="HZ")
        session = SimpleNamespace(
            device=1, work=self.work, followed=("CMD",), contradiction="",
            state=lambda _: SimpleNamespace(kind=self.kind_read),
            profile=SimpleNamespace(quantity=lambda _: frequency),
        )  # fmt: skip
        given = SimpleNamespace(changed_words=lambda: self.lost_words)
        self.console = SimpleNamespace(
            device=1, session=session, commander=SimpleNamespace(given=given), read=self._read
        )
        self.reports: dict[int, StopReport] = {}
        stopper = SimpleNamespace(stop=self._stop, ended=self._ended, reports=self.reports)
        fleet = SimpleNamespace(journal=SimpleNamespace(sent=()), stopper=stopper)
        self.fleet = fleet
        observer = SimpleNamespace(
            report=lambda event, text: self.events.append((event, text)),
            show=lambda latest, text: self.shown.append(latest.cycle),
            warn=self.warned.append,
        )
        monkeypatch.setattr(motor_run, "time", SimpleNamespace(monotonic=lambda: self.now))
        monkeypatch.setattr(motor_run, "latest_of", lambda _: self.latest())
        monkeypatch.setattr(motor_run, "with_text", lambda readings: readings)
        monkeypatch.setattr(motor_run, "polling_stop_text", lambda *_, watch: f"watch {watch}.")
        monkeypatch.setattr(motor_run, "learned_timeout", self._learn)
        loop = {name: getattr(asyncio, name) for name in ("create_task", "wait", "FIRST_COMPLETED")}
        own = SimpleNamespace(**loop, wait_for=self._wait_for, sleep=self._sleep)
        monkeypatch.setattr(motor_run, "asyncio", own)
        self.run = MotorRun(
            cast(Any, fleet), cast(Any, self.console), Ending(), cast(Any, observer), "a test",
            self._prepare, self._command,
        )  # fmt: skip

    async def _learn(self, fleet: object, console: object) -> str:
        assert (fleet, console) == (self.fleet, self.console)
        return "learned"

    async def _prepare(self) -> None:
        assert not self.run.may_turn
        self.prepared += 1

    async def _command(self) -> None:
        assert self.run.may_turn, "its frame may be on the way"
        assert self.prepared == 1
        self.journal("run forward")

    def journal(self, why: str, device: int = 1) -> None:
        self.fleet.journal.sent += (SimpleNamespace(device=device, why=why),)

    async def _read(self, codes: object) -> None:
        self.reads.append(codes)
        raise NoAnswer(1, 3, 1)

    async def _wait_for(self, waiting: Any, seconds: float) -> None:
        assert seconds == POLL
        waiting.close()
        await self._sleep(seconds)
        raise TimeoutError

    async def _sleep(self, seconds: float) -> None:
        self.now += seconds
        assert self.now < 2000.0, "it does not end"
        self.after_sleep()

    def latest(self) -> Any:
        """A further cycle; a run looks once in each of its turns."""
        self.cycle += 1
        now = self.states.pop(0) if len(self.states) > 1 else self.states[0]
        readings = {} if self.hertz is None else {"HZ": SimpleNamespace(number=self.hertz)}
        return SimpleNamespace(
            cycle=self.cycle,
            time=self.now + self.ahead,
            state=now,
            error=self.error,
            readings=readings,
        )

    def _stop(self, sessions: list[Any], *, by: str) -> None:
        assert [session.device for session in sessions] == [1]
        self.stops.append(("stop", by))

    async def _ended(self, sessions: list[Any], seconds: float) -> StopSummary:
        assert [session.device for session in sessions] == [1]
        assert 0 < seconds < 1.0  # it looks for a drive that does not stop
        self.reports[1] = self.results.pop(0) if len(self.results) > 1 else self.results[0]
        summary = StopSummary([self.reports[1]])
        if summary.ended:
            self.after_stop()
        return summary


async def test_run_is_stopped_after_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds = 2.0
    await rig.run.carry_out()
    assert rig.now == pytest.approx(1002.05, abs=0.06)
    assert rig.events == [("stopping", "stopping (after 2 s)"), ("stopped", "Device 1: stopped.")]
    assert rig.stops == [("stop", "a test")]
    assert cast(Any, rig.run.watch) == "learned"
    assert rig.shown == sorted(set(rig.shown))
    assert len(rig.shown) > 30


async def test_run_ends_with_a_stop_if_another_drive_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its motor may run, and this run has not started it."""
    rig = Rig(monkeypatch)

    def replaced() -> None:
        rig.console.session.contradiction = "Device 1 says it is another."

    rig.after_sleep = replaced
    with pytest.raises(MotorStopped) as caught:
        await rig.run.carry_out()
    text = "The run has ended: another drive answers. Device 1 says it is another."
    assert str(caught.value) == text
    assert rig.events[0] == ("ended", text)
    assert rig.stops == [("stop", "a test")]


async def test_run_left_running_is_not_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds, rig.run.leave_running = 1.0, True
    await rig.run.carry_out()
    assert rig.stops == []
    assert rig.events == [("left-running", "watch learned.")]


async def test_run_that_has_ended_before_its_command_sends_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.run.ending.end("ended by SIGTERM", 15)
    await rig.run.carry_out()
    assert (rig.fleet.journal.sent, rig.stops, rig.events) == ((), [], [])


async def test_end_during_the_run_command_stops_the_motor(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)

    async def hangs() -> None:
        rig.run.ending.end("ended by SIGTERM", 15)
        await asyncio.Future()

    rig.run.command = hangs
    await rig.run.carry_out()
    assert rig.events[0] == ("stopping", "stopping (ended by SIGTERM)")
    assert rig.stops == [("stop", "a test")]


async def test_command_that_was_refused_is_followed_by_no_stop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)

    async def refused() -> None:
        raise LineError("refused")

    rig.run.command = refused
    with pytest.raises(LineError, match="refused"):
        await rig.run.carry_out()
    assert rig.stops == []


@pytest.mark.parametrize(
    ("why", "device", "turns"),
    [("reference 20 Hz", 1, False), ("run forward", 2, False), ("run forward", 1, True)],
)
def test_motor_may_turn_after_a_command_to_it_and_not_after_a_reference(
    why: str, device: int, turns: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch)
    rig.journal(why, device)
    assert rig.run.may_turn == turns
    later = MotorRun(
        rig.run.fleet, rig.run.console, Ending(), rig.run.observer, "b", rig._prepare, rig._command
    )
    assert not later.may_turn, "a command of before is not this run's"


@pytest.mark.parametrize("kind", ["fault", "stopped", "ready", "blocked"])
async def test_motor_at_rest_for_two_cycles_has_stopped_on_its_own(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch, state(kind), state(), state(kind), state(kind))
    with pytest.raises(MotorStopped) as caught:
        await rig.run.carry_out()
    assert len(rig.shown) == 4
    assert str(caught.value) == (
        f"Device 1 no longer runs: It is {kind}. It was stopped by the drive or by another source."
    )
    assert rig.events[0] == ("ended", str(caught.value))
    assert rig.reads == [("CMD",)]
    assert rig.stops == [("stop", "a test")], "nevertheless"


async def test_trip_names_its_fault_at_the_first_cycle_of_an_ended_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fault = SimpleNamespace(code="OCF", name="Overcurrent")
    rig = Rig(monkeypatch, state("fault", fault=fault))

    async def ends() -> None:
        await rig._command()
        rig.run.ending.end("after it")

    rig.run.command = ends
    with pytest.raises(MotorTripped) as caught:
        await rig.run.carry_out()
    assert str(caught.value) == (
        "Device 1 tripped: OCF, Overcurrent. Check the machine, remove the cause, then reset the"
        " fault."
    )
    assert len(rig.shown) == 1


@pytest.mark.parametrize(
    ("named", "text"),
    [("OCF", "Device 1 tripped: OCF, Overcurrent."), ("", "Device 1 tripped: It is fault.")],
)
@pytest.mark.parametrize("accepted", [True, False])
async def test_trip_while_it_is_stopped_is_an_error_and_no_usual_stop(
    named: str, text: str, accepted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds = 1.0
    if not accepted:
        rig.results, rig.hertz = [NOT_STOPPED], 0.0
    fault = SimpleNamespace(code=named, name="Overcurrent") if named else None

    def trips() -> None:
        # the stop reads the state before the monitor reads the name of the fault
        rig.kind_read = "fault"
        rig.states = [state("fault"), state("fault"), state("fault", fault=fault)]

    rig.after_stop = trips
    with pytest.raises(MotorTripped) as caught:
        await rig.run.carry_out()
    assert str(caught.value).startswith(text)
    assert rig.events == [("stopping", "stopping (after 1 s)"), ("ended", str(caught.value))]


async def test_trip_that_has_ended_the_run_is_reported_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fault = SimpleNamespace(code="OCF", name="Overcurrent")
    rig = Rig(monkeypatch, state("fault", fault=fault))
    rig.kind_read = "fault"
    with pytest.raises(MotorTripped):
        await rig.run.carry_out()
    assert [event for event, _ in rig.events] == ["ended", "stopping", "stopped"]


@pytest.mark.parametrize(
    ("others", "lost", "local", "why"),
    [
        (True, "CMD 15 is now 7", True, "It was stopped by a panel."),
        (False, "CMD 15 is now 7", True, "It was stopped by another program or master on the line:"
         " CMD 15 is now 7."),
        (False, "", True, "It was stopped at its terminals or keypad."),
    ],
)  # fmt: skip
async def test_source_of_a_stop_is_the_most_certain_one(
    others: bool, lost: str, local: bool, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch, state("ready", local=local))
    rig.lost_words = lost
    if others:
        rig.work.stops, rig.work.stopped_by = 4, "a panel"
    with pytest.raises(MotorStopped) as caught:
        await rig.run.carry_out()
    assert str(caught.value) == f"Device 1 no longer runs: It is ready. {why}"


@pytest.mark.parametrize(
    ("stops", "own", "by", "named"),
    [(4, False, "a panel", "a panel"), (4, False, "", "another source"), (4, True, "a panel", ""),
     (3, False, "a panel", "")],
)  # fmt: skip
async def test_stop_of_another_program_before_the_end_is_an_error(
    stops: int, own: bool, by: str, named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds, rig.run.is_stopped_here = 1.0, lambda: own
    rig.work.stops, rig.work.stopped_by = stops, by
    if not named:
        await rig.run.carry_out()
        return
    with pytest.raises(MotorStopped) as caught:
        await rig.run.carry_out()
    assert str(caught.value) == f"Device 1 was stopped by {named} before the end."
    assert rig.stops == [("stop", "a test")]


@pytest.mark.parametrize(
    ("kind", "hertz", "error", "rests"),
    [
        ("stopping", 0.0, "", True), ("stopping", 1.0, "", False), ("stopping", None, "", False),
        ("running", 0.0, "", False), ("unknown", 0.0, "", False), ("ready", 5.0, "", True),
        ("ready", 0.0, "no answer", False),
    ],
)  # fmt: skip
def test_motor_rests_by_its_state_or_at_0_hz_of_a_quick_stop(
    kind: str, hertz: float | None, error: str, rests: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch, state(kind))
    rig.hertz, rig.error = hertz, error
    assert rig.run._at_rest(rig.latest()) == rests
    assert rig.run._stands() == (rests and hertz == 0.0)
    rig.states = [state(kind, motion="running")]
    assert not rig.run._stands(), "enabled at 0 Hz"
    rig.console.session.profile.quantity = lambda _: None
    assert rig.run._frequency(rig.latest()) is None


async def test_second_stop_that_fails_on_a_good_line_is_an_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds = 0.1
    rig.results = [NOT_STOPPED]
    with pytest.raises(NotStopped, match=r"^Device 1: NOT STOPPED: why\.$"):
        await rig.run.carry_out()
    assert len(rig.stops) == 2


async def test_motor_that_ramps_down_for_long_is_stopped_again_and_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds = 0.1
    rig.results = [NOT_STOPPED] * 5 + [STOPPED]
    rig.after_stop = lambda: setattr(rig, "states", [state("stopping")])
    await rig.run.carry_out()
    assert len(rig.stops) == 6
    assert rig.events[-1] == ("stopped", "Device 1: stopped.")


async def test_drive_that_rejects_its_stop_at_standstill_is_at_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds = 0.1
    rig.results = [NOT_STOPPED]

    def stands() -> None:
        rig.states, rig.hertz = [state("ready")], 0.0

    rig.after_stop = stands
    await rig.run.carry_out()
    assert len(rig.stops) == 1
    assert rig.events[-1] == ("stopped", "Device 1 is at standstill.")


async def test_lost_line_is_reported_once_and_the_stop_sent_when_it_returns(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds = 0.1
    rig.results = [NOT_STOPPED, NOT_STOPPED, NOT_STOPPED, STOPPED]
    rig.after_stop = lambda: setattr(rig, "error", "no answer" if len(rig.stops) < 3 else "")

    def returns() -> None:
        if rig.error and rig.now - 1000.0 > 30.0 * len(rig.stops):
            rig.error = ""

    rig.after_sleep = returns
    await rig.run.carry_out()
    assert len(rig.stops) == 4, "stops on a bad line do not count"
    assert (
        rig.warned
        == [
            "NOT STOPPED yet: no answer\nwatch learned. The motor is stopped as soon as the drive"
            " answers. Until then, stop it at the machine."
        ]
        * 2
    )


async def test_silent_drive_is_reported_before_the_last_try_of_its_stop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.run.seconds, rig.error = 0.1, "no answer"
    unheeded = NOT_STOPPED._replace(phase=Phase.UNHEEDED)
    rig.results = [unheeded, unheeded, STOPPED]
    await rig.run.carry_out()
    assert [text.partition("\n")[0] for text in rig.warned] == ["NOT STOPPED yet: no answer"]
    assert rig.events[-1] == ("stopped", "Device 1: stopped.")


@pytest.mark.parametrize(("ahead", "bad"), [(-0.01, False), (0.0, False), (0.01, True)])
async def test_line_was_bad_if_its_error_is_newer_than_the_stop(
    ahead: float, bad: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch)
    rig.ahead, rig.error = ahead, "no answer"
    rig.after_sleep = lambda: setattr(rig, "error", "")
    assert await rig.run._line_was_bad(1000.0) is bad
    assert len(rig.warned) == bad
    assert rig.now == pytest.approx(1000.05)


async def test_drive_answers_if_its_cycle_is_newer_than_the_question(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.ahead = 0.0
    assert not await rig.run._line_was_bad(900.0)
    assert rig.now == pytest.approx(1000.05), "the cycle of before proves nothing"


async def test_command_that_was_refused_leaves_no_command_on_its_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    assert not rig.run.may_turn
    await rig.run._start()
    assert rig.run._commanding is False
    assert rig.run.may_turn, "it is in the journal"
    rig.fleet.journal.sent = ()

    async def refused() -> None:
        assert rig.run._commanding
        raise LineError("refused")

    rig.run.command = refused
    with pytest.raises(LineError):
        await rig.run._start()
    assert rig.run._commanding is False


# -- the preparation -------------------------------------------------------------------------------


class Waiting:
    """A loop whose time passes by sleeping only."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 0.0
        asyncio_ = SimpleNamespace(
            get_running_loop=lambda: SimpleNamespace(time=lambda: self.now), sleep=self._sleep
        )
        monkeypatch.setattr(watching, "asyncio", asyncio_)

    async def _sleep(self, seconds: float) -> None:
        assert seconds == 0.02
        self.now += seconds
        assert self.now < 1000.0, "it does not end"


@pytest.mark.parametrize(
    ("kind", "error", "cycle", "waits"),
    [
        ("running", "", 1, 0.0), ("unknown", "", 3, 0.0), ("unknown", "", 2, None),
        ("running", "no answer", 1, None), ("unknown", "no answer", 3, 5.0),
    ],
)  # fmt: skip
async def test_first_cycle_is_one_with_a_state_or_the_third(
    kind: str, error: str, cycle: int, waits: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = Waiting(monkeypatch)
    latest = SimpleNamespace(state=SimpleNamespace(kind=kind), error=error, cycle=cycle)
    console = cast(Any, SimpleNamespace(latest=latest))
    if waits is None:
        with pytest.raises(AssertionError, match="does not end"):
            await watching.first_cycle(console)
    elif error:
        with pytest.raises(LineError, match="no answer"):
            await watching.first_cycle(console)
        assert time.now == pytest.approx(waits, abs=0.05)
    else:
        await watching.first_cycle(console)
        assert time.now == waits


@pytest.mark.parametrize(
    ("rules", "learned"),
    [
        (None, False),
        (SimpleNamespace(timeout=""), False),
        (SimpleNamespace(timeout="TTO"), True),
    ],
)
async def test_timeout_is_learned_before_the_run_if_the_drive_has_one(
    rules: object, learned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = Waiting(monkeypatch)
    within: list[float] = []

    def patience(_: object, seconds: float) -> float:
        within.append(seconds)
        return seconds

    monkeypatch.setattr(watching, "patience", patience)
    profile = SimpleNamespace(data=SimpleNamespace(communication_fault=rules))
    session = SimpleNamespace(line=None, profile=profile)
    line_watch = SimpleNamespace(
        unread=lambda: [session] if time.now < 1.0 else [],
        watch=lambda device: f"watch of {device}",
    )
    fleet = cast(Any, SimpleNamespace(line_watch=line_watch))
    console = cast(Any, SimpleNamespace(session=session, device=7))
    found = cast(Any, await watching.learned_timeout(fleet, console))
    assert found == ("watch of 7" if learned else None)
    assert within == ([10.0] if learned else [])
    if learned:
        assert time.now == pytest.approx(1.0, abs=0.03)
        line_watch.unread = lambda: [session]
        with pytest.raises(watching.NotLearned) as caught:
            await watching.learned_timeout(fleet, console)
        assert time.now == pytest.approx(11.0, abs=0.06)
        assert str(caught.value) == (
            "The communication timeout TTO of device 7 could not be read in time."
        )
