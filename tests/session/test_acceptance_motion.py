"""Motions of an acceptance test: whatever ends one, its guarded run is awaited to standstill."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.errors import NoAnswer
from tui.bus.line_events import ControlRequested, DevicesStopped, ProgramsChanged
from tui.drive.profile import library
from tui.session.acceptance import motion
from tui.session.acceptance.motion import AcceptanceEnded, Motion, MotionBench, StepFailed
from tui.session.running.ending import Ending, MotorStopped, MotorTripped, NotStopped

FORWARD = Motion("forward", 20.0, 5.0)


class GuardedRunFake:
    """Stands for MotorRun: it ends by its ending or by an error, and then brings to rest."""

    def __init__(self, rig: Rig, ending: Ending, command: Callable[[], Any]) -> None:
        self.rig, self.ending, self.command = rig, ending, command

    async def carry_out(self) -> None:
        """Run until the end, then take a while to standstill."""
        rig = self.rig
        try:
            await self.command()
            if rig.error_after is not None:
                await asyncio.sleep(rig.error_after)
                raise rig.error
            await self.ending.event.wait()
        finally:
            await asyncio.sleep(0.02)
            rig.at_rest = True
        if rig.error_at_rest is not None:
            raise rig.error_at_rest


class Rig:
    """A bench on a fake drive."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.at_rest = False
        self.error: Exception = MotorTripped("tripped")
        self.error_after: float | None = None
        self.error_at_rest: Exception | None = None
        self.ending: Ending | None = None
        self.arming: list[str] = []
        self.progress: list[str] = []
        self.latest = SimpleNamespace(
            time=1e9, error="", readings={}, state=SimpleNamespace(kind="ready", local=False)
        )
        self.lost, self.commander_of = "", SimpleNamespace(text="another panel")
        self.other: Any = None
        work = SimpleNamespace(stops=3, arm=self._arm, permit=lambda stamp: stamp)
        session = SimpleNamespace(
            profile=library.load("atv312"),
            work=work,
            clock=SimpleNamespace(monotonic=lambda: 10.0),
            arming=SimpleNamespace(disarm=lambda: self.arming.append("disarm")),
            image=SimpleNamespace(raws={}),
            line=SimpleNamespace(facts=SimpleNamespace(commander=lambda _: self.other)),
        )
        given = SimpleNamespace(lost_orders=lambda: self.lost, wanted=None)
        self.console = SimpleNamespace(
            device=4, session=session, commander=SimpleNamespace(given=given),
            monitor=SimpleNamespace(listen=lambda _: lambda: None),
        )  # fmt: skip

        def made(*given: Any, command: Callable[[], Any], seconds: float, **more: Any) -> Any:
            assert seconds == FORWARD.at_most
            self.ending = given[2]
            return GuardedRunFake(self, given[2], command)

        async def commanded(*_: object) -> None:
            return None

        monkeypatch.setattr(motion, "MotorRun", made)
        monkeypatch.setattr(motion, "outcome_or_error", commanded)
        monkeypatch.setattr(motion, "latest_of", lambda _: self.latest)
        self.bench = MotionBench(
            cast(Any, None), cast(Any, self.console), Ending(), self.progress.append, lambda _: None
        )

    def _arm(self, stamp: int, seconds: float) -> None:
        assert (stamp, seconds) == (3, float("inf"))
        self.arming.append("arm")

    async def run(self, steps: Callable[[], Any]) -> None:
        """Run the motor; it must be at rest afterwards, whatever the end."""
        try:
            await self.bench.run(FORWARD, steps)
        finally:
            assert self.at_rest
            assert self.arming[-1] == "disarm"


async def nothing() -> None:
    """Steps that end at once."""


async def endless() -> None:
    """Steps that are not over when the motion ends."""
    await asyncio.sleep(5)


async def test_motion_ends_with_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    await rig.run(nothing)
    assert rig.ending is not None
    assert rig.ending.why == "the step has ended"


@pytest.mark.parametrize("error", [StepFailed("too slow"), ValueError("a defect of this program")])
async def test_error_of_a_step_is_raised_at_standstill(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch)

    async def fail() -> None:
        raise error

    with pytest.raises(type(error), match=str(error)):
        await rig.run(fail)


async def test_end_of_the_test_stops_the_motor_and_is_raised(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    asyncio.get_running_loop().call_later(0.02, rig.bench.whole.end, "ended by SIGINT")
    with pytest.raises(AcceptanceEnded, match="SIGINT"):
        await rig.run(endless)
    assert rig.ending is not None
    assert rig.ending.why == "ended by SIGINT"
    with pytest.raises(AcceptanceEnded):
        await rig.bench.run(FORWARD, nothing)
    assert rig.arming.count("arm") == 0, "the fake run arms nothing, and no second run began"


async def test_trip_ends_the_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.error_after = 0.02
    with pytest.raises(MotorTripped):
        await rig.run(endless)


async def test_run_that_ends_on_time_fails_its_step(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)

    async def end() -> None:
        await asyncio.sleep(0.02)
        assert rig.ending is not None
        rig.ending.end("after 5 s")
        await asyncio.sleep(60)

    with pytest.raises(StepFailed, match="ended after 5 s"):
        await rig.run(end)


async def test_motor_that_does_not_stop_is_reported_first(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.error_at_rest = NotStopped("NOT STOPPED")

    async def fail() -> None:
        rig.bench.whole.end("ended by SIGINT")
        raise StepFailed("too slow")

    with pytest.raises(NotStopped):
        await rig.run(fail)


async def test_cancelled_test_waits_for_standstill(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    task = asyncio.create_task(rig.run(endless))
    await asyncio.sleep(0.02)
    task.cancel()
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert rig.at_rest


async def test_stop_by_the_test_itself_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.error_after, rig.error = 0.02, MotorStopped("no longer runs")

    async def stop() -> None:
        rig.bench._own_stop = True
        await asyncio.sleep(0.05)

    await rig.run(stop)
    rig = Rig(monkeypatch)
    rig.error_after = 0.02  # it trips during that stop
    with pytest.raises(MotorTripped):
        await rig.run(stop)


# Ends by others


@pytest.mark.parametrize(
    "event",
    [
        DevicesStopped((4, 5), "drivepanel stop", cast(Any, SimpleNamespace(text="pid 7"))),
        ControlRequested(4, cast(Any, SimpleNamespace(text="pid 7"))),
    ],
)
def test_event_of_another_program_ends_the_test(
    event: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Rig(monkeypatch).bench
    ends: list[str] = []
    bench.hear(event, ends.append)
    (why,) = ends
    assert "pid 7" in why
    # at once, before the loop of the test takes its turn
    with pytest.raises(AcceptanceEnded, match="pid 7"):
        bench.permit()


@pytest.mark.parametrize(
    "event",
    [
        DevicesStopped((5,), "drivepanel stop", cast(Any, SimpleNamespace(text="pid 7"))),
        ControlRequested(5, cast(Any, SimpleNamespace(text="pid 7"))),
        ProgramsChanged(),
    ],
)
def test_event_about_another_drive_ends_nothing(
    event: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(monkeypatch)
    rig.bench.hear(event, lambda why: pytest.fail(why))
    assert cast(Any, rig.bench.permit()) == 3
    assert rig.arming == ["arm"]


def shown(rig: Rig, **changes: Any) -> str:
    """Why the test has ended after a cycle."""
    for name, value in changes.items():
        setattr(rig.latest, name, value)
    rig.bench.show(cast(Any, rig.latest), lambda: "")
    return rig.bench.whole.why


def test_line_is_lost_after_two_failed_cycles(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    assert shown(rig, error="no answer") == ""
    assert shown(rig, error="") == ""
    assert shown(rig, error="no answer") == ""
    text = NoAnswer(1, 3, 3201, "no answer", retry_in=0.9)
    assert shown(rig, error=str(text)) == "the line was lost: no answer"  # a result does not retry


def test_standstill_is_reported_if_the_test_ends_early(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.bench.report("stopped", "Device 4: stopped.")
    assert rig.progress == []
    rig.bench.whole.end("the line was lost")  # after NOT STOPPED yet, for example
    rig.bench.report("stopped", "Device 4: stopped.")
    assert rig.progress == ["Device 4: stopped."]


def test_begin_of_a_stop_is_marked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.bench.report("order", "Device 4: forward.")
    assert (rig.bench.stopped_at, rig.bench.curve.marks) == (0.0, [])
    rig.bench.report("stopping", "Device 4: stopping.")
    rig.console.session.clock = SimpleNamespace(monotonic=lambda: 11.0)
    rig.bench.report("stopping", "Device 4: stopping.")
    assert (rig.bench.stopped_at, rig.bench.curve.marks) == (10.0, [(10.0, "stop")])
    assert rig.progress == []


def test_failed_cycles_while_polling_is_paused_end_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    rig.bench.pause_watch()
    assert [shown(rig, error="paused") for _ in range(5)] == [""] * 5
    rig.bench.resume_watch()
    assert shown(rig, error="no answer") == ""
    assert shown(rig, error="no answer")


def test_local_control_ends_the_test(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    assert "terminals or keypad" in shown(rig, state=SimpleNamespace(kind="running", local=True))


def test_other_commander_ends_the_test(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch)
    rig.other = SimpleNamespace(text="a panel (pid 9)")
    assert shown(rig) == "a panel (pid 9) commands device 4"
    rig = Rig(monkeypatch)
    rig.lost = "CMD 16#000F is now 16#0006."
    assert shown(rig) == "device 4: CMD 16#000F is now 16#0006."


def test_other_reference_ends_the_test_after_several_cycles(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch)
    parameter = SimpleNamespace(code="LFr")
    rig.console.commander.given.wanted = SimpleNamespace(parameter=parameter, raw=200)
    rig.console.session.image.raws["LFr"] = 200
    assert [shown(rig) for _ in range(9)] == [""] * 9
    rig.console.session.image.raws["LFr"] = 150
    assert [bool(shown(rig)) for _ in range(5)] == [False] * 4 + [True]
