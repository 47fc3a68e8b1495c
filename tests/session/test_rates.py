"""The read rates of a monitor, the load of a motor, and onsets of faults, from small profiles."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.fake import FakeLine
from tui.drive.profile.profile import Profile
from tui.session.drive import DriveSession
from tui.session.monitor.alarms import FaultOnset, FaultOnsets
from tui.session.monitor.line_watch import share_of_limit, unread_limit
from tui.session.monitor.rates import Rates, bad_readings, monitoring_codes, rates_of
from tui.session.shown import Quality

from .fakes import parameter, profile_of

CHART = {
    "id": "drivecom",
    "name": "Drivecom",
    "kind": "drivecom",
    "status": "ETA",
    "states": [{"id": "run", "name": "Run", "kind": "running", "mask": 3, "value": 1}],
}
BY_MODE = {**CHART, "id": "io", "kind": "io", "when": {"parameter": "CHCF", "values": [3]}}


def drive(high: str = "") -> Profile:
    words = ("ETA", "LFT", "CHCF", "LCR", "RFR", "TUN", "NCR")
    current = {"quantity": "motor_current", "unit": "A", "scale": "0.1"}
    return profile_of(
        *(
            parameter(code, at, **(current if code == "LCR" else {}))
            for at, code in enumerate(words, 10)
        ),
        charts=[CHART, BY_MODE],
        faults={"parameter": "LFT", "codes": [{"raw": 18, "code": "ObF", "name": "Overbraking"}]},
        monitoring={
            "values": [
                {"parameter": "RFR"}, {"parameter": "LCR", "high": high},
                {"parameter": "TUN", "rate": "slow"},
            ]
        },
    )  # fmt: skip


def test_values_and_the_words_of_the_state_are_read_once_each_by_their_rate() -> None:
    profile = drive()
    assert monitoring_codes(profile) == ["RFR", "LCR", "TUN", "ETA", "CHCF", "LFT"]
    rates = rates_of(profile)
    assert (rates.fast, rates.changing, rates.slow) == (
        ("RFR", "LCR", "ETA", "LFT"), ("CHCF",), ("TUN",),
    )  # fmt: skip
    assert rates.key == ("ETA", "LFT")
    assert rates.seldom == ("CHCF", "TUN")


def test_values_of_a_screen_are_read_in_each_cycle_and_nowhere_twice() -> None:
    rates = Rates(("A",), ("B", "C"), ("D", "E"), ("A",))
    assert rates.with_fast(["A", "C", "E", "X", "X"]) == Rates(
        ("A", "C", "E", "X"), ("B",), ("D",), ("A",)
    )
    assert rates.with_fast([]) == rates


def test_each_value_of_a_failed_cycle_is_bad_with_the_reason() -> None:
    profile = drive()
    found = bad_readings(profile, rates_of(profile), 5.0, "no answer")
    assert list(found) == ["RFR", "LCR", "ETA", "LFT", "CHCF", "TUN"]
    assert {(each.quality, each.error, each.time) for each in found.values()} == {
        (Quality.BAD, "no answer", 5.0)
    }


@pytest.mark.parametrize(
    ("high", "unread", "share"),
    [("NCR", ["NCR"], 0.5), ("20", [], 0.25), ("", [], None), ("0", [], None)],
)
def test_load_is_the_current_as_a_share_of_its_limit(
    high: str, unread: list[str], share: float | None
) -> None:
    session = DriveSession(FakeLine({1: {}}), 1, drive(high))
    current = cast(Any, SimpleNamespace(number=5.0))
    assert unread_limit(session) == unread
    if unread:
        assert share_of_limit(session, current) is None, "its limit is not known yet"
    session.image.confirm("NCR", 10, 1.0)
    assert unread_limit(session) == []
    assert share_of_limit(session, current) == share
    assert share_of_limit(session, None) is None
    current.number = None
    assert share_of_limit(session, current) is None


def state(kind: str, code: str = "") -> Any:
    fault = SimpleNamespace(code=code) if code else None
    return SimpleNamespace(kind=kind, fault=fault)


@pytest.mark.parametrize(
    ("states", "onset"),
    [
        ([("fault", "A")], FaultOnset(1.0, False, "A")),
        ([("ready", ""), ("fault", "A")], FaultOnset(2.0, True, "A")),
        ([("unknown", ""), ("fault", "A")], FaultOnset(2.0, False, "A")),
        ([("ready", ""), ("fault", ""), ("fault", "A")], FaultOnset(2.0, True, "A")),
        ([("ready", ""), ("fault", "A"), ("fault", "")], FaultOnset(2.0, True, "A")),
        ([("ready", ""), ("fault", "A"), ("unknown", "")], FaultOnset(2.0, True, "A")),
        ([("fault", "A"), ("fault", "B")], FaultOnset(2.0, True, "B")),
        ([("fault", "A"), ("fault", "A")], FaultOnset(1.0, False, "A")),
        ([("fault", "A"), ("ready", "")], None),
        ([("fault", "A"), ("ready", ""), ("fault", "A")], FaultOnset(3.0, True, "A")),
    ],
)
def test_onset_of_a_fault_is_its_first_read_and_a_trip_if_the_drive_was_free(
    states: list[tuple[str, str]], onset: FaultOnset | None
) -> None:
    onsets = FaultOnsets()
    onsets.note(2, state("fault", "X"), 0.5)
    for at, (kind, code) in enumerate(states, 1):
        onsets.note(1, state(kind, code), float(at))
    assert onsets.by_device.get(1) == onset
    assert onsets.by_device[2] == FaultOnset(0.5, False, "X")
