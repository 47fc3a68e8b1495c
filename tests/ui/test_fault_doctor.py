"""The Faults screen: causes, live values, checks, conditions of a reset, alarms."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.ui.fakes import NOW, readings_of
from tui.drive.hints import codes_to_read, reset_text
from tui.drive.profile import library
from tui.screens.faults.doctor import LABEL, _history, doctor_lines
from tui.screens.faults.doctor_view import DoctorView

from .test_frame import panel

ATV71 = library.load("atv71")


def view(raw: int | None, **more: object) -> DoctorView:
    fault = ATV71.fault(raw) if raw is not None else None
    made = DoctorView(profile=ATV71, fault=fault, present=True, record=None, readings={}, now=0.0)
    return replace(made, **more)  # type: ignore[arg-type]


def reported(shown: DoctorView, width: int = 80, height: int = 20) -> str:
    return "\n".join(line.plain.rstrip() for line in doctor_lines(shown, width, height))


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "atv71"])
def test_every_fault_fits_80_columns(family: str) -> None:
    profile = library.load(family)
    for fault in profile.data.faults.codes:
        help_ = profile.guide.fault(fault.raw)
        if help_ is None:
            continue
        shown = view(None, profile=profile, fault=fault)
        text = reported(shown, 80, 40)
        for part in (*help_.probable, *help_.check, *(look.why for look in help_.look_at)):
            assert part in text, (fault.code, part)
        assert "…" not in text.partition("Probably")[2], fault.code
        assert all(line.cell_len <= 80 for line in doctor_lines(shown, 80, 40))


def test_fault_without_a_number_is_named_before_its_causes() -> None:
    profile = library.load("powerdrive")
    (help_,) = profile.guide.data.faults
    text = reported(view(None, profile=profile, present=True), 120)
    first, second = text.partition("Probably")[2].splitlines()[:2]
    assert first.strip() == help_.name
    assert help_.probable[0] in second


def test_general_practice_is_marked() -> None:
    practice = reported(view(1))
    assert "practice" in practice.partition("Probably")[2].splitlines()[0]
    guide = reported(view(18))
    assert guide.partition("Probably")[2].splitlines()[0].endswith("guide")
    assert guide.partition("Check")[2].splitlines()[0].endswith("practice")
    assert guide.partition("Reset")[2].splitlines()[0].endswith("practice")


def test_drive_reports_if_a_reset_is_possible() -> None:
    for raw, output in ((0x0004, "x works now"), (0, "Not yet: the drive reports")):
        text = reported(view(9, readings=readings_of(ATV71, {"ETI": raw}, NOW)))
        assert output in text
        assert "practice" not in text.partition("Reset")[2].splitlines()[0]
    old = {
        code: reading.aged(NOW + 60, 6.0)
        for code, reading in readings_of(ATV71, {"ETI": 4}, NOW).items()
    }
    text = reported(view(9, readings=old)).replace(" practice", "")
    assert "x has no effect" in " ".join(text.split())


@pytest.mark.parametrize(("width", "height"), [(60, 16), (60, 12), (80, 20), (80, 12)])
@pytest.mark.parametrize("raw", [9, 18, 22])
def test_reset_text_is_never_cut_off(raw: int, width: int, height: int) -> None:
    for eti in (None, 0, 4):
        readings = {} if eti is None else readings_of(ATV71, {"ETI": eti}, NOW)
        shown = view(raw, readings=readings)
        text = reported(shown, width, height)
        whole = reset_text(shown.help, shown.ready, "x", shown.follows).text
        ends = " ".join(text.partition("Reset")[2].partition("History")[0].split())
        assert whole in ends.replace(" practice", ""), text
        assert len(text.splitlines()) <= height


def test_input_that_caused_the_trip_fits_80_columns() -> None:
    """'Logic input ...' and 16#000C did not show where to look."""
    external = next(f for f in ATV71.data.faults.codes if f.code == "EPF1")
    read = readings_of(ATV71, {"ETF": 132, "LET": 1, "IL1R": 0x000C, "EPL": 1}, NOW)
    text = reported(view(external.raw, readings=read))
    assert "ETF    Logic input LI4 input or bit that trips it      Enter open" in text
    assert "IL1R   LI3, LI4        present state of the inputs" in text
    still = reported(view(external.raw, readings=readings_of(ATV71, {"IL1R": 0}, NOW)))
    assert "IL1R   none " in still


def test_alarm_has_causes_and_parameters() -> None:
    text = reported(view(None, present=False, alarms=[("LRS6", 8, "Undervoltage alarm")]))
    for part in ("UNDERVOLTAGE ALARM", "alarm, no fault", "Mains low or a dip", "ULN", "practice"):
        assert part in text
    assert "Reset" not in text
    both = view(18, alarms=[("LRS6", 8, "Undervoltage alarm")])
    assert "OVERBRAKING" in reported(both)
    assert "UNDERVOLTAGE" not in reported(both)


def test_unreadable_help_file_is_reported() -> None:
    profile = library.load_file(library.packaged_folder() / "atv71.toml")
    profile.guide.__dict__["_found"] = ({}, {})
    profile.guide.trouble = "mine.toml:3: there is no such fault."
    assert "mine.toml:3" in reported(view(18, profile=profile))


async def test_live_value_follows_the_drive() -> None:
    async with panel() as made:
        made.simulation.drive(1).provoke("ObF")
        await made.on("5")
        await made.until(lambda: "works now" in made.shown("doctor"))
        made.simulation.drive(1).set("DEC", 123)
        await made.until(lambda: "12.3 s" in made.shown("doctor"), 60.0)


@pytest.mark.sweep
async def test_key_line_stays_at_the_bottom() -> None:
    async with panel() as made:
        await made.on("5")
        await made.until(lambda: "No fault." in made.shown("doctor"))
        keys = made.app.screen.query_one("#keys").region
        assert keys.y == made.app.size.height - 1


def test_drive_without_a_fault_shows_no_causes() -> None:
    text = reported(view(None, present=False))
    assert "No fault." in text
    assert "Probably" not in text


def test_family_without_a_history_reads_none() -> None:
    profile = library.load("powerdrive")
    text = reported(view(None, profile=profile, present=False, unread=True))
    assert "not known on this drive" in text
    assert "reading the history" not in text


@pytest.mark.parametrize("family", ["atv31", "atv312"])
def test_earlier_fault_is_not_shown_as_the_last(family: str) -> None:
    profile = library.load(family)
    raws = {"LFt": 18, "DP1": 9, "DP2": 5}
    shown = view(None, profile=profile, present=False, readings=readings_of(profile, raws, NOW))
    rows = reported(shown).partition("History")[2].splitlines()
    last, second, third = (profile.fault(raw) for raw in raws.values())
    for row, number, fault in zip(rows, ("last", "2", "3"), (last, second, third), strict=False):
        assert fault is not None
        assert row.split()[:2] == [number, fault.code]
    assert profile.data.faults.stored[0] == [], "EP1 belongs to fault n-1"


BRAKING = {"BRA": 1, "VCAL": 4, "ULP0": 2280, "DEC": 30}


def test_advice_excluded_by_a_value_is_not_shown() -> None:
    fault = readings_of(ATV71, BRAKING, NOW)
    text = reported(view(18, readings=fault), 100, 30)
    assert "(ruled out, BRA Yes) No resistor: set BRA on" in text
    assert "(ruled out, ULN 228.0 V (170 to 240 V) at the trip) Mains voltage already high" in text
    assert text.index("The load drives the motor") < text.index("Mains voltage already high")
    open_ = reported(
        view(18, readings=readings_of(ATV71, {**BRAKING, "BRA": 0, "ULP0": 2580}, NOW))
    )
    assert "ruled out" not in open_
    assert "No resistor: set BRA on" in open_


def test_unknown_value_or_older_fault_excludes_nothing() -> None:
    assert "ruled out" not in reported(view(18))
    without_range = {code: raw for code, raw in BRAKING.items() if code not in ("VCAL", "BRA")}
    assert "ruled out" not in reported(view(18, readings=readings_of(ATV71, without_range, NOW)))
    older = view(18, present=False, readings=readings_of(ATV71, BRAKING, NOW))
    assert "at the trip" not in reported(older, 100, 30)
    assert "BRA Yes)" in reported(older, 100, 30)


def test_current_value_does_not_exclude_a_past_cause() -> None:
    profile = library.load("atv312")
    now = readings_of(profile, {"ULn": 2280, "VCAL": 2}, NOW)
    text = reported(view(None, profile=profile, fault=profile.fault(18), readings=now), 100, 30)
    assert "(not now, ULn 228.0 V (170 to 240 V)) Mains voltage already high" in text


def test_promoted_cause_is_not_shown_as_certain() -> None:
    readings = readings_of(ATV71, {"VCAL": 4, "ULP0": 2280}, NOW)
    text = reported(view(19, readings=readings), 100, 30)
    assert text.partition("Probably")[2].splitlines()[0].endswith("practice")


def test_values_that_exclude_advice_are_read_with_the_fault() -> None:
    help_ = ATV71.guide.fault(18)
    assert {"BRA", "ULP0", "VCAL"} <= set(codes_to_read(ATV71, help_))


@pytest.mark.parametrize("height", range(1, 12))
@pytest.mark.parametrize("cursor", range(-1, 8))
def test_history_shows_as_many_faults_as_fit_and_the_one_under_the_cursor(
    cursor: int, height: int
) -> None:
    profile = library.load("atv71")
    raws = {code: 3 + number for number, code in enumerate(profile.data.faults.history)}
    shown = view(None, profile=profile, present=False, readings=readings_of(profile, raws, NOW))
    shown = replace(shown, at=len(shown.look_at) + cursor)
    count = len(shown.history)
    lines = [line.plain for line in _history(shown, 80, height)]
    numbers = [line[LABEL:].split()[0].replace("last", "1") for line in lines]
    first = int(numbers[0])
    assert list(map(int, numbers)) == list(range(first, first + min(height, count)))
    if cursor < count:
        assert cursor < 0 or str(cursor + 1) in numbers
        assert first == max(1, cursor + 2 - height), "no further than the cursor needs"
    assert lines[0].split()[0] == "History"
    assert all(not line[:LABEL].strip() for line in lines[1:])
