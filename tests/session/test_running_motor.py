"""`with drive.running(...)`: each end of the block stops the motor; no mistake starts it."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.programs import wait_until
from tui.bus.line import Line
from tui.bus.line_events import DevicesStopped
from tui.bus.link import RtuTcpLink
from tui.bus.program import Program
from tui.session.api import (
    AsyncDriveLine,
    Drive,
    DriveError,
    DriveLine,
    LineError,
    MotorStopped,
    MotorTripped,
    NotStopped,
)
from tui.session.arming import NotArmed
from tui.session.connect.open_line import OpenLine
from tui.session.journal import Journal
from tui.simulator import DriveSpec, FaultRates, Simulation

RAMP = 10
"""The ramp of the drives here, in 0.1 s for 50 Hz."""


@dataclass(frozen=True, slots=True)
class MotorBench:
    """A simulated drive, and the drive of a script on a line to it."""

    simulation: Simulation
    line: DriveLine
    drive: Drive

    @property
    def turns(self) -> bool:
        return abs(self.simulation.drive(1).motor.frequency) > 2

    @property
    def stands(self) -> bool:
        return self.simulation.drive(1).motor.frequency == 0

    @property
    def command_word(self) -> int:
        return self.simulation.drive(1).raw("CMD")

    def wait_turning(self) -> None:
        wait_until(lambda: self.turns, "the motor turns", 20.0)


def opened(simulation: Simulation) -> OpenLine:
    line = Line(RtuTcpLink(*simulation.serve_rtu_tcp()), gated=True)
    line.open(wait=20.0)
    return OpenLine(f"bench {id(simulation)}", line)


def spec(**sets: int) -> DriveSpec:
    return DriveSpec("atv71", 1, sets={"ACC": RAMP, "DEC": RAMP, **sets})


@pytest.fixture
def bench() -> Iterator[MotorBench]:
    with Simulation([spec()]) as simulation, DriveLine(opened(simulation)) as line:
        yield MotorBench(simulation, line, line.drive(profile="atv71"))


def leaving_raises(
    error: type[BaseException], match: str | None = None
) -> AbstractContextManager[pytest.ExceptionInfo[BaseException]]:
    """Expect an error of a whole block, not of one call in it."""
    return pytest.raises(error, match=match)


def stop_by_another_program(bench: MotorBench) -> None:
    """Another program stops the motor: this one is notified, and the drive gets its word."""
    stopped = DevicesStopped((1,), "drivepanel stop", Program("id", "stop", 4711))
    bench.line._calls.line.facts.events.emit(stopped)
    bench.simulation.drive(1).halt()


# The start


def test_motor_runs_only_inside_the_block(bench: MotorBench) -> None:
    with bench.drive.armed():
        with bench.drive.running("20Hz") as motor:
            bench.wait_turning()
            motor.wait(1.5)
            assert bench.drive.read("RFR")["RFR"].number == 20
            assert motor.ended == ""
        assert bench.stands
    assert bench.simulation.drive(1).fault is None
    assert motor.ended == ""


def test_motor_runs_in_reverse_and_at_the_current_reference(bench: MotorBench) -> None:
    with bench.drive.armed(), bench.drive.running("20Hz", reverse=True):
        wait_until(lambda: bench.simulation.drive(1).motor.frequency < -15, "it turns in reverse")
    with bench.drive.armed(), bench.drive.running():
        wait_until(lambda: bench.simulation.drive(1).motor.frequency > 15, "it turns forward")
    assert bench.stands


def test_nothing_is_started_without_arming(bench: MotorBench) -> None:
    before = len(bench.line._calls.fleet.journal.sent)
    with pytest.raises(NotArmed, match=r"Run it inside `with drive\.armed"), bench.drive.running():
        pytest.fail("the block was begun")
    with bench.drive.armed():
        motor = bench.drive.running("20Hz")
    with pytest.raises(NotArmed), motor:
        pytest.fail("the block was begun")
    assert len(bench.line._calls.fleet.journal.sent) == before
    assert bench.command_word == 0


def test_creating_the_block_starts_nothing(bench: MotorBench) -> None:
    with bench.drive.armed():
        bench.drive.running("20Hz")
        time.sleep(0.5)
        assert bench.command_word == 0


@pytest.mark.parametrize(
    ("sets", "reference", "text"),
    [
        ({"HSP": 300}, "40Hz", "above HSP"),
        ({}, "fast", "is not a reference"),
        ({"CD1": 0, "CHCF": 2}, "20Hz", "not commanded by Modbus"),
    ],
)
def test_interlock_prevents_a_start(sets: dict[str, int], reference: str, text: str) -> None:
    with Simulation([spec(**sets)]) as simulation, DriveLine(opened(simulation)) as line:
        drive = line.drive(profile="atv71")
        with drive.armed(), pytest.raises(DriveError, match=text), drive.running(reference):
            pytest.fail("the block was begun")
        assert simulation.drive(1).raw("CMD") == 0


def test_unrecordable_start_starts_nothing(
    bench: MotorBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tui.session.starts.files.StartFiles.write_record", full)
    with (
        bench.drive.armed(),
        pytest.raises(DriveError, match="was not recorded"),
        bench.drive.running("20Hz"),
    ):
        pytest.fail("the block was begun")
    assert bench.command_word == 0


def test_start_is_recorded_while_the_motor_runs(bench: MotorBench) -> None:
    starts = Path(os.environ["DRIVEPANEL_STATE"])

    def records() -> list[Path]:
        return [path for path in starts.rglob("*.json") if b'"forward"' in path.read_bytes()]

    with bench.drive.armed(), bench.drive.running("20Hz"):
        (record,) = records()
        assert b'"script"' in record.read_bytes()
    wait_until(lambda: not records(), "the record is removed")


def test_motor_is_run_by_one_block_at_a_time(bench: MotorBench) -> None:
    again = bench.line.drive(profile="atv71")
    with bench.drive.armed(), bench.drive.running("20Hz"):
        with pytest.raises(DriveError, match="another block"), again.running("30Hz"):
            pytest.fail("the block was begun")
        bench.wait_turning()
        assert bench.drive.read("LFR")["LFR"].number == 20
    with bench.drive.armed():
        motor = bench.drive.running("20Hz")
        with motor:
            pass
    with (
        bench.drive.armed(),
        pytest.raises(DriveError, match=r"Call running\(\) again"),
        motor,
    ):
        pytest.fail("the block was begun")
    assert bench.stands


def test_end_of_the_block_disarms(bench: MotorBench) -> None:
    with bench.drive.armed():
        with bench.drive.running("20Hz"):
            pass
        with pytest.raises(NotArmed, match="Stopped"), bench.drive.running("20Hz"):
            pytest.fail("the block was begun")
        with pytest.raises(NotArmed, match="Stopped"):
            bench.drive.write({"ACC": 5})
    assert bench.stands


# The ends


class OwnError(Exception):
    pass


@pytest.mark.parametrize("error", [OwnError, KeyboardInterrupt, SystemExit, GeneratorExit])
def test_exception_stops_the_motor_and_propagates(
    bench: MotorBench, error: type[BaseException]
) -> None:
    with leaving_raises(error), bench.drive.armed(), bench.drive.running("20Hz"):
        bench.wait_turning()
        raise error
    assert bench.stands


def test_ctrl_c_during_the_start_leaves_no_motor_running(bench: MotorBench) -> None:
    """At each moment of the start, by the signal itself."""
    entered = 0
    for step in range(12):
        timer = threading.Timer(0.03 * step, os.kill, (os.getpid(), signal.SIGINT))
        with leaving_raises(KeyboardInterrupt), bench.drive.armed():
            timer.start()
            with bench.drive.running("20Hz"):
                entered += 1
                time.sleep(30)
        assert bench.stands
        time.sleep(0.3)
        assert bench.stands
        assert bench.command_word & 0xF != 0xF
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize(
    ("number", "error"),
    [
        (signal.SIGINT, KeyboardInterrupt),
        (signal.SIGTERM, SystemExit),
        (signal.SIGHUP, SystemExit),
        (signal.SIGUSR1, SystemExit),
    ],
)
def test_signal_ends_the_script_after_standstill(
    bench: MotorBench, number: signal.Signals, error: type[BaseException]
) -> None:
    before = signal.getsignal(number)
    with leaving_raises(error) as ended, bench.drive.armed(), bench.drive.running("20Hz"):
        bench.wait_turning()
        signal.raise_signal(number)
        pytest.fail("the block goes on")
    assert bench.stands
    if error is SystemExit:
        assert isinstance(ended.value, SystemExit)
        assert ended.value.code == 128 + number
    assert signal.getsignal(number) is before


def test_signal_during_the_stop_does_not_end_the_wait(bench: MotorBench) -> None:
    with leaving_raises(KeyboardInterrupt), bench.drive.armed(), bench.drive.running("40Hz"):
        wait_until(lambda: bench.simulation.drive(1).motor.frequency > 35, "it turns")
        for step in range(1, 4):
            threading.Timer(0.1 * step, os.kill, (os.getpid(), signal.SIGINT)).start()
    assert bench.stands


def test_own_handler_that_raises_during_the_stop_does_not_end_the_wait(bench: MotorBench) -> None:
    is_raising = threading.Event()

    def handle(_number: int, _frame: object) -> None:
        if is_raising.is_set():
            raise OwnError

    before = signal.signal(signal.SIGTERM, handle)
    kill = (os.getpid(), signal.SIGTERM)
    timers = [threading.Timer(0.1 * step, os.kill, kill) for step in range(1, 4)]
    try:
        with leaving_raises(OwnError), bench.drive.armed(), bench.drive.running("40Hz"):
            wait_until(lambda: bench.simulation.drive(1).motor.frequency > 35, "it turns")
            is_raising.set()
            for timer in timers:
                timer.start()
        is_raising.clear()
        assert bench.stands
    finally:
        is_raising.clear()
        for timer in timers:
            timer.join()
        signal.signal(signal.SIGTERM, before)


def test_motor_of_a_script_that_ignores_ctrl_c_is_stopped(bench: MotorBench) -> None:
    with bench.drive.armed(), bench.drive.running("20Hz"):
        bench.wait_turning()
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            wait_until(lambda: bench.stands, "the motor stops before the block ends", 20.0)


def test_signal_handled_by_the_script_is_left_to_it(
    bench: MotorBench,
) -> None:
    taken: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, _: taken.append(number))
    try:
        with bench.drive.armed(), bench.drive.running("20Hz"):
            signal.raise_signal(signal.SIGTERM)
            bench.wait_turning()
            assert taken == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)
    assert bench.stands


def test_signal_stops_motors_of_nested_blocks_together() -> None:
    """The outer motor does not run on until the inner one is at standstill."""
    specs = [
        DriveSpec("atv71", 1, sets={"ACC": RAMP, "DEC": RAMP}),
        DriveSpec("atv71", 2, sets={"ACC": RAMP, "DEC": 100}),
    ]
    with Simulation(specs) as simulation, DriveLine(opened(simulation)) as line:
        outer, inner = (line.drive(device, profile="atv71") for device in (1, 2))

        def speed(device: int) -> float:
            return simulation.drive(device).motor.frequency

        frequencies = []
        with leaving_raises(SystemExit), outer.armed(), outer.running("20Hz"):
            try:
                with inner.armed(), inner.running("20Hz"):
                    wait_until(lambda: min(speed(1), speed(2)) > 15, "both turn")
                    signal.raise_signal(signal.SIGTERM)
            finally:
                frequencies = [speed(1), speed(2)]
        assert frequencies == [0, 0]


def test_closing_the_line_in_the_block_stops_the_motor_first(bench: MotorBench) -> None:
    with bench.drive.armed(), bench.drive.running("20Hz"):
        bench.wait_turning()
        bench.line.close()
        assert bench.stands
    assert bench.stands


def test_block_in_another_thread_ends_with_the_line(bench: MotorBench) -> None:
    errors: list[BaseException] = []

    def work() -> None:
        try:
            with bench.drive.armed(), bench.drive.running("20Hz") as motor:
                motor.wait()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    bench.wait_turning()
    bench.line.close()
    assert bench.stands
    thread.join(20.0)
    assert not thread.is_alive()
    assert errors == []


# Stopped early


def test_trip_is_reported_at_the_end_and_immediately_by_wait(bench: MotorBench) -> None:
    with (
        leaving_raises(MotorTripped, match="Device 1 tripped: OCF"),
        bench.drive.armed(),
        bench.drive.running("20Hz") as motor,
    ):
        bench.wait_turning()
        bench.simulation.drive(1).provoke("OCF")
        wait_until(lambda: "OCF" in motor.ended, "the block may know", 20.0)
    begun = time.monotonic()
    bench.simulation.drive(1).clear_cause()
    bench.simulation.drive(1).power_cycle()
    with (
        leaving_raises(MotorTripped, match="OCF"),
        bench.drive.armed(),
        bench.drive.running("20Hz") as motor,
    ):
        bench.simulation.drive(1).provoke("OCF")
        motor.wait(60)
    assert time.monotonic() - begun < 50


def test_stop_by_another_program_is_reported_without_a_restart(
    bench: MotorBench,
) -> None:
    with (
        leaving_raises(MotorStopped, match=r"stopped by drivepanel stop.*pid 4711"),
        bench.drive.armed(),
        bench.drive.running("20Hz") as motor,
    ):
        bench.wait_turning()
        stop_by_another_program(bench)
        wait_until(lambda: motor.ended != "", "the block may know", 20.0)
        with pytest.raises(NotArmed):
            bench.drive.write({"ACC": 5})
    assert bench.stands
    time.sleep(0.5)
    assert bench.command_word & 0xF != 0xF


def test_stop_by_another_program_just_before_the_end_is_reported(bench: MotorBench) -> None:
    with (
        leaving_raises(MotorStopped, match="stopped by drivepanel stop"),
        bench.drive.armed(),
        bench.drive.running("20Hz"),
    ):
        bench.wait_turning()
        stop_by_another_program(bench)
    assert bench.stands


def test_early_stop_is_a_note_on_the_error_of_the_script(bench: MotorBench) -> None:
    with (
        leaving_raises(OwnError) as ended,
        bench.drive.armed(),
        bench.drive.running("20Hz") as motor,
    ):
        bench.wait_turning()
        bench.simulation.drive(1).provoke("OCF")
        wait_until(lambda: motor.ended != "", "it ends", 20.0)
        raise OwnError
    assert "Device 1 tripped: OCF" in "".join(ended.value.__notes__)


def test_motor_started_by_another_program_after_an_early_stop_is_not_stopped(
    bench: MotorBench,
) -> None:
    """The run ended with the early stop: the end of the block has nothing to stop."""
    with leaving_raises(MotorStopped), bench.drive.armed(), bench.drive.running("20Hz") as motor:
        bench.wait_turning()
        bench.simulation.drive(1).power_cycle()
        wait_until(lambda: motor.ended != "", "it ends", 20.0)
        bench.simulation.drive(1).run(20.0)
        bench.wait_turning()
    assert bench.turns


def test_stop_by_the_script_is_not_an_early_stop(bench: MotorBench) -> None:
    with bench.drive.armed(), bench.drive.running("20Hz") as motor:
        bench.wait_turning()
        assert "stopped" in bench.drive.stop()
        assert bench.stands
        assert motor.ended == ""
        motor.wait(60)


# Not stopped


def refuse_writes(bench: MotorBench) -> None:
    """The drive answers each write with exception 4, and its motor runs on."""
    side = bench.simulation.drive(1).line_side
    answer: Callable[[int, bytes], bytes | None] = side.answer

    def refusing(address: int, pdu: bytes) -> bytes | None:
        if pdu[0] in (6, 16):
            return bytes([pdu[0] | 0x80, 4])
        return answer(address, pdu)

    side.answer = refusing  # type: ignore[method-assign]


@pytest.mark.parametrize("expected", [nullcontext(), pytest.raises(OwnError)], ids=["end", "error"])
def test_not_stopped_replaces_every_other_error(
    bench: MotorBench, expected: AbstractContextManager[object]
) -> None:
    with (
        leaving_raises(NotStopped, match="Device 1: NOT STOPPED") as ended,
        bench.drive.armed(),
        bench.drive.running("20Hz"),
    ):
        bench.wait_turning()
        refuse_writes(bench)
        if not isinstance(expected, nullcontext):
            raise OwnError
    assert bench.turns
    if not isinstance(expected, nullcontext):
        assert isinstance(ended.value.__context__, OwnError)


def test_motor_is_stopped_when_a_lost_line_returns(
    bench: MotorBench, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.ERROR)
    ends = []

    def back() -> None:
        wait_until(lambda: "NOT STOPPED yet" in caplog.text, "it is reported", 30.0)
        ends.append(bench.turns)
        bench.simulation.faults.rates = FaultRates()
        bench.simulation.replug()

    waiting = threading.Thread(target=back)
    with bench.drive.armed(), bench.drive.running("20Hz"):
        bench.wait_turning()
        bench.simulation.drive(1).set("SLL", 0)
        bench.simulation.unplug()
        waiting.start()
    waiting.join()
    assert ends == [True]
    assert bench.stands


def test_line_closed_by_its_own_thread_raises_not_stopped(bench: MotorBench) -> None:
    with (
        leaving_raises(NotStopped, match="the line was closed"),
        bench.drive.armed(),
        bench.drive.running("20Hz"),
    ):
        bench.wait_turning()
        bench.line._calls.line.close()
    assert bench.turns


# async


def test_async_blocks_run_and_stop_the_motor(bench: MotorBench) -> None:
    line = AsyncDriveLine(bench.line._calls._opened)

    async def script() -> None:
        drive = await line.drive(profile="atv71")
        with pytest.raises(NotArmed):
            async with drive.running("20Hz"):
                pytest.fail("the block was begun")
        with drive.armed():
            async with drive.running("20Hz") as motor:
                await motor.wait(1.5)
                assert bench.turns
        assert bench.stands
        with leaving_raises(MotorTripped), drive.armed():
            async with drive.running("20Hz") as motor:
                bench.simulation.drive(1).provoke("OCF")
                await motor.wait()

    asyncio.run(script())


def test_loop_of_the_script_runs_while_the_motor_starts_and_stops(bench: MotorBench) -> None:
    line = AsyncDriveLine(bench.line._calls._opened)
    turns: list[float] = []

    async def count_turns() -> None:
        while True:
            turns.append(bench.simulation.drive(1).motor.frequency)
            await asyncio.sleep(0)

    def counted() -> int:
        found = len(turns)
        turns.clear()
        return found

    async def script() -> None:
        drive = await line.drive(profile="atv71")
        counting = asyncio.create_task(count_turns())
        with drive.armed():
            async with drive.running("20Hz") as motor:
                assert counted() > 1, "it went on while the motor started"
                await motor.wait(0.1)
                assert counted() > 1, "it went on while the motor ran"
            assert counted() > 1, "it went on while the motor stopped"
            assert bench.stands
        counting.cancel()

    asyncio.run(script())


def test_motor_of_a_cancelled_task_is_stopped_at_any_moment(bench: MotorBench) -> None:
    line = AsyncDriveLine(bench.line._calls._opened)

    async def script() -> None:
        drive = await line.drive(profile="atv71")
        for step in range(10):

            async def block() -> None:
                with drive.armed():
                    async with drive.running("20Hz"):
                        await asyncio.sleep(30)

            task = asyncio.create_task(block())
            await asyncio.sleep(0.04 * step)
            for _ in range(3):
                task.cancel()
                await asyncio.sleep(0.01)
            with pytest.raises(asyncio.CancelledError):
                await task
            assert bench.stands
            await asyncio.sleep(0.2)
            assert bench.stands
            assert bench.command_word & 0xF != 0xF

    asyncio.run(script())


@pytest.mark.parametrize(
    ("number", "error", "delays"),
    [(signal.SIGINT, KeyboardInterrupt, (0, 0.1)), (signal.SIGTERM, SystemExit, (0, 0.1, 0.2))],
)
def test_signal_ends_an_async_script_after_standstill(
    bench: MotorBench,
    number: signal.Signals,
    error: type[BaseException],
    delays: tuple[float, ...],
) -> None:
    """With a third Ctrl-C, asyncio no longer waits for tasks."""
    line = AsyncDriveLine(bench.line._calls._opened)

    async def script() -> None:
        drive = await line.drive(profile="atv71")
        with drive.armed():
            async with drive.running("20Hz"):
                await asyncio.to_thread(bench.wait_turning)
                for delay in delays:
                    timer = threading.Timer(delay, os.kill, (os.getpid(), number))
                    timer.start()
                await asyncio.sleep(30)

    with pytest.raises(error):
        asyncio.run(script())
    assert bench.stands


def test_signal_ends_the_blocks_of_several_tasks() -> None:
    specs = [DriveSpec("atv71", n, sets={"ACC": RAMP, "DEC": RAMP * n}) for n in (1, 2, 3)]
    with Simulation(specs) as simulation:
        line = AsyncDriveLine(opened(simulation))

        def speeds() -> list[float]:
            return [simulation.drive(n).motor.frequency for n in (1, 2, 3)]

        async def block(device: int, seconds: float) -> None:
            drive = await line.drive(device, profile="atv71")
            with drive.armed():
                async with drive.running("20Hz") as motor:
                    await motor.wait(seconds)

        async def script() -> None:
            blocks = [block(1, 2.0), block(2, 60.0), block(3, 60.0)]
            running = asyncio.gather(*blocks)
            await asyncio.to_thread(wait_until, lambda: speeds()[0] > 15, "the first turns")
            await asyncio.to_thread(wait_until, lambda: speeds()[0] == 0, "its block has ended")
            assert min(speeds()[1:]) > 15
            os.kill(os.getpid(), signal.SIGTERM)
            await running

        handler = signal.getsignal(signal.SIGTERM)
        with pytest.raises(SystemExit, match="143"):
            asyncio.run(script())
        assert speeds() == [0, 0, 0]
        assert signal.getsignal(signal.SIGTERM) is handler
        asyncio.run(line.close())


def test_journal_names_the_script_that_stopped(bench: MotorBench) -> None:
    with bench.drive.armed(), bench.drive.running("20Hz"):
        pass
    bench.line.close()
    written = Journal().path.read_text("utf-8")
    assert '"CMD"' in written


def test_line_without_a_drive_runs_nothing() -> None:
    with Simulation([spec()]) as simulation, DriveLine(opened(simulation)) as line:
        drive = line.drive(profile="atv71")
        simulation.unplug()
        with pytest.raises((LineError, DriveError)), drive.armed(), drive.running("20Hz"):
            pytest.fail("the block was begun")
        assert simulation.drive(1).raw("CMD") == 0
