"""`drivepanel stop --all` beside other programs on the line."""

from __future__ import annotations

import pytest

from tui.bus.api import Priority
from tui.bus.errors import ChecksumFault, LineError
from tui.bus.fake import FakeLine
from tui.cli.running.stop_targets import found_at
from tui.cli.shared.errors import Failure
from tui.session.connect.open_line import OpenLine, open_line

from .commands import run, tcp_line


def test_a_drive_that_another_program_leaves_alone_is_stopped_too() -> None:
    """As in a proof of its communication loss, perhaps with its motor turning."""
    with tcp_line("atv71@1", "atv312@2") as line:
        opened = open_line(line, wait=5, program="prove")
        try:
            opened.line.facts.hush(2, "Its communication time-out is being proved.")
            told = run(0, "stop", line, "--all", "--addresses", "1-2")
        finally:
            opened.close()
        assert "Device 1, Altivar 71: stopped" in told
        assert "Device 2, Altivar 312: stopped" in told
        assert opened.line.facts.stops.totals == {1: 1, 2: 1}


async def stop_of(line: FakeLine, patience: Priority) -> str:
    """What an address is stopped as."""
    opened = OpenLine("fake", line)
    found = await found_at(opened, 1, None, patience)
    return "" if found is None else found.name


def with_drive(damaged: float) -> FakeLine:
    """A line with an Altivar 71 whose first answers are damaged."""
    line = FakeLine({1: {3201: 0x0250}})
    line.devices[1].identity = {0: b"Telemecanique", 1: b"ATV71HU15M3", 2: b"V1.0"}
    line.fail_identify(1, ChecksumFault(1, 43, 0, received=b""), times=damaged)
    return line


async def test_what_is_heard_but_damaged_is_asked_for_with_more_patience() -> None:
    with pytest.raises(LineError):  # the next round is the patient one
        await stop_of(with_drive(1), Priority.BACKGROUND)
    line = with_drive(1)
    assert await stop_of(line, Priority.PATIENT) == "Altivar 71"
    with pytest.raises(Failure, match="NOT STOPPED"):
        await stop_of(with_drive(2), Priority.PATIENT)
    silent = FakeLine({1: {}})
    silent.silence(1)
    assert await stop_of(silent, Priority.PATIENT) == ""
