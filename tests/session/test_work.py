"""Work on one drive: one task after another, ended by a stop, none carried out late."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from functools import partial
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import LineStatus, LineWorker
from tui.bus.errors import Superseded
from tui.bus.fake import FakeLine
from tui.drive.orders import OrderRefused
from tui.session.arming import Arming, CommandedElsewhere, NotArmed
from tui.session.work import (
    BY_STOP,
    DROPPED_BY_STOP,
    MOST_WAITING,
    STOPPED_DISARMS,
    Outcome,
    OutcomeKind,
    Permit,
    Stopped,
    Task,
    WorkQueue,
)


class LateCancelLine(FakeLine):
    """A line that does the work in the test's own loop, and may cancel it late."""

    cancels_late = False

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        worker = super().spawn(work, name)
        return _Late(worker) if self.cancels_late else worker


class _Late:
    """A worker that notices its cancellation a few turns of the loop later."""

    def __init__(self, task: LineWorker) -> None:
        self._task = task

    def done(self) -> bool:
        return self._task.done()

    def cancel(self) -> None:
        async def later() -> None:
            for _ in range(5):
                await asyncio.sleep(0)
            self._task.cancel()

        self._canceller = asyncio.get_running_loop().create_task(later())


class Notified:
    """A queue of an armed drive, and tasks that report their results."""

    def __init__(self) -> None:
        self.line = LateCancelLine()
        self.arming = Arming(self.line)
        self.arming.arm()
        self.queue = WorkQueue(self.line, 1, self.arming)
        self.output: list[str] = []
        self.before: dict[str, Outcome | None] = {}
        """Results so far when a task began."""

    def put(
        self,
        name: str,
        seconds: float = 0.0,
        *,
        stamp: int | None = None,
        error: Exception | None = None,
        left: str | None = None,
        **more: Any,
    ) -> None:
        async def carry_out(_: Permit) -> str:
            self.output.append(f"{name} begun")
            self.before[name] = self.queue.outcome
            if error is not None:
                raise error
            try:
                await asyncio.sleep(seconds)
            except asyncio.CancelledError:
                self.output.append(f"{name} cancelled")
                raise
            self.output.append(f"{name} done")
            return f"{name} is done"

        def given_up() -> str | None:
            self.output.append(f"{name} given up")
            return left

        self.queue.put(Task(carry_out, given_up=given_up, **more), stamp)

    async def idle(self) -> list[str]:
        """Messages, once the queue is idle."""
        for _ in range(1000):
            await asyncio.sleep(0.01)
            if not self.queue.busy:
                return self.output
        raise AssertionError("the work does not end")

    def outcome(self) -> tuple[OutcomeKind, str]:
        assert self.queue.outcome is not None
        return self.queue.outcome.kind, self.queue.outcome.text


@pytest.fixture
async def reported() -> AsyncIterator[Notified]:
    made = Notified()
    yield made
    made.queue.stop()
    await asyncio.sleep(0)


async def test_tasks_run_one_after_another(reported: Notified) -> None:
    reported.put("a", 0.02)
    reported.put("b")
    assert reported.queue.busy
    assert await reported.idle() == ["a begun", "a done", "b begun", "b done"]
    assert reported.outcome() == (OutcomeKind.DONE, "b is done")


async def test_work_is_known_by_its_owner(reported: Notified) -> None:
    item, other = object(), object()
    reported.put("a", owner=item)
    reported.put("b", owner=other)
    assert reported.queue.busy_for(item)
    assert reported.queue.busy_for(other)
    assert not reported.queue.busy_for(object())
    await reported.idle()
    assert not reported.queue.busy_for(item)
    assert not reported.queue.busy_for(other)


async def test_current_work_is_reported(reported: Notified) -> None:
    reported.put("a", 0.02, working="Writing")
    assert reported.outcome() == (OutcomeKind.WORKING, "Writing")
    await reported.idle()
    assert reported.outcome() == (OutcomeKind.DONE, "a is done")


async def test_too_many_are_refused(reported: Notified) -> None:
    reported.put("a", 1.0)
    await asyncio.sleep(0)
    for number in range(MOST_WAITING):
        reported.put(str(number))
    with pytest.raises(OrderRefused, match="Earlier commands"):
        reported.put("one more")


async def test_tasks_on_a_lost_line_are_refused(reported: Notified) -> None:
    reported.line.become(LineStatus.LOST)
    with pytest.raises(OrderRefused, match="line was lost"):
        reported.put("a")
    with pytest.raises(OrderRefused, match="The line is lost"):
        reported.put("b", armed=False)
    assert reported.output == []


# A stop


async def test_stop_ends_the_current_task_and_the_queue(reported: Notified) -> None:
    reported.put("a", 5.0)
    reported.put("b")
    await asyncio.sleep(0.01)
    reported.queue.stop("F12")
    assert sorted(await reported.idle()) == ["a begun", "a cancelled", "a given up", "b given up"]
    assert reported.queue.outcome is not None
    assert reported.queue.outcome.kind is OutcomeKind.REFUSED
    assert reported.queue.outcome.text == BY_STOP
    assert isinstance(reported.queue.outcome.error, Stopped)
    assert (reported.queue.stops, reported.queue.stopped_by) == (1, "F12")


async def test_stop_reports_tasks_that_had_not_begun_and_nothing_else(reported: Notified) -> None:
    reported.queue.stop("F12")
    assert reported.queue.outcome is None, "nothing was dropped"
    reported.arming.arm()
    reported.put("a")
    texts: list[str] = []
    reported.queue.on_report = lambda outcome: texts.append(outcome.text)
    reported.queue.stop("F9")  # before the loop could begin
    assert set(texts) == {DROPPED_BY_STOP}
    assert reported.outcome() == (OutcomeKind.REFUSED, DROPPED_BY_STOP)
    assert reported.queue.outcome is not None
    assert isinstance(reported.queue.outcome.error, Stopped)
    assert "F9" in str(reported.queue.outcome.error)
    assert not reported.queue.drop("a test")
    reported.arming.arm()
    reported.put("b")
    assert reported.queue.drop("a test")
    assert reported.outcome() == (OutcomeKind.REFUSED, "Not done: a test.")
    assert await reported.idle() == ["a given up", "b given up"]


async def test_stop_disarms_with_a_message(reported: Notified) -> None:
    reported.queue.stop()
    assert not reported.arming.armed
    with pytest.raises(NotArmed, match="Stopped: no longer armed"):
        reported.put("a")
    reported.arming.arm()
    reported.put("b")
    assert await reported.idle() == ["b begun", "b done"]


async def test_task_after_a_stop_runs_without_earlier_tasks(
    reported: Notified,
) -> None:
    reported.put("a")
    # the stop arrives before the loop could begin
    reported.queue.stop()
    reported.arming.arm()
    reported.put("b")
    assert await reported.idle() == ["a given up", "b begun", "b done"]


@pytest.mark.parametrize("sees_it", [False, True])
async def test_late_stop_notice_does_not_end_later_tasks(reported: Notified, sees_it: bool) -> None:
    reported.line.cancels_late = True
    going = asyncio.Event()

    async def carry_out(permit: Permit) -> str:
        await going.wait()
        if sees_it:
            permit.check()
        return ""

    reported.queue.put(Task(carry_out))
    await asyncio.sleep(0)
    going.set()
    reported.queue.stop()
    reported.arming.arm()
    reported.put("b", 0.05)
    assert await reported.idle() == ["b begun", "b done"]
    assert reported.outcome() == (OutcomeKind.DONE, "b is done")


# The count of stops under which a task was typed


async def test_task_typed_before_a_stop_is_refused_at_entry(reported: Notified) -> None:
    stamp = reported.queue.stops
    reported.queue.stop("F12")
    reported.arming.arm()
    with pytest.raises(Stopped, match=r"a stop came after it \(F12\)"):
        reported.put("typed before", stamp=stamp)
    # a task that needs no arming is refused as well
    with pytest.raises(Stopped):
        reported.put("typed before", stamp=stamp, armed=False)
    reported.put("typed behind", stamp=reported.queue.stops)
    assert await reported.idle() == ["typed behind begun", "typed behind done"]


@pytest.mark.parametrize("armed", [True, False])
async def test_task_is_refused_at_its_turn_after_a_stop(
    reported: Notified, monkeypatch: pytest.MonkeyPatch, armed: bool
) -> None:
    taken = reported.queue._next

    def overtaken(*turn: Any) -> object:
        found = taken(*turn)
        # in the key's thread, between the taking of a task and its beginning
        if found is not None:
            reported.queue.stop("F12")
            reported.arming.arm()
        return found

    monkeypatch.setattr(reported.queue, "_next", overtaken)
    reported.put("a", armed=armed)
    assert await reported.idle() == ["a given up"]
    assert reported.outcome() == (OutcomeKind.REFUSED, "Not sent: a stop came after it (F12).")


async def test_task_is_refused_at_its_turn_if_disarmed(
    reported: Notified,
) -> None:
    reported.put("a", 0.02)
    reported.put("b")
    await asyncio.sleep(0)
    reported.arming.disarm("Disarmed: no key pressed for 60 s.")
    assert await reported.idle() == ["a begun", "a done", "b given up"]
    assert reported.outcome() == (OutcomeKind.REFUSED, "Disarmed: no key pressed for 60 s.")


async def test_task_that_needs_no_arming_runs_disarmed(reported: Notified) -> None:
    reported.arming.disarm()
    with pytest.raises(NotArmed):
        reported.put("a")
    reported.put("b", armed=False)
    assert await reported.idle() == ["b begun", "b done"]


async def test_permit_ends_with_a_stop_and_stays_ended(reported: Notified) -> None:
    permit = reported.queue.permit()
    permit.check()
    assert permit.refusal() == ""
    reported.queue.stop("F12")
    for _ in range(2):
        assert permit.refusal() == "Not sent: a stop came after it (F12)."
        with pytest.raises(Stopped):
            permit.check()
        # arming again lets nothing typed before pass
        reported.arming.arm()
    with pytest.raises(Stopped):
        reported.queue.permit(permit.stamp)
    assert reported.queue.permit().refusal() == ""


async def test_permit_pauses_while_disarmed(reported: Notified) -> None:
    permit = reported.queue.permit()
    reported.arming.disarm("The line was lost: no longer armed.")
    assert permit.refusal() == "The line was lost: no longer armed."
    with pytest.raises(NotArmed, match="The line was lost"):
        permit.check()
    with pytest.raises(NotArmed):
        reported.queue.permit()


@pytest.mark.parametrize("end", ["stop", "disarm"])
async def test_task_checks_its_permit_before_each_frame(reported: Notified, end: str) -> None:
    # it detects the end itself, before the worker is cancelled
    reported.line.cancels_late = True
    frames: list[int] = []

    async def carry_out(permit: Permit) -> str:
        for number in range(8):
            permit.check()
            frames.append(number)
            if number == 1:
                getattr(reported.queue if end == "stop" else reported.arming, end)()
                if end == "stop":
                    reported.arming.arm()
            await asyncio.sleep(0)
        return "all went out"

    reported.queue.put(Task(carry_out))
    await reported.idle()
    assert frames == [0, 1]
    assert reported.outcome()[0] is OutcomeKind.REFUSED


# Tasks that fail


async def test_tasks_after_a_failed_task_are_dropped(reported: Notified) -> None:
    refused = OrderRefused("The drive is in fault.")
    reported.put("a", error=refused)
    reported.put("b")
    reported.put("c")
    assert await reported.idle() == ["a begun", "b given up", "c given up", "a given up"]
    text = "The drive is in fault. The commands after it were canceled."
    assert reported.outcome() == (OutcomeKind.REFUSED, text)
    assert reported.queue.outcome is not None
    assert reported.queue.outcome.error is refused
    reported.put("d")
    await reported.idle()
    assert reported.outcome() == (OutcomeKind.DONE, "d is done")


async def test_failed_last_task_drops_nothing(reported: Notified) -> None:
    reported.put("a", error=OrderRefused("The drive is in fault."))
    assert await reported.idle() == ["a begun", "a given up"]
    assert reported.outcome() == (OutcomeKind.REFUSED, "The drive is in fault.")


@pytest.mark.internal_errors
async def test_unforeseen_error_clears_the_queue(reported: Notified) -> None:
    reported.put("a", error=ZeroDivisionError("none"))
    reported.put("b")
    assert await reported.idle() == ["a begun", "b given up", "a given up"]
    kind, text = reported.outcome()
    assert kind is OutcomeKind.REFUSED
    assert "ZeroDivisionError: none" in text
    reported.put("c")
    assert (await reported.idle())[3:] == ["c begun", "c done"]


@pytest.mark.internal_errors
async def test_error_in_passing_on_a_result_changes_no_result(
    reported: Notified, caplog: pytest.LogCaptureFixture
) -> None:
    def fails(_outcome: object) -> None:
        raise ValueError("on purpose")

    reported.queue.on_report = fails
    reported.put("a")
    reported.put("b")
    assert await reported.idle() == ["a begun", "a done", "b begun", "b done"]
    assert reported.outcome() == (OutcomeKind.DONE, "b is done")
    assert "was not passed on" in caplog.text


async def test_cancelled_task_reports_what_was_done(reported: Notified) -> None:
    reported.put("a", error=OrderRefused("No."), left="2 written, 6 still staged.")
    await reported.idle()
    assert reported.outcome() == (OutcomeKind.REFUSED, "No. 2 written, 6 still staged.")
    reported.put("b", 5.0, left="3 written, 5 still staged.")
    await asyncio.sleep(0.01)
    reported.queue.stop()
    await reported.idle()
    assert reported.outcome() == (
        OutcomeKind.REFUSED,
        "Ended by a stop. 3 written, 5 still staged.",
    )


async def test_superseded_task_is_not_reported(reported: Notified) -> None:
    reported.put("a")
    reported.put("b", error=Superseded(1, 8502))
    reported.put("c")
    # nothing behind it was dropped
    assert await reported.idle() == ["a begun", "a done", "b begun", "c begun", "c done"]
    assert reported.before["c"] == reported.before["b"]
    assert reported.before["b"] is not None
    assert reported.before["b"].text == "a is done"


async def test_drive_is_read_again_after_every_task(reported: Notified) -> None:
    seen: list[str] = []
    reported.queue.on_change = lambda: seen.append(reported.output[-1])
    reported.put("a")
    reported.put("b", error=Superseded(1, 8502))
    reported.put("c", error=OrderRefused("No."))
    await reported.idle()
    assert seen == ["a done", "b begun", "c given up"]


async def test_stop_while_a_drive_is_armed_leaves_it_disarmed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    notified = Notified()
    notified.arming.disarm("")
    arm = notified.arming.arm
    stop = threading.Thread(target=notified.queue.stop, args=("the stop key",), daemon=True)

    def met(*, seconds: float) -> None:
        stop.start()
        stop.join(0.2)  # it waits for the end of the arming
        arm(seconds=seconds)

    monkeypatch.setattr(notified.arming, "arm", met)
    notified.queue.arm(notified.queue.stops, 60.0)
    stop.join(20.0)
    assert not notified.arming.armed


async def test_second_report_of_a_stop_keeps_why_the_drive_was_disarmed() -> None:
    work = Notified()
    work.queue.stop("the stop key")
    work.queue.stop("a panel")
    assert (work.queue.stops, work.queue.stopped_by) == (2, "a panel")
    assert work.arming.why_disarmed == STOPPED_DISARMS
    never = Notified()
    never.arming.disarm("Disarmed.")
    never.queue.stop("a panel")
    assert never.arming.why_disarmed == "", "no stop has disarmed it"


# -- arming, in time that the test sets ------------------------------------------------------------


class Armed:
    """Arming of device 1, with what the line hears of it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, device: int | None = 1) -> None:
        self.now = 1000.0
        self.line = FakeLine()
        self.heard: list[tuple[object, ...]] = []
        self.claimed = ""
        facts = self.line.facts
        monkeypatch.setattr(facts, "claim", self._claim)
        monkeypatch.setattr(facts, "release", partial(self._hear, "release"))
        for name in ("arm", "stay_armed", "disarm"):
            monkeypatch.setattr(facts.leases, name, partial(self._hear, name))
        clock = cast(Any, SimpleNamespace(monotonic=lambda: self.now))
        self.arming = Arming(self.line, clock, device, lambda: b"care")

    def _hear(self, *what: object) -> None:
        self.heard.append(what)

    def _claim(self, device: int) -> str:
        self._hear("claim", device)
        return self.claimed


@pytest.mark.parametrize(("seconds", "lease"), [(60.0, 60.0), (5.0, 5.0), (math.inf, None)])
def test_arming_lasts_for_its_time_and_each_key_restarts_it(
    seconds: float, lease: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Armed(monkeypatch)
    arming = here.arming
    assert (arming.armed, arming.refusal()) == (False, "Not armed. Press a to arm this drive.")
    arming.touch()
    assert not arming.armed
    assert here.heard == []
    arming.arm(seconds=seconds)
    assert here.heard == [("claim", 1), ("arm", 1, lease, b"care")]
    assert (arming.armed_for, arming.times, arming.refusal()) == (seconds, 1, "")
    here.now += 4.0
    assert arming.armed_for == seconds - 4.0
    arming.touch()
    assert here.heard[2:] == [("stay_armed", 1, lease)]
    assert arming.armed_for == seconds
    here.now += 59.9
    if seconds == 60.0:
        assert arming.armed
        here.now += 0.1
    if lease is None:
        assert arming.armed_for == math.inf
        return
    assert arming.armed_for is None
    assert here.heard[3:] == [("release", 1), ("disarm", 1)]
    assert arming.refusal() == arming.why_disarmed == "Disarmed: no key pressed for 60 s."
    arming.arm()
    assert (arming.times, arming.why_disarmed, arming.armed_for) == (2, "", 60.0)


def test_line_or_drive_that_cannot_be_armed_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Armed(monkeypatch)
    arming, line = here.arming, here.line
    assert arming.hindrance == ""
    arming.trouble = lambda: "trouble"
    assert arming.hindrance == "trouble"
    line.held = "held"
    assert arming.hindrance == "held"
    line.read_only = True
    assert arming.hindrance == "The line is read-only: nothing is written."
    arming.barred = "barred"
    assert arming.hindrance == "barred"
    arming.barred = ""
    with pytest.raises(OrderRefused, match="read-only"):
        arming.arm()
    assert (here.heard, arming.armed, arming.times) == ([], False, 0)


def test_drive_that_another_program_commands_is_not_armed(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Armed(monkeypatch)
    here.claimed = "A panel commands it."
    with pytest.raises(CommandedElsewhere, match="A panel commands it"):
        here.arming.arm()
    assert (here.heard, here.arming.armed, here.arming.times) == ([("claim", 1)], False, 0)


@pytest.mark.parametrize(
    ("cause", "why"),
    [
        (lambda here: here.line.become(LineStatus.LOST), "The line was lost: no longer armed."),
        (lambda here: setattr(here.line, "held", "held"), "held"),
        (lambda here: setattr(here.arming, "trouble", lambda: "trouble"), "trouble"),
        (lambda here: here.arming.disarm("a stop"), "a stop"),
    ],
)
def test_arming_ends_with_its_reason(
    cause: Callable[[Armed], object], why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Armed(monkeypatch)
    here.arming.arm()
    cause(here)
    assert not here.arming.armed
    assert here.arming.refusal() == here.arming.why_disarmed == why
    assert here.heard[2:] == [("release", 1), ("disarm", 1)]


def test_arming_of_no_device_concerns_no_other_program(monkeypatch: pytest.MonkeyPatch) -> None:
    here = Armed(monkeypatch, None)
    here.arming.arm()
    here.arming.touch()
    assert here.arming.armed
    here.arming.disarm()
    assert here.heard == []
    assert here.arming.refusal() == "Not armed. Press a to arm this drive."
