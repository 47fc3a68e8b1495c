"""The async calls of the Python interface: the same results, and what a cancellation may end."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Iterator
from decimal import Decimal

import pytest

from tui.bus.line import Line
from tui.bus.link import RtuTcpLink
from tui.session.api import (
    AsyncDrive,
    AsyncDriveLine,
    DriveError,
    DriveLine,
    LineError,
    NotStopped,
    NotWritten,
    open_drives_async,
)
from tui.session.api.line import open_for_script
from tui.session.arming import NotArmed
from tui.session.connect.open_line import OpenLine, demo_line
from tui.simulator import DriveSpec, LineTiming, Simulation

BAUD = 2400
"""Of a slow line: one exchange takes 0.08 s."""


@pytest.fixture
async def line() -> AsyncIterator[AsyncDriveLine]:
    async with open_drives_async("sim:atv71@1,atv312@2,powerdrive@3") as opened:
        yield opened


@pytest.fixture
async def drive(line: AsyncDriveLine) -> AsyncDrive:
    return await line.drive()


@pytest.fixture
def slow() -> Iterator[tuple[Simulation, OpenLine]]:
    """A drive on a line that takes the time of its baud."""
    timing = LineTiming(baud=BAUD, format="8N1", real_time=True)
    with Simulation([DriveSpec("atv71", 1)], timing=timing) as simulation:
        opened = OpenLine("slow", Line(RtuTcpLink(*simulation.serve_rtu_tcp())))
        opened.line.open(wait=20.0)
        yield simulation, opened
        opened.line.close()


async def test_values_equal_those_of_the_blocking_calls(line: AsyncDriveLine) -> None:
    drive, other = await asyncio.gather(line.drive(), line.drive(2))
    assert (drive.profile, drive.address, other.profile) == ("atv71", 1, "atv312")
    found, others = await asyncio.gather(drive.read("hsp", "W3201"), other.read("HSP"))
    assert (found["hsp"].number, found["W3201"].code) == (Decimal(50), "ETA")
    assert others["HSP"].number == Decimal(50)
    with pytest.raises(DriveError, match="NONE"):
        await drive.read("NONE")
    with pytest.raises(LineError, match="9 did not answer"):
        await line.drive(9)


async def test_only_an_armed_drive_is_written(drive: AsyncDrive) -> None:
    with pytest.raises(NotArmed, match=r"with drive\.armed"):
        await drive.write({"HSP": 40})
    with drive.armed():
        assert await drive.write({"HSP": 40.5}) == {"HSP": "HSP: 50.0 Hz -> 40.5 Hz"}
        with pytest.raises(NotWritten):
            await drive.write({"HSP": 700})
        assert await drive.save()
    with pytest.raises(NotArmed):
        await drive.save()
    assert (await drive.read("HSP"))["HSP"].number == Decimal("40.5")


async def test_samples_follow_one_another(drive: AsyncDrive) -> None:
    samples = []
    async for sample in drive.watch("RFR", "ETA", every=0.2):
        samples.append(sample)
        if len(samples) == 3:
            break
    assert all(sample.values["RFR"].good and not sample.error for sample in samples)
    times = [sample.values["ETA"].time for sample in samples]
    assert times == sorted(set(times))


async def test_watch_refuses_an_impossible_cycle_time(drive: AsyncDrive) -> None:
    with pytest.raises(DriveError, match="not a cycle time"):
        await anext(aiter(drive.watch("ETA", every=0)))


async def test_loop_of_the_script_runs_while_a_call_waits() -> None:
    line = AsyncDriveLine(demo_line({"atv71": 20.0}))
    drive = await line.drive()
    ticks = 0

    async def tick() -> None:
        nonlocal ticks
        while True:
            ticks += 1
            await asyncio.sleep(0.01)

    ticking = asyncio.create_task(tick())
    assert "stopped" in await drive.stop()
    ticking.cancel()
    assert ticks > 20
    assert (await drive.read("RFR"))["RFR"].number == 0
    await line.close()
    with pytest.raises(LineError, match="closed"):
        await drive.read("RFR")


async def test_motor_that_cannot_be_stopped_raises() -> None:
    async with open_drives_async("sim:atv71", read_only=True) as line:
        with pytest.raises(NotStopped):
            await (await line.drive()).stop()


async def test_calls_of_loops_in_several_threads_share_a_drive(drive: AsyncDrive) -> None:
    found: list[Decimal | None] = []

    def other_loop() -> None:
        found.append(asyncio.run(drive.read("HSP"))["HSP"].number)

    threads = [threading.Thread(target=other_loop) for _ in range(3)]
    for thread in threads:
        thread.start()
    await drive.read("HSP")
    for thread in threads:
        await asyncio.to_thread(thread.join)
    assert found == [Decimal(50)] * 3


# Cancelled callers


async def test_exchange_in_flight_continues_after_its_caller(
    slow: tuple[Simulation, OpenLine],
) -> None:
    """A late reply must be that of its own request, for each moment of the cancellation."""
    _, opened = slow
    line = AsyncDriveLine(opened)
    drive = await line.drive(profile="atv71")
    values = await drive.read("HSP", "ACC", "DEC")
    good = {code: value.raw for code, value in values.items()}
    cancelled = 0
    for step in range(12):
        code, following = ("HSP", "ACC") if step % 2 else ("DEC", "HSP")
        try:
            async with asyncio.timeout(0.01 * step):
                await drive.read(code)
        except TimeoutError:
            cancelled += 1
        found = (await drive.read(following))[following]
        assert (found.raw, found.good) == (good[following], True)
    assert cancelled > 3
    directions = "".join(frame.direction for frame in opened.line.trace)
    assert directions.count("out") > 24
    assert "outout" not in directions, "a request was sent before the reply to the one before it"
    await line.close()


async def test_cancelled_write_sends_no_more_frames(
    slow: tuple[Simulation, OpenLine],
) -> None:
    _, opened = slow
    line = AsyncDriveLine(opened)
    drive = await line.drive(profile="atv71")
    codes, journal = ("ACC", "DEC", "AC2", "DE2"), line._calls.fleet.journal
    raws = {code: value.raw for code, value in (await drive.read(*codes)).items()}
    with drive.armed():
        writing = asyncio.create_task(drive.write(dict.fromkeys(codes, 7)))
        while True:
            if journal.sent:
                break
            await asyncio.sleep(0.01)
        writing.cancel()
        with pytest.raises(asyncio.CancelledError):
            await writing
        await asyncio.sleep(2.0)
        found = {code: value.raw for code, value in (await drive.read(*codes)).items()}
    written = [code for code in codes if found[code] != raws[code]]
    assert 1 <= len(written) < len(codes), written
    await line.close()


async def test_stop_continues_after_its_caller() -> None:
    line = AsyncDriveLine(demo_line({"atv71": 20.0}))
    drive = await line.drive()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.0):
            await drive.stop()
    begun = time.monotonic()
    while (await drive.read("RFR"))["RFR"].number:
        assert time.monotonic() - begun < 20
    await line.close()


async def test_cancelled_open_closes_the_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened: list[OpenLine] = []
    original = open_for_script

    def opening(text: str, *, read_only: bool, accept: bool) -> OpenLine:
        time.sleep(0.2)
        opened.append(original(text, read_only=read_only, accept=accept))
        return opened[-1]

    monkeypatch.setattr("tui.session.api.line.open_for_script", opening)
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.05), open_drives_async("sim:atv71"):
            pytest.fail("the block was begun")
    with pytest.raises(LineError, match="closed"):
        opened[0].line.spawn(asyncio.Event().wait, "late work")


async def test_cancelled_block_closes_the_line() -> None:
    entered, lines = asyncio.Event(), []

    async def work() -> None:
        async with open_drives_async("sim:atv71") as line:
            lines.append(line)
            entered.set()
            await asyncio.sleep(60)

    task = asyncio.create_task(work())
    await entered.wait()
    task.cancel()
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    with pytest.raises(LineError, match="closed"):
        await lines[0].drive()


def test_blocking_line_is_not_affected_by_loops() -> None:
    with DriveLine(demo_line({"atv71": 20.0})) as line:
        drive = line.drive()

        async def blocking_in_a_loop() -> bool:
            return drive.read("RFR")["RFR"].good

        assert asyncio.run(blocking_in_a_loop())
