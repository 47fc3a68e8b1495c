"""Text about a running motor, from the record of its start."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import pytest

from tui.session.connect.identify import DriveIdentity
from tui.session.starts.record import StartRecord, offer

ZONE = timezone(timedelta(hours=2))
NOW = datetime(2026, 3, 5, 18, 2, tzinfo=ZONE)
RECORD = StartRecord(
    line="/dev/ttyUSB0",
    device=2,
    profile="atv71",
    vendor="TELEMECANIQUE",
    reference="ATV71HU22N4",
    version="0201",
    name="MACHINE 4",
    order="forward",
    boot_id="boot",
    pid=7,
    started="100",
    program="panel",
    left_running=False,
    wall="2026-03-05T17:34:09.120+02:00",
)
IDENTITY = DriveIdentity(
    2, "TELEMECANIQUE", "ATV71HU22N4", "0201", "MACHINE 4", "atv71", ("atv71", "atv61")
)
EXITED = "process 7, which has exited. No program commands it."
TODAY = f"Running since 17:34. Started by panel, {EXITED}"


def test_running_motor_is_reported() -> None:
    assert offer(RECORD, IDENTITY, True, NOW) == TODAY


def test_motor_at_standstill_is_not_reported() -> None:
    assert offer(RECORD, IDENTITY, False, NOW) == ""


def test_unseen_motor_may_run() -> None:
    assert offer(RECORD, IDENTITY, None, NOW) == f"May be r{TODAY[1:]}"


def test_date_is_shown_unless_it_is_today() -> None:
    tomorrow = NOW + timedelta(days=1)
    assert "since 2026-03-05 17:34. Started by" in offer(RECORD, IDENTITY, True, tomorrow)


def test_time_is_shown_in_the_current_zone() -> None:
    assert "since 15:34. Started by" in offer(RECORD, IDENTITY, True, NOW.astimezone(UTC))


def test_motor_left_running_is_reported() -> None:
    text = offer(replace(RECORD, left_running=True), IDENTITY, True, NOW)
    assert text == f"Running since 17:34. Left running on purpose by panel, {EXITED}"


def test_running_program_is_not_reported_as_ended() -> None:
    frozen = EXITED.replace("has exited", "does not answer on this line")
    text = offer(RECORD, IDENTITY, True, NOW, lives=True)
    assert text == f"Running since 17:34. Started by panel, {frozen}"
    left = offer(replace(RECORD, left_running=True), IDENTITY, True, NOW, lives=True)
    assert left == f"Running since 17:34. Left running on purpose by panel, {frozen}"


def test_invalid_time_is_omitted() -> None:
    text = offer(replace(RECORD, wall="soon"), IDENTITY, True, NOW)
    assert text == f"Running. Started by panel, {EXITED}"


@pytest.mark.parametrize(
    "other",
    [
        {"device": 3},
        {"vendor": "LEROY"},
        {"reference": "ATV71HU30N4"},
        {"version": "0202"},
        {"name": "MACHINE 5"},
        {"profile": "atv31", "candidates": ("atv31",)},
    ],
    ids=lambda other: next(iter(other)),
)
def test_other_drive_at_the_address_withdraws_the_offer(other: dict[str, Any]) -> None:
    assert offer(RECORD, replace(IDENTITY, **other), True, NOW) == ""


def test_missing_identity_field_is_not_a_difference() -> None:
    nameless = DriveIdentity(2, "", "", "", "", None, ())
    assert offer(RECORD, nameless, True, NOW) == TODAY
    assert offer(RECORD, None, True, NOW) == TODAY
    silent = replace(RECORD, vendor="", reference="", version="", name="", profile="")
    assert offer(silent, IDENTITY, True, NOW) == TODAY


def test_candidate_profile_is_not_another_drive() -> None:
    assert offer(replace(RECORD, profile="atv61"), IDENTITY, True, NOW) == TODAY
