"""A stop that a drive lacks, its replacement, and the message afterwards."""

from __future__ import annotations

from decimal import Decimal

import pytest

from tests.waiting import until
from tui.drive.orders import nearest_stop
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId
from tui.session.command.stop_report import MAY_COAST, OVER
from tui.session.events import EventLog
from tui.session.read.reader import Reader

from .test_owners import bench
from .test_stop import FAMILIES


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("way", ["emergency-stop", "quick-stop", "stop"])
def test_replacement_of_a_stop_never_coasts_or_brakes(family: str, way: OrderId) -> None:
    for chart in library.load(family).data.charts:
        if not chart.orders:
            continue
        found = nearest_stop(chart, way)
        assert found in {order.id for order in chart.orders}
        assert found in ("emergency-stop", "quick-stop", "stop")


def test_coasting_word_never_replaces_another() -> None:
    chart = library.load("varmeca").data.charts[0]
    assert nearest_stop(chart, "freewheel") == "freewheel"
    assert nearest_stop(chart, "dc-braking") == "dc-braking"


@pytest.mark.parametrize("run_hz", [20.0, 0.0])
async def test_motor_that_nothing_brakes_is_not_reported_as_stopped(run_hz: float) -> None:
    """Its output frequency is 0 at once, and its speed is not known."""
    async with bench("atv71", run_hz=run_hz) as here:
        await until(lambda: here.drive.motor.frequency >= run_hz / 2)
        frequency = here.session.profile.quantity("output_frequency")
        assert frequency is not None
        await Reader(here.session).read([frequency.code])
        here.fleet.stop([here.session], "freewheel")
        await until(lambda: here.fleet.stopper.reports[1].phase in OVER)
        report = here.fleet.stopper.reports[1]
        assert report.text == (MAY_COAST if run_hz else "stopped")
        if run_hz:
            assert abs(here.drive.motor.rotor) > 1
            assert here.fleet.events.newest is not None
            assert here.fleet.events.newest.text == f"The motor is {MAY_COAST}."


async def test_motor_that_trips_on_the_ramp_of_its_stop_is_not_reported_as_stopped() -> None:
    async with bench("atv71", run_hz=40.0) as here:
        await until(lambda: here.drive.motor.frequency > 35)
        here.fleet.stop([here.session])
        await until(lambda: here.drive.motor.frequency < 34)
        here.drive.provoke("OCF")
        await until(lambda: here.fleet.stopper.reports[1].phase in OVER)
        assert here.fleet.stopper.reports[1].text == MAY_COAST


async def test_missing_emergency_stop_becomes_a_reported_quick_stop() -> None:
    async with bench("atv71", run_hz=20.0) as here:
        await until(lambda: here.drive.motor.frequency > 10)
        here.fleet.stop([here.session], "emergency-stop")
        await until(lambda: here.fleet.stopper.reports[1].phase in ("stopped", "failed"))
        report = here.fleet.stopper.reports[1]
        assert report.phase == "stopped"
        assert "no emergency stop: quick stop" in report.text
        assert (8501, 0x0002) in here.writes()


async def test_own_stop_is_not_attributed_to_another_program() -> None:
    async with bench("atv71") as here:
        commander = here.console.commander
        await here.arm()
        commander.run("forward", "20Hz")
        await until(lambda: here.drive.motor.frequency > 5)
        await until(lambda: not here.session.work.busy)
        here.fleet.stop([here.session])
        await until(lambda: here.fleet.stopper.reports[1].phase == "stopped")
        here.session.request_full_read()
        await until(lambda: here.session.image.raws.get("CMD") == 7)
        assert commander.given.lost_orders() == ""


async def test_stop_by_another_program_is_reported_with_its_word() -> None:
    async with bench("atv71") as here:
        commander = here.console.commander
        await here.arm()
        commander.run("forward", "20Hz")
        await until(lambda: here.drive.motor.frequency > 5)
        await until(lambda: not here.session.work.busy)
        here.drive.set("CMD", 7)
        here.session.request_full_read()
        await until(lambda: here.session.image.raws.get("CMD") == 7)
        assert "CMD 16#000F is now 16#0007" in commander.given.lost_orders()


@pytest.mark.parametrize(("steps", "ends"), [(40, 500), (-90, 0)])
async def test_step_beyond_a_limit_reaches_the_limit(steps: int, ends: int) -> None:
    """40 held Up wrote nothing once the sum exceeded HSP."""
    async with bench("atv71", sets={"HSP": 500, "LSP": 0}) as here:
        commander = here.console.commander
        await here.arm()
        commander.refer("30Hz")
        await until(lambda: here.drive.raw("LFR") == 300)
        commander.step(Decimal(steps))
        await until(lambda: here.drive.raw("LFR") == ends)


async def test_run_refused_by_an_interlock_writes_no_reference() -> None:
    async with bench("atv71", sets={"FR1": 1, "LFR": 0}) as here:
        commander = here.console.commander
        await here.arm()
        commander.run("forward", "20Hz")
        await until(lambda: here.session.work.outcome is not None)
        assert here.session.work.outcome is not None
        assert here.session.work.outcome.kind == "refused"
        assert here.writes() == []


def test_event_log_keeps_the_latest_events_once() -> None:
    log = EventLog(lambda: 5.0)
    for _ in range(3):
        log.add("done", "written", 2)
    assert [(e.wall, e.device, e.text) for e in log.events] == [(5.0, 2, "written")]
    for number in range(600):
        log.add("done", str(number))
    assert len(log.events) == 500
    assert log.events[-1].text == "599"
