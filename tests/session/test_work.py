"""Work on one drive: one task after another, ended by a stop, none carried out late."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any

import pytest

from tui.bus.api import LineStatus, LineWorker
from tui.bus.errors import Superseded
from tui.bus.fake import FakeLine
from tui.drive.orders import OrderRefused
from tui.session.arming import Arming, NotArmed
from tui.session.work import (
    BY_STOP,
    MOST_WAITING,
    Outcome,
    OutcomeKind,
    Permit,
    Stopped,
    Task,
    WorkQueue,
)


class Loop(FakeLine):
    """A line that does the work in the test's own loop, and may cancel it late."""

    cancels_late = False

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        worker = super().spawn(work, name)
        return _Late(worker) if self.cancels_late else worker


class _Late:
    """A worker that hears of being cancelled a few turns of the loop later."""

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


class Told:
    """A queue of an armed drive, and tasks that tell what became of them."""

    def __init__(self) -> None:
        self.line = Loop()
        self.arming = Arming(self.line)
        self.arming.arm()
        self.queue = WorkQueue(self.line, 1, self.arming)
        self.said: list[str] = []
        self.before: dict[str, Outcome | None] = {}
        """What the work had come to when a task began."""

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
            self.said.append(f"{name} begun")
            self.before[name] = self.queue.outcome
            if error is not None:
                raise error
            try:
                await asyncio.sleep(seconds)
            except asyncio.CancelledError:
                self.said.append(f"{name} cancelled")
                raise
            self.said.append(f"{name} done")
            return f"{name} is done"

        def given_up() -> str | None:
            self.said.append(f"{name} given up")
            return left

        self.queue.put(Task(carry_out, given_up=given_up, **more), stamp)

    async def idle(self) -> list[str]:
        """What was said, once nothing is being done any more."""
        for _ in range(1000):
            await asyncio.sleep(0.01)
            if not self.queue.busy:
                return self.said
        raise AssertionError("the work does not end")

    def outcome(self) -> tuple[OutcomeKind, str]:
        assert self.queue.outcome is not None
        return self.queue.outcome.kind, self.queue.outcome.text


@pytest.fixture
async def told() -> AsyncIterator[Told]:
    made = Told()
    yield made
    made.queue.stop()
    await asyncio.sleep(0)


async def test_one_after_another(told: Told) -> None:
    told.put("a", 0.02)
    told.put("b")
    assert told.queue.busy
    assert await told.idle() == ["a begun", "a done", "b begun", "b done"]
    assert told.outcome() == (OutcomeKind.DONE, "b is done")


async def test_whose_work_it_is(told: Told) -> None:
    one, other = object(), object()
    told.put("a", owner=one)
    told.put("b", owner=other)
    assert told.queue.busy_for(one)
    assert told.queue.busy_for(other)
    assert not told.queue.busy_for(object())
    await told.idle()
    assert not told.queue.busy_for(one)
    assert not told.queue.busy_for(other)


async def test_what_is_being_done_is_told(told: Told) -> None:
    told.put("a", 0.02, working="Writing")
    assert told.outcome() == (OutcomeKind.WORKING, "Writing")
    await told.idle()
    assert told.outcome() == (OutcomeKind.DONE, "a is done")


async def test_too_many_are_refused(told: Told) -> None:
    told.put("a", 1.0)
    await asyncio.sleep(0)
    for number in range(MOST_WAITING):
        told.put(str(number))
    with pytest.raises(OrderRefused, match="Earlier commands"):
        told.put("one more")


async def test_nothing_is_taken_for_a_lost_line(told: Told) -> None:
    told.line.become(LineStatus.LOST)
    with pytest.raises(OrderRefused, match="line was lost"):
        told.put("a")
    with pytest.raises(OrderRefused, match="The line is lost"):
        told.put("b", armed=False)
    assert told.said == []


# A stop


async def test_a_stop_ends_the_one_under_way_and_those_behind_it(told: Told) -> None:
    told.put("a", 5.0)
    told.put("b")
    await asyncio.sleep(0.01)
    told.queue.stop("F12")
    assert sorted(await told.idle()) == ["a begun", "a cancelled", "a given up", "b given up"]
    assert told.queue.outcome is not None
    assert told.queue.outcome.kind is OutcomeKind.REFUSED
    assert BY_STOP in told.queue.outcome.text.lower()
    assert isinstance(told.queue.outcome.error, Stopped)
    assert (told.queue.stops, told.queue.stopped_by) == (1, "F12")


async def test_a_stop_disarms_and_says_so(told: Told) -> None:
    told.queue.stop()
    assert not told.arming.armed
    with pytest.raises(NotArmed, match="Stopped: no longer armed"):
        told.put("a")
    told.arming.arm()
    told.put("b")
    assert await told.idle() == ["b begun", "b done"]


async def test_a_task_behind_a_stop_neither_waits_for_ever_nor_brings_old_ones_along(
    told: Told,
) -> None:
    told.put("a")
    # the stop comes before the loop had time to begin
    told.queue.stop()
    told.arming.arm()
    told.put("b")
    assert await told.idle() == ["a given up", "b begun", "b done"]


@pytest.mark.parametrize("sees_it", [False, True])
async def test_a_worker_that_hears_late_of_a_stop_touches_no_task_behind_it(
    told: Told, sees_it: bool
) -> None:
    told.line.cancels_late = True
    going = asyncio.Event()

    async def carry_out(permit: Permit) -> str:
        await going.wait()
        if sees_it:
            permit.check()
        return ""

    told.queue.put(Task(carry_out))
    await asyncio.sleep(0)
    going.set()
    told.queue.stop()
    told.arming.arm()
    told.put("b", 0.05)
    assert await told.idle() == ["b begun", "b done"]
    assert told.outcome() == (OutcomeKind.DONE, "b is done")


# The count of stops under which a task was typed


async def test_a_task_typed_before_a_stop_is_refused_at_entry(told: Told) -> None:
    stamp = told.queue.stops
    told.queue.stop("F12")
    told.arming.arm()
    with pytest.raises(Stopped, match=r"a stop came after it \(F12\)"):
        told.put("typed before", stamp=stamp)
    # one that needs no arming is refused as well
    with pytest.raises(Stopped):
        told.put("typed before", stamp=stamp, armed=False)
    told.put("typed behind", stamp=told.queue.stops)
    assert await told.idle() == ["typed behind begun", "typed behind done"]


@pytest.mark.parametrize("armed", [True, False])
async def test_a_task_is_refused_when_its_turn_comes_behind_a_stop(
    told: Told, monkeypatch: pytest.MonkeyPatch, armed: bool
) -> None:
    taken = told.queue._next

    def overtaken(*turn: Any) -> object:
        found = taken(*turn)
        # in the key's thread, between the taking of a task and its beginning
        if found is not None:
            told.queue.stop("F12")
            told.arming.arm()
        return found

    monkeypatch.setattr(told.queue, "_next", overtaken)
    told.put("a", armed=armed)
    assert await told.idle() == ["a given up"]
    assert told.outcome() == (OutcomeKind.REFUSED, "Not sent: a stop came after it (F12).")


async def test_a_task_is_refused_when_its_turn_comes_and_nothing_is_armed(told: Told) -> None:
    told.put("a", 0.02)
    told.put("b")
    await asyncio.sleep(0)
    told.arming.disarm("No key for a minute: no longer armed.")
    assert await told.idle() == ["a begun", "a done", "b given up"]
    assert told.outcome() == (OutcomeKind.REFUSED, "No key for a minute: no longer armed.")


async def test_a_task_that_needs_no_arming_is_done_without(told: Told) -> None:
    told.arming.disarm()
    with pytest.raises(NotArmed):
        told.put("a")
    told.put("b", armed=False)
    assert await told.idle() == ["b begun", "b done"]


async def test_a_permit_ends_with_a_stop_and_stays_ended(told: Told) -> None:
    permit = told.queue.permit()
    permit.check()
    assert permit.refusal() == ""
    told.queue.stop("F12")
    for _ in range(2):
        assert permit.refusal() == "Not sent: a stop came after it (F12)."
        with pytest.raises(Stopped):
            permit.check()
        # arming anew lets nothing typed before through
        told.arming.arm()
    with pytest.raises(Stopped):
        told.queue.permit(permit.stamp)
    assert told.queue.permit().refusal() == ""


async def test_a_permit_pauses_while_nothing_is_armed(told: Told) -> None:
    permit = told.queue.permit()
    told.arming.disarm("The line was lost: no longer armed.")
    assert permit.refusal() == "The line was lost: no longer armed."
    with pytest.raises(NotArmed, match="The line was lost"):
        permit.check()
    with pytest.raises(NotArmed):
        told.queue.permit()


@pytest.mark.parametrize("end", ["stop", "disarm"])
async def test_a_task_asks_before_each_frame(told: Told, end: str) -> None:
    # it sees the end itself, before the worker hears of being cancelled
    told.line.cancels_late = True
    frames: list[int] = []

    async def carry_out(permit: Permit) -> str:
        for number in range(8):
            permit.check()
            frames.append(number)
            if number == 1:
                getattr(told.queue if end == "stop" else told.arming, end)()
                if end == "stop":
                    told.arming.arm()
            await asyncio.sleep(0)
        return "all went out"

    told.queue.put(Task(carry_out))
    await told.idle()
    assert frames == [0, 1]
    assert told.outcome()[0] is OutcomeKind.REFUSED


# Tasks that fail


async def test_what_waits_behind_a_failed_task_is_dropped(told: Told) -> None:
    refused = OrderRefused("The drive is in fault.")
    told.put("a", error=refused)
    told.put("b")
    told.put("c")
    assert await told.idle() == ["a begun", "b given up", "c given up", "a given up"]
    text = "The drive is in fault. The commands behind it were dropped."
    assert told.outcome() == (OutcomeKind.REFUSED, text)
    assert told.queue.outcome is not None
    assert told.queue.outcome.error is refused
    told.put("d")
    await told.idle()
    assert told.outcome() == (OutcomeKind.DONE, "d is done")


async def test_a_failed_task_with_nothing_behind_it_drops_nothing(told: Told) -> None:
    told.put("a", error=OrderRefused("The drive is in fault."))
    assert await told.idle() == ["a begun", "a given up"]
    assert told.outcome() == (OutcomeKind.REFUSED, "The drive is in fault.")


async def test_an_error_that_nobody_foresaw_leaves_nothing_behind(told: Told) -> None:
    told.put("a", error=ZeroDivisionError("none"))
    told.put("b")
    assert await told.idle() == ["a begun", "b given up", "a given up"]
    kind, text = told.outcome()
    assert kind is OutcomeKind.REFUSED
    assert "ZeroDivisionError: none" in text
    told.put("c")
    assert (await told.idle())[3:] == ["c begun", "c done"]


async def test_a_task_given_up_says_what_was_done_of_it(told: Told) -> None:
    told.put("a", error=OrderRefused("No."), left="2 written, 6 still staged.")
    await told.idle()
    assert told.outcome() == (OutcomeKind.REFUSED, "No. 2 written, 6 still staged.")
    told.put("b", 5.0, left="3 written, 5 still staged.")
    await asyncio.sleep(0.01)
    told.queue.stop()
    await told.idle()
    assert told.outcome() == (OutcomeKind.REFUSED, "Ended by a stop. 3 written, 5 still staged.")


async def test_one_that_gave_way_to_a_newer_value_says_nothing(told: Told) -> None:
    told.put("a")
    told.put("b", error=Superseded(1, 8502))
    told.put("c")
    # nothing behind it was dropped
    assert await told.idle() == ["a begun", "a done", "b begun", "c begun", "c done"]
    assert told.before["c"] == told.before["b"]
    assert told.before["b"] is not None
    assert told.before["b"].text == "a is done"


async def test_the_drive_is_looked_at_again_behind_every_task(told: Told) -> None:
    seen: list[str] = []
    told.queue.on_change = lambda: seen.append(told.said[-1])
    told.put("a")
    told.put("b", error=Superseded(1, 8502))
    told.put("c", error=OrderRefused("No."))
    await told.idle()
    assert seen == ["a done", "b begun", "c given up"]
