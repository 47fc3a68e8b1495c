"""`status` on a drive in fault: causes and checks with current values, in text and JSON."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tui.cli.shared.drive_status import Status, status_document, status_of_drive, status_table
from tui.cli.shared.output import json_text
from tui.drive.profile import library
from tui.session.connect.open_line import OpenLine, demo_line
from tui.session.drive import DriveSession
from tui.session.shown import Quality

from ..drive.test_fault_help import own_drive
from .commands import refused, run


@asynccontextmanager
async def line(family: str) -> AsyncIterator[OpenLine]:
    opened = demo_line({family: 0.0})
    try:
        yield opened
    finally:
        opened.close()


async def status_of(opened: OpenLine, family: str) -> Status:
    session = DriveSession(opened.line, 1, library.load(family))
    return await status_of_drive(session, opened)


def provoke(opened: OpenLine, fault: str | int, *, persists: bool = False) -> None:
    assert opened.simulation is not None
    opened.simulation.drive(1).provoke(fault, persists=persists)


def reported_of(status: Status) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(json_text(status_document("demo", status)))
    return found


def text_of(status: Status) -> str:
    return "\n".join(f"{title}: {text}" for title, text in status_table(status))


async def test_fault_has_causes_checks_and_live_values() -> None:
    async with line("atv71") as opened:
        assert opened.simulation is not None
        opened.simulation.drive(1).set("DEC", 5)
        provoke(opened, "ObF")
        status = await status_of(opened, "atv71")
    reported = reported_of(status)["fault"]
    assert (reported["raw"], reported["code"], reported["name"]) == (18, "ObF", "Overbraking")
    assert reported["causes"][0] == "The braking is too sudden for the inertia"
    assert reported["confidence"] == "public"
    assert "AAV49428" in reported["source"]
    assert "Increase DEC" in reported["checks"]
    (ramp,) = [row for row in reported["look_at"] if row["code"] == "DEC"]
    assert (ramp["value"]["text"], ramp["value"]["unit"], ramp["value"]["quality"]) == (
        "0.5", "s", "good",
    )  # fmt: skip
    assert ramp["why"] == "the active ramp"
    assert reported["reset"] == {
        "way": "automatic",
        "confidence": "practice",
        "possible_now": True,
        "wait_s": None,
        "follows": "Modbus commands this drive. A reset leads to Switch on disabled. The motor"
        " runs only on a new run command. No input is closed at the terminals now.",
    }
    text = text_of(status)
    assert reported["supported"] == [
        {
            "text": "The braking is too sudden for the inertia",
            "code": "DEC",
            "reason": "DEC 0.5 s (up to 1 s)",
            "source": "general drive knowledge",
            "confidence": "practice",
        }
    ]
    for part in (
        "supported: The braking is too sudden for the inertia: DEC 0.5 s (up to 1 s)",
        "probably: The braking is too sudden for the inertia; ",
        "(public guide)",
        "check: Increase DEC; ",
        "(general practice)",
        "check: DEC 0.5 s, the active ramp",
        "reset: a fault reset works now, as the drive reports. ",
    ):
        assert part in text


async def test_causes_are_in_the_weighed_order() -> None:
    async with line("atv71") as opened:
        assert opened.simulation is not None
        drive = opened.simulation.drive(1)
        for code, raw in {"ITH": 60, "NCR": 80, "THT": 2}.items():
            drive.set(code, raw)
        provoke(opened, "OLF")
        status = await status_of(opened, "atv71")
    reported = reported_of(status)["fault"]
    assert reported["causes"][0] == "ITH is below the motor nameplate current"
    excluded = {row["text"]: row["reason"] for row in reported["ruled_out"]}
    assert excluded["Self-cooled motor running slowly"] == "ruled out, THT Force-cooled motor"
    assert status.finding is not None
    failed = {
        code: replace(reading, quality=Quality.STALE)
        for code, reading in status.finding.readings.items()
    }
    old = replace(status.finding, readings=failed).advice
    assert old is not None
    assert (old.excluded, old.supported) == ((), ())
    assert {cause.verdict for cause in old.causes} == {"open"}


async def test_drive_reports_that_the_cause_is_still_present() -> None:
    async with line("atv312") as opened:
        provoke(opened, "ObF", persists=True)
        status = await status_of(opened, "atv312")
    assert reported_of(status)["fault"]["reset"]["possible_now"] is False
    assert "reset: Not yet: the drive reports" in text_of(status)


async def test_fault_that_needs_a_wait_before_the_reset_says_so() -> None:
    async with line("atv21") as opened:
        provoke(opened, "OL2")
        status = await status_of(opened, "atv21")
    reported = reported_of(status)["fault"]
    assert reported["reset"]["wait_s"] == 120
    assert reported["reset"]["possible_now"] is None
    assert "wait about 120 s before it (general practice)" in text_of(status)


async def test_trip_without_a_fault_number_has_help() -> None:
    async with line("varmeca") as opened:
        provoke(opened, 1)
        status = await status_of(opened, "varmeca")
    reported = reported_of(status)["fault"]
    assert (reported["raw"], reported["code"], reported["name"]) == (None, None, None)
    assert reported["confidence"] == "manual"
    assert {row["code"] for row in reported["look_at"]} == {"11.63", "15.07", "10.33"}


async def test_alarm_has_causes_but_no_reset() -> None:
    async with line("atv71") as opened:
        assert opened.simulation is not None
        opened.simulation.drive(1).set("LRS6", 1 << 8)
        status = await status_of(opened, "atv71")
    reported = reported_of(status)
    assert (reported["fault"], reported["alarms"]) == (None, ["Undervoltage alarm"])
    rows = text_of(status).splitlines()
    at = rows.index("Alarms: Undervoltage alarm")
    assert rows[at + 1] == "  probably: Undervoltage alarm: Mains low or a dip (general practice)"
    assert any(row.startswith("  check: ULN 2") for row in rows)
    assert not any(row.startswith("  reset") for row in rows)


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "atv71", "varmeca"])
async def test_no_fault_reads_and_reports_nothing(family: str) -> None:
    async with line(family) as opened:
        status = await status_of(opened, family)
    assert status.finding is None
    assert reported_of(status)["fault"] is None
    assert "probably" not in text_of(status)


def test_profile_is_checked_with_its_help(tmp_path: Path) -> None:
    profile = own_drive(tmp_path, '[[faults]]\nraw = 900\nprobable = ["A jam"]\n')
    output = refused(2, "profiles", "--check", profile)
    assert "help/mine.toml:1: help of fault 900: there is no such fault." in output
    own_drive(tmp_path, '[[faults]]\nraw = 9\nprobable = ["A jam"]\n')
    assert "no fault found" in run(0, "profiles", "--check", profile)
