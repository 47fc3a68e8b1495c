"""Blocks of a script that run motors: how they end, by themselves, by errors, and by signals."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Iterator
from typing import Any, cast

import pytest

from tui.bus.errors import LineLost
from tui.drive.errors import DriveError
from tui.session.api import AsyncRunningMotor, MotorStopped, NotStopped, RunningMotor, running_motor
from tui.session.api.running_motor import EndBySignal


class Run:
    """A run of a motor that only notes its end."""

    def __init__(self) -> None:
        self.is_over = threading.Event()
        self.whys: list[str] = []

    def end(self, why: str) -> None:
        self.whys.append(why)


def guard(task: asyncio.Task[Any] | None = None, *, leaving: bool = False) -> EndBySignal:
    """The guard of a block that has begun."""
    made = EndBySignal(cast("Any", Run()), task)
    if leaving:
        made.is_leaving = True
    made.begin()
    return made


def whys(*guards: EndBySignal) -> list[list[str]]:
    return [cast("Any", each.run).whys for each in guards]


def raised(number: int) -> str:
    """The error that a signal raises in the main thread."""
    try:
        signal.raise_signal(number)
    except (KeyboardInterrupt, SystemExit) as error:
        return repr(error)
    return ""


def checked(found: EndBySignal) -> str:
    try:
        found.check()
    except (KeyboardInterrupt, SystemExit) as error:
        return repr(error)
    return ""


@pytest.fixture(autouse=True)
def _no_blocks() -> Iterator[None]:
    """Blocks of earlier tests are over; those of this one are forgotten."""
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    yield
    for left in tuple(running_motor._guards):
        left.close()
    after = {number: signal.getsignal(number) for number in before}
    assert after == before


@pytest.mark.parametrize(
    ("number", "error", "name"),
    [(signal.SIGTERM, "SystemExit(143)", "SIGTERM"), (signal.SIGINT, "KeyboardInterrupt()", "")],
)
def test_signal_ends_all_runs_and_raises_in_the_last_block(
    number: int, error: str, name: str
) -> None:
    outer, inner = guard(), guard()
    assert raised(number) == error
    assert all(name in why[0] and why[0].startswith("ended by ") for why in whys(outer, inner))
    assert [len(why) for why in whys(outer, inner)] == [1, 1]
    assert (checked(outer), checked(inner)) == ("", ""), "it was raised already"
    assert not outer.is_awaited


def test_signal_during_the_stop_is_raised_once_after_it() -> None:
    outer, inner = guard(), guard(leaving=True)
    assert raised(signal.SIGTERM) == ""
    assert raised(signal.SIGINT) == ""
    assert inner.is_awaited
    cast("Any", outer.run).is_over.set()
    assert inner.is_awaited, "its own motor runs"
    cast("Any", inner.run).is_over.set()
    assert not inner.is_awaited
    inner.close()
    assert checked(inner) == "SystemExit(143)", "the first signal"
    assert checked(inner) == ""
    assert checked(outer) == ""


def test_handlers_are_those_of_the_script_after_the_last_block() -> None:
    before = signal.getsignal(signal.SIGTERM)
    outer, inner = guard(), guard()
    own = signal.getsignal(signal.SIGTERM)
    assert own is not before
    outer.close()
    assert signal.getsignal(signal.SIGTERM) is own
    inner.close()
    assert signal.getsignal(signal.SIGTERM) is before


def test_inner_block_leaves_a_signal_that_the_script_has_set_in_the_outer_one() -> None:
    before = signal.getsignal(signal.SIGUSR1)
    guard()
    signal.signal(signal.SIGUSR1, signal.SIG_DFL)
    inner = guard()
    assert signal.getsignal(signal.SIGUSR1) is signal.SIG_DFL
    inner.close()
    signal.signal(signal.SIGUSR1, before)


def test_block_of_another_thread_sets_no_handler_and_is_ended_too() -> None:
    before, made = signal.getsignal(signal.SIGTERM), list[EndBySignal]()
    thread = threading.Thread(target=lambda: made.append(guard()), name="block")
    thread.start()
    thread.join()
    assert not made[0].is_main
    assert signal.getsignal(signal.SIGTERM) is before
    here = guard()
    assert raised(signal.SIGTERM) == "SystemExit(143)"
    assert whys(*made, here) == [["ended by SIGTERM"]] * 2
    here.close()
    assert signal.getsignal(signal.SIGTERM) is before


def test_signal_cancels_the_tasks_of_blocks_and_is_raised_by_one_of_them() -> None:
    ends: list[str] = []

    async def block(both: asyncio.Barrier, name: str) -> None:
        found = guard(asyncio.current_task())
        await both.wait()
        try:
            await asyncio.sleep(60)
        except asyncio.CancelledError:
            ends.append(f"{name} cancelled, awaited {found.is_awaited}")
        cast("Any", found.run).is_over.set()
        await both.wait()
        ends.append(f"{name} awaited {found.is_awaited}, raises {checked(found)}")
        found.close()

    async def script() -> None:
        both = asyncio.Barrier(3)
        tasks = [asyncio.create_task(block(both, name)) for name in "ab"]
        await both.wait()
        assert raised(signal.SIGTERM) == ""
        await both.wait()
        await asyncio.gather(*tasks)

    asyncio.run(script())
    assert sorted(ends[:2]) == [f"{name} cancelled, awaited True" for name in "ab"]
    first, second = sorted(ends[2:], key=lambda text: "SystemExit" not in text)
    assert first.endswith("awaited False, raises SystemExit(143)")
    assert second.endswith("awaited False, raises ")


def test_block_whose_loop_was_closed_is_forgotten() -> None:
    async def block() -> EndBySignal:
        return guard(asyncio.current_task())

    left = asyncio.run(block())
    assert left.is_over
    assert raised(signal.SIGTERM) == "SystemExit(143)", "no other block is there"
    before = len(running_motor._guards)
    here = guard()
    assert len(running_motor._guards) == before, "the one left has gone"
    assert raised(signal.SIGINT) == "KeyboardInterrupt()"
    here.close()
    assert running_motor._guards == []


# Blocks of a run that only notes what is done with it


class BlockRun(Run):
    """A run that starts after some looks at it, and ends with an error or without one."""

    def __init__(self, starts: Exception | None = None, ends: Exception | None = None) -> None:
        super().__init__()
        self.is_started = threading.Event()
        self.error: Exception | None = None
        self.log: list[str] = []
        self._starts, self._ends, self._looks = starts, ends, 0

    def begin(self, permit: str) -> None:
        self.log.append(f"begin {permit}")
        if isinstance(self._starts, DriveError):
            raise self._starts

    def settle(self) -> None:
        self._looks += 1
        if self._looks == 1:
            self.error = self._starts
            self.is_started.set()
            if self.error is not None:
                self.is_over.set()

    def end(self, why: str) -> None:
        if not self.is_over.is_set():
            self.log.append(f"end {why}")
            self.error = self.error or self._ends
        self.is_over.set()
        self.is_started.set()

    def run(self, direction: str, reference: str | None) -> BlockRun:
        self.log.append(f"{direction} {reference}")
        return self

    def permit(self, does: str) -> str:
        return f"permit: {does}"


STOPPED, NOT_STOPPED = MotorStopped("by a panel"), NotStopped("it turns")


def shown(error: BaseException | None) -> str:
    """An error with its notes, and those in whose place it is."""
    if error is None:
        return ""
    return f"{error!r} {getattr(error, '__notes__', [])}"


def blocking(run: BlockRun, body: str, early: bool) -> str:
    motor = RunningMotor(cast("Any", run), "reverse", "20Hz")
    try:
        with motor:
            run.log.append(f"inside {motor.ended!r}")
            if early:
                run.end("by others")
                run.log.append(f"ended {motor.ended!r}")
                motor.wait(5.0)
            else:
                motor.wait(0.01)
            if body:
                raise KeyError(body)
    except BaseException as error:
        return shown(error)
    return ""


def awaiting(run: BlockRun, body: str, early: bool) -> str:
    async def block() -> str:
        motor = AsyncRunningMotor(cast("Any", run), "reverse", "20Hz")
        try:
            async with motor:
                run.log.append(f"inside {motor.ended!r}")
                if early:
                    run.end("by others")
                    run.log.append(f"ended {motor.ended!r}")
                    await motor.wait(5.0)
                else:
                    await motor.wait(0.01)
                if body:
                    raise KeyError(body)
        except BaseException as error:
            return shown(error)
        return ""

    return asyncio.run(block())


BEGUN, IN, END = ["reverse 20Hz", "begin permit: Run it"], "inside ''", "end the block has ended"


@pytest.mark.parametrize("block", [blocking, awaiting])
@pytest.mark.parametrize(
    ("starts", "ends", "body", "early", "log", "error"),
    [
        (None, None, "", False, [*BEGUN, IN, END], ""),
        (DriveError("not now"), None, "", False, [*BEGUN, END], "DriveError('not now') []"),
        (LineLost("cut"), None, "", False, BEGUN, "LineLost('cut') []"),
        (None, NOT_STOPPED, "", False, [*BEGUN, IN, END], "NotStopped('it turns') []"),
        (None, None, "x", False, [*BEGUN, IN, END], "KeyError('x') []"),
        (None, STOPPED, "x", False, [*BEGUN, IN, END], "KeyError('x') ['by a panel']"),
        (None, NOT_STOPPED, "x", False, [*BEGUN, IN, END], "NotStopped('it turns') []"),
        (None, STOPPED, "", True, [*BEGUN, IN, "end by others", "ended 'by a panel'"],
         "MotorStopped('by a panel') []"),
        (None, None, "x", True, [*BEGUN, IN, "end by others", "ended ''"],
         "KeyError('x') []"),
    ],
)  # fmt: skip
def test_block_ends_its_run_and_raises_what_the_script_has_to_know(
    monkeypatch: pytest.MonkeyPatch, block: Any, starts: Any, ends: Any, body: str, early: bool,
    log: list[str], error: str,
) -> None:  # fmt: skip
    monkeypatch.setattr(running_motor, "ENDED_CHECK_INTERVAL", 0.01)
    run = BlockRun(starts, ends)
    assert block(run, body, early) == error
    assert run.log == log
    assert running_motor._guards == []
