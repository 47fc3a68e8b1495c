"""The Faults screen as a doctor: causes, live values, checks, what a reset needs, alarms."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.ui.fakes import NOW, readings_of
from tui.drive.hints import reset_text
from tui.drive.profile import library
from tui.screens.faults.doctor import doctor_lines
from tui.screens.faults.doctor_view import DoctorView

from .test_frame import panel

ATV71 = library.load("atv71")


def view(raw: int | None, **more: object) -> DoctorView:
    fault = ATV71.fault(raw) if raw is not None else None
    made = DoctorView(profile=ATV71, fault=fault, present=True, record=None, readings={})
    return replace(made, **more)  # type: ignore[arg-type]


def told(shown: DoctorView, width: int = 80, height: int = 20) -> str:
    return "\n".join(line.plain.rstrip() for line in doctor_lines(shown, width, height))


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "atv71"])
def test_every_fault_is_told_without_a_cut_at_80_columns(family: str) -> None:
    profile = library.load(family)
    for fault in profile.data.faults.codes:
        help_ = profile.guide.fault(fault.raw)
        if help_ is None:
            continue
        shown = view(None, profile=profile, fault=fault)
        text = told(shown, 80, 40)
        for part in (*help_.probable, *help_.check, *(look.why for look in help_.look_at)):
            assert part in text, (fault.code, part)
        assert "…" not in text.partition("Probably")[2], fault.code
        assert all(line.cell_len <= 80 for line in doctor_lines(shown, 80, 40))


def test_general_practice_is_said_to_be_so() -> None:
    practice = told(view(1))
    assert "practice" in practice.partition("Probably")[2].splitlines()[0]
    guide = told(view(18))
    assert guide.partition("Probably")[2].splitlines()[0].endswith("guide")
    assert guide.partition("Check")[2].splitlines()[0].endswith("practice")
    assert guide.partition("Reset")[2].splitlines()[0].endswith("practice")


def test_the_drive_says_whether_a_reset_works() -> None:
    for raw, said in ((0x0004, "x works now"), (0, "not yet, says the drive")):
        text = told(view(9, readings=readings_of(ATV71, {"ETI": raw}, NOW)))
        assert said in text
        assert "practice" not in text.partition("Reset")[2].splitlines()[0]
    old = {
        code: reading.aged(NOW + 60, 6.0)
        for code, reading in readings_of(ATV71, {"ETI": 4}, NOW).items()
    }
    assert "x does nothing" in told(view(9, readings=old))


@pytest.mark.parametrize(("width", "height"), [(60, 16), (40, 12), (80, 20), (60, 8)])
@pytest.mark.parametrize("raw", [9, 18, 22])
def test_how_it_ends_is_never_cut_off(raw: int, width: int, height: int) -> None:
    for eti in (None, 0, 4):
        readings = {} if eti is None else readings_of(ATV71, {"ETI": eti}, NOW)
        shown = view(raw, readings=readings)
        text = told(shown, width, height)
        whole = reset_text(shown.help, shown.ready, "x").text
        ends = " ".join(text.partition("Reset")[2].partition("History")[0].split())
        assert whole in ends.replace(" practice", ""), text
        assert len(text.splitlines()) <= height


def test_which_input_tripped_it_is_told_at_80_columns() -> None:
    """'Logic input ...' and 16#000C told nobody where to look."""
    external = next(f for f in ATV71.data.faults.codes if f.code == "EPF1")
    read = readings_of(ATV71, {"ETF": 132, "LET": 1, "IL1R": 0x000C, "EPL": 1}, NOW)
    text = told(view(external.raw, readings=read))
    assert "ETF    Logic input LI4 input or bit that trips it     Enter opens" in text
    assert "IL1R   LI3, LI4        state of the inputs now" in text
    still = told(view(external.raw, readings=readings_of(ATV71, {"IL1R": 0}, NOW)))
    assert "IL1R   none " in still


def test_an_alarm_points_at_something_too() -> None:
    text = told(view(None, present=False, alarms=[("LRS6", 8, "Undervoltage alarm")]))
    for part in ("UNDERVOLTAGE ALARM", "alarm, no fault", "Mains low or a dip", "ULN", "practice"):
        assert part in text
    assert "Reset" not in text
    both = view(18, alarms=[("LRS6", 8, "Undervoltage alarm")])
    assert "OVERBRAKING" in told(both)
    assert "UNDERVOLTAGE" not in told(both)


def test_a_help_file_that_cannot_be_read_is_told() -> None:
    profile = library.load_file(library.packaged_folder() / "atv71.toml")
    profile.guide.__dict__["_found"] = ({}, {})
    profile.guide.trouble = "mine.toml:3: there is no such fault."
    assert "mine.toml:3" in told(view(18, profile=profile))


async def test_a_live_value_follows_the_drive() -> None:
    async with panel() as made:
        made.simulation.drive(1).provoke("ObF")
        await made.on("5")
        await made.until(lambda: "works now" in made.shown("doctor"))
        made.simulation.drive(1).set("DEC", 123)
        await made.until(lambda: "12.3 s" in made.shown("doctor"), 60.0)


async def test_the_line_of_keys_stays_at_the_foot() -> None:
    async with panel() as made:
        await made.on("5")
        await made.until(lambda: "No fault now" in made.shown("doctor"))
        keys = made.app.screen.query_one("#keys").region
        assert keys.y == made.app.size.height - 1


def test_nothing_is_told_of_no_fault() -> None:
    text = told(view(None, present=False))
    assert "No fault now" in text
    assert "Probably" not in text


def test_no_history_is_read_where_a_family_has_none() -> None:
    profile = library.load("powerdrive")
    text = told(view(None, profile=profile, present=False, unread=True))
    assert "not known on this drive" in text
    assert "reading the history" not in text
