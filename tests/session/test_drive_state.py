"""The state of a drive in words, from status words as the families give them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.drive.profile.profile import Profile
from tui.drive.values import decode
from tui.session.drive import DriveSession
from tui.session.drive_state import channel_text, drive_state, with_direction
from tui.session.reading import Reading
from tui.session.shown import Quality

from .fakes import OneDrive, parameter, profile_of

CHART = {
    "id": "drivecom",
    "name": "Drivecom",
    "kind": "drivecom",
    "status": "ETA",
    "states": [
        {"id": "ready", "name": "Ready", "kind": "ready", "mask": 0x6F, "value": 0x21},
        {"id": "enabled", "name": "Enabled", "kind": "running", "mask": 0x6F, "value": 0x27},
        {"id": "fault", "name": "Fault", "kind": "fault", "mask": 0x4F, "value": 0x08},
    ],
    "direction": {"parameter": "ETA", "bit": 15},
    "reached": {"parameter": "ETA", "bit": 10},
}
IO_CHART = {
    "id": "io",
    "name": "I/O profile",
    "kind": "io",
    "when": {"parameter": "CHCF", "values": [3]},
    "status": "ETA",
    "states": [{"id": "run", "name": "Running", "kind": "running", "mask": 4, "value": 4}],
}


def drive(shows_last: bool = True) -> Profile:
    return profile_of(
        parameter("ETA", 3201, bits=[{"bit": 7, "name": "warning", "alarm": True}]),
        parameter("LFT", 7121),
        parameter("CHCF", 8401),
        charts=[CHART, IO_CHART],
        faults={
            "parameter": "LFT",
            "shows_last": shows_last,
            "codes": [{"raw": 18, "code": "ObF", "name": "Overbraking"}],
        },
    )


def readings(profile: Profile, quality: Quality = Quality.GOOD, **raws: int) -> dict[str, Reading]:
    return {
        code: Reading(p, raw, decode(p, raw, profile.names(p), None), quality, 0.0)
        for code, raw in raws.items()
        if (p := profile[code])
    }


@pytest.mark.parametrize(
    ("word", "headline", "reached"),
    [
        (0x0631, "ready", True),
        (0x0627, "running forward", True),
        (0x8237, "running reverse", False),
        (0x0000, "unknown state", False),
    ],
)
def test_status_word_has_its_headline(word: int, headline: str, reached: bool) -> None:
    state = drive_state(drive(), readings(drive(), ETA=word))
    assert (state.headline, state.reached) == (headline, reached)


def test_fault_has_its_name_and_number() -> None:
    state = drive_state(drive(), readings(drive(), ETA=0x0228, LFT=18))
    assert state.headline == "fault ObF"
    assert state.fault is not None
    assert state.fault.name == "Overbraking"


def test_unknown_fault_shows_its_number() -> None:
    state = drive_state(drive(), readings(drive(), ETA=0x0008, LFT=99))
    assert state.headline == "fault code 99"


def test_last_fault_of_a_running_drive_is_not_current() -> None:
    state = drive_state(drive(), readings(drive(), ETA=0x0027, LFT=18))
    assert (state.fault, state.fault_raw, state.kind) == (None, 18, "running")


def test_stale_words_give_no_state() -> None:
    state = drive_state(drive(), readings(drive(), Quality.STALE, ETA=0x0027))
    assert (state.kind, state.direction) == ("unknown", None)


def test_chart_follows_the_control_profile() -> None:
    state = drive_state(drive(), readings(drive(), ETA=0x0004, CHCF=3))
    assert state.id == "run"


def test_alarms_are_the_set_alarm_bits() -> None:
    state = drive_state(drive(), readings(drive(), ETA=0x00A1))
    assert [bit.name for bit in state.alarms] == ["warning"]


def test_channel_word_is_decoded_by_its_bits() -> None:
    bits = [{"bit": 0, "name": "terminals"}, {"bit": 3, "name": "Modbus"}]
    profile = profile_of(parameter("CCC", 8442, bits=bits))
    reading = readings(profile, CCC=8)["CCC"]
    assert reading.value is not None
    assert channel_text(profile["CCC"], reading.value) == "Modbus"


def test_values_without_the_status_word_give_no_state() -> None:
    assert drive_state(drive(), readings(drive(), LFT=18)).headline == ""


@pytest.mark.parametrize(
    ("motion", "may_have_stood", "stands"),
    [
        ("running", False, False),
        ("stopping", False, False),
        ("unknown", True, False),
        ("ready", True, True),
        ("fault", True, True),
    ],
)
def test_motor_that_runs_or_still_stops_does_not_stand(
    motion: str, may_have_stood: bool, stands: bool
) -> None:
    """The record of its start is kept until it is at standstill."""
    session = DriveSession(OneDrive({10: 1}), 1, profile_of(parameter("P10", 10)))
    reported: list[float] = []
    session.starts = cast(
        Any, SimpleNamespace(standing=lambda _session, time: reported.append(time))
    )
    session.rest_seen = 40.0
    session.note_state(motion, 50.0)
    assert session.rest_seen == (50.0 if may_have_stood else 40.0)
    assert reported == ([50.0] if stands else [])
    session.note_state("ready", 45.0)
    assert session.rest_seen == (50.0 if may_have_stood else 45.0), "never an earlier time"


@pytest.mark.parametrize(
    ("kind", "direction", "number"),
    [
        ("uint16", "reverse", -30.0), ("uint16", "forward", 30.0), ("uint16", None, 30.0),
        ("int16", "reverse", 30.0), ("int32", "reverse", 30.0),
    ],
)  # fmt: skip
def test_frequency_without_a_sign_gets_that_of_the_direction(
    kind: str, direction: str | None, number: float
) -> None:
    words = SimpleNamespace(type=kind)
    state = SimpleNamespace(direction=direction)
    assert with_direction(cast(Any, words), 30.0, cast(Any, state)) == number
    assert str(with_direction(cast(Any, words), 0.0, cast(Any, state))) == "0.0"


@pytest.mark.parametrize(
    ("charts", "mode", "active"),
    [
        ([IO_CHART, CHART], 3, "io"), ([IO_CHART, CHART], 1, "drivecom"),
        ([IO_CHART, CHART], None, "drivecom"), ([IO_CHART], None, "io"), ([IO_CHART], 1, "io"),
        ([], None, None),
    ],
)  # fmt: skip
def test_active_chart_is_the_one_whose_condition_holds_else_the_one_without(
    charts: list[dict[str, object]], mode: int | None, active: str | None
) -> None:
    profile = profile_of(parameter("ETA", 3201), parameter("CHCF", 8401), charts=charts)
    found = profile.chart({} if mode is None else {"CHCF": mode})
    assert (found.id if found else None) == active
