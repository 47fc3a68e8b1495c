"""Snapshots of the drives of a line, including silent ones."""

from __future__ import annotations

import pytest

from tests.waiting import until
from tui.drive.profile import library
from tui.session.connect.open_line import open_line
from tui.session.drive import DriveSession
from tui.session.monitor.line_watch import LineWatch, share_of_limit
from tui.session.monitor.monitor import Monitor


@pytest.mark.parametrize(("family", "limit"), [("atv71", "INV"), ("atv21", ""), ("powerdrive", "")])
async def test_snapshot_has_the_share_of_the_rated_current(family: str, limit: str) -> None:
    opened = open_line(f"sim:{family}@1")
    drive = DriveSession(opened.line, 1, library.load(family))
    line_watch = LineWatch(opened.line)
    try:
        assert opened.simulation is not None
        line_watch.keep(drive, Monitor(drive))
        current = drive.profile.quantity("motor_current")
        await until(lambda: 1 in line_watch.looks)
        reading = line_watch.looks[1].readings[current.code] if current else None
        assert (limit in drive.image.raws) is bool(limit)
        assert (share_of_limit(drive, reading) is None) is (family == "powerdrive")
    finally:
        line_watch.stop()
        opened.close()


async def test_silent_drive_keeps_its_fault_and_last_values() -> None:
    opened = open_line("sim:atv71@1")
    drive = DriveSession(opened.line, 1, library.load("atv71"))
    line_watch = LineWatch(opened.line)
    try:
        assert opened.simulation is not None
        simulated = opened.simulation.drive(1)
        simulated.provoke(18)
        line_watch.keep(drive, Monitor(drive))
        await until(lambda: 1 in line_watch.states and line_watch.states[1].kind == "fault")
        simulated.power_off()
        await until(lambda: bool(line_watch.looks[1].error))
        look = line_watch.looks[1]
        assert look.state is None
        assert look.before is not None
        assert not look.before.error
        assert line_watch.states[1].kind == "fault", "a silent drive is not one without its fault"
        # also after the next look in vain
        await until(lambda: line_watch.looks[1].time > look.time)
        assert line_watch.looks[1].before is look.before
    finally:
        line_watch.stop()
        opened.close()
