"""Values for Trend: read in each cycle of a monitor, kept, and recorded on a simulated line."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.programs import wait_until
from tui.bus.errors import NoAnswer
from tui.session.connect.open_line import open_line
from tui.session.connect.recorded_line import RECORD_SETTING
from tui.session.monitor.live_trace import LiveTrace
from tui.session.monitor.rates import Rates
from tui.session.monitor.trend_bands import TrendBand, store_bands, stored_bands
from tui.session.record.decoding import NO_GOOD_REPLY

from .test_monitor_faults import FIRST_SLOW, SPEED, STATE, Bench

FAST, SLOW = "SPEED", "SLOW3"


@pytest.fixture
def bench() -> Bench:
    return Bench()


async def until(holds: Callable[[], bool]) -> None:
    for _ in range(4000):
        if holds():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("it did not happen")


async def test_trace_without_a_started_monitor_reads_its_codes_and_the_state(bench: Bench) -> None:
    trace = LiveTrace(bench.monitor, [SLOW], 0.01)
    await until(lambda: len(trace.points(SLOW, 0)) > 3)
    assert {address for address, _ in bench.line.requested} == {STATE, FIRST_SLOW + 300}
    assert [point.mean for point in trace.points(SLOW, 0)][:3] == [3.0, 3.0, 3.0]
    trace.close()
    assert not bench.monitor.running


async def test_trace_of_a_started_monitor_has_slow_values_in_each_cycle(bench: Bench) -> None:
    bench.monitor.start(period=0.01)
    trace = LiveTrace(bench.monitor, [SLOW], 5.0)
    cycles = (await bench.run(8))[1:]
    assert all(FIRST_SLOW + 300 in addresses for _, addresses in cycles)
    assert bench.monitor.period == 0.01
    trace.close()
    await bench.end()


async def test_stopped_monitor_goes_on_for_a_trace_and_a_closed_one_does_not(bench: Bench) -> None:
    bench.monitor.start(period=0.01)
    trace = LiveTrace(bench.monitor, [FAST], 0.01)
    bench.monitor.stop()
    assert bench.monitor.running
    before = len(bench.line.requested)
    await until(lambda: len(bench.line.requested) > before + 6)
    assert {address for address, _ in bench.line.requested[before:]} == {STATE, SPEED}
    bench.monitor.close()
    assert not bench.monitor.running
    trace.close()
    assert not bench.monitor.running


async def test_failed_cycle_is_a_gap_and_no_value_is_repeated(bench: Bench) -> None:
    trace = LiveTrace(bench.monitor, [FAST], 0.01)
    await until(lambda: len(trace.points(FAST, 0)) > 2)
    bench.line.faults += [NoAnswer(1, 3, STATE)] * 2
    await until(lambda: None in [point.mean for point in trace.points(FAST, 0)])
    await until(lambda: trace.points(FAST, 0)[-1].mean is not None)
    points = trace.points(FAST, 0)
    times = [point.time for point in points]
    assert times == sorted(set(times))
    assert {point.quality for point in points if point.mean is None} == {NO_GOOD_REPLY}
    assert trace.points(FAST, times[-2]) == points[-1:]
    trace.close()


async def test_values_of_a_later_time_are_dropped_if_the_clock_is_set_back(bench: Bench) -> None:
    trace = LiveTrace(bench.monitor, [FAST], 0.01)
    await until(lambda: len(trace.points(FAST, 0)) > 3)
    before = trace.points(FAST, 0)[0].time
    clock = bench.monitor.session.clock
    wall = clock.wall
    clock.wall = lambda: wall() - 3600  # type: ignore[method-assign]
    try:
        await until(lambda: trace.points(FAST, 0)[0].time < before - 3000)
        times = [point.time for point in trace.points(FAST, 0)]
    finally:
        clock.wall = wall  # type: ignore[method-assign]
        trace.close()
    assert times == sorted(times)


def test_rates_with_a_slow_code_read_it_fast_only() -> None:
    rates = Rates(("A",), ("B",), ("C", "D")).with_fast(["C", "A", "E"])
    assert (rates.fast, rates.changing, rates.slow) == (("A", "C", "E"), ("B",), ("D",))


def test_bands_are_stored_for_each_line() -> None:
    bands = [TrendBand(4, "RFR"), TrendBand(5, "LCR")]
    store_bands("serial:a", bands)
    store_bands("serial:b", bands[:1])
    assert stored_bands("serial:a") == bands
    assert stored_bands("serial:b") == bands[:1]
    assert stored_bands("serial:c") == []


def test_damaged_stored_bands_are_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path))
    (tmp_path / "trend.json").write_text('{"serial:a": [[4, "RFR"], [400, "X"], ["x", 1], 7, [1]]}')
    assert stored_bands("serial:a") == [TrendBand(4, "RFR")]
    (tmp_path / "trend.json").write_text("[1]")
    assert stored_bands("serial:a") == []


def test_simulated_line_is_recorded_outside_the_state_folder_until_it_is_closed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(RECORD_SETTING, "on")
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "state"))
    opened = open_line("sim:atv71@1", wait=20)
    opened.record_privately()
    recorder = opened.recorder
    assert recorder is not None
    opened.line.spawn(lambda: opened.line.read(1, 3202, 1), "read")
    wait_until(lambda: bool(recorder.files()), "a file")
    (file,) = recorder.files()
    assert file.parent != tmp_path / "state" / "record"
    opened.close()
    assert not file.parent.exists()
    assert not (tmp_path / "state").exists()
