"""The seconds before a trip of a simulated drive, frozen when it trips."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from tui.session.monitor.fault_record import Recorder, record_name, record_text
from tui.session.reading import reading_of

from .test_command import Bench, bench


def watched(made: Bench) -> Recorder:
    recorder = Recorder(made.session, made.console.journal)
    made.console.monitor.listen(recorder.take)
    return recorder


def speed(made: Bench) -> float:
    """Value on Monitor, in Hz."""
    assert made.console.latest is not None
    return reading_of(made.console.latest.readings["RFR"]).number or 0.0


async def test_trip_records_values_and_writes_of_the_preceding_seconds() -> None:
    async with bench("atv71") as made:
        recorder = watched(made)
        made.commander.refer("10Hz")
        await made.done()
        await made.order("forward")
        await made.until(lambda: speed(made) > 5)
        made.commander.refer("20Hz")
        await made.done()
        await made.until(lambda: speed(made) > 15)
        assert recorder.latest is None
        made.drive.provoke("ObF")
        await made.until(lambda: recorder.latest is not None)
        record = recorder.latest
        assert record is not None
        assert record.fault is not None
        assert record.fault.code == "ObF"
        assert not recorder.seen
        at = record.codes.index("RFR")
        speeds = [float(m.texts[at]) for m in record.moments if m.state == "running forward"]
        assert speeds[0] < speeds[-1]
        assert speeds[-1] > 1
        assert [point.time for point in record.points] == [m.time for m in record.moments]
        run = [p.values[0] for p, m in zip(record.points, record.moments, strict=True)
               if m.state == "running forward"]  # fmt: skip
        assert run == speeds
        assert record.period > 0
        commands = [e.new for e in record.writes if e.code == "CMD"]
        assert commands == ["16#0006", "16#000F"]
        assert record.moments[-1].state == "fault ObF"
        await made.until(lambda: made.drive.fault is not None)
        # later entries belong to the next trip
        assert recorder.latest is record
        recorder.acknowledge()
        assert recorder.seen


async def test_drive_found_in_fault_is_not_recorded_as_a_trip() -> None:
    async with bench("atv71", armed=False) as made:
        made.drive.provoke("ObF")
        monitor = made.console.monitor
        await made.until(lambda: monitor.latest.state.kind == "fault")  # type: ignore[union-attr]
        recorder = watched(made)
        first = monitor.latest
        await made.until(lambda: monitor.latest is not first)
        assert recorder.latest is None
        assert recorder.seen


async def test_fault_record_is_formatted_as_text() -> None:
    async with bench("atv21") as made:
        recorder = watched(made)
        await made.order("forward")
        await made.until(lambda: recorder._kind == "running")
        made.drive.provoke(17)
        await made.until(lambda: recorder.latest is not None and recorder.latest.fault is not None)
        assert recorder.latest is not None
        session = made.session
        text = record_text(session, recorder.latest, [("FE00", "Output frequency", "12.34 Hz")])
        assert "- Probably (manual): " in text
        assert "- Check FA00, Command word: 16#D000 (bit 12" in record_text(
            session, recorder.latest, [], {"FA00": "16#D000"}
        )
        for part in ("E (17) Emergency stop", "| FE00 | Output frequency | 12.34 Hz |", "Run forw"):
            assert part in text
        rows = text.partition("## Values")[2].partition("## Writes by")[0].splitlines()
        assert len({row.count("|") for row in rows if row.startswith("|")}) == 1
        assert record_name(session, recorder.latest).endswith("-E.md")


async def test_fault_read_after_the_state_is_in_the_record() -> None:
    async with bench("atv71") as made:
        monitor = made.console.monitor
        await made.until(lambda: monitor.latest is not None and not monitor.latest.error)
        calm = monitor.latest
        assert calm is not None
        made.drive.provoke("ObF")
        await made.until(lambda: monitor.latest.state.fault is not None)  # type: ignore[union-attr]
        tripped = monitor.latest
        assert tripped is not None
        monitor.stop()
        recorder = Recorder(made.session, made.console.journal)
        for snapshot in (calm, replace(tripped, state=replace(tripped.state, fault=None))):
            recorder.take(snapshot)
        assert recorder.latest is not None
        assert recorder.latest.fault is None
        recorder.take(tripped)
        assert recorder.latest.fault == tripped.state.fault


def test_name_of_a_record_has_its_drive_time_and_fault() -> None:
    session: Any = SimpleNamespace(profile=SimpleNamespace(id="atv71"), device=4)
    record: Any = SimpleNamespace(wall=1795741236.9, fault=SimpleNamespace(code="O/b F"))
    when = time.strftime("%Y%m%d-%H%M%S", time.localtime(1795741236))
    assert len(when) == 15
    assert record_name(session, record) == f"trip-atv71-4-{when}-ObF.md"
    record.fault = None
    assert record_name(session, record) == f"trip-atv71-4-{when}-fault.md"
