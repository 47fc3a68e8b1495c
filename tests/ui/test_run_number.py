"""The run line: its input, its text, and when Enter counts."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.mixer import HERTZ, PERCENT, PERCENT_OF_FULL, SCALE_BY, SPEED, installed_mixer
from tui.drive.profile import library
from tui.screens.monitor.run_line import (
    DIGITS_MOST,
    STEPS,
    Purpose,
    RunLine,
    limits,
    proposed,
    run_lines,
)

from . import fakes

LINE = RunLine("forward", "30.0", "Hz", 100.0, 0)


def typed(line: RunLine, text: str) -> RunLine | None:
    for character in text:
        found = line.typed(character)
        if found is None:
            return None
        line = found
    return line


@pytest.mark.parametrize(
    ("text", "stands"),
    [("2", "2"), ("45", "45"), ("7.5", "7.5"), ("7,5", "7.5"), (".5", "0.5"), ("1..5", "1.5")],
)
def test_first_digit_replaces_the_suggestion(text: str, stands: str) -> None:
    found = typed(LINE, text)
    assert found is not None
    assert found.text == stands
    assert found.reference == f"{stands}Hz"


@pytest.mark.parametrize("character", ["a", " ", "-", "\r", "²", "٣", "h"])
def test_keys_not_in_a_number_close_the_run_line(character: str) -> None:
    assert LINE.typed(character) is None


def test_backspace_clears_the_suggestion_or_one_typed_digit() -> None:
    assert LINE.erased().text == ""
    found = typed(LINE, "45")
    assert found is not None
    assert found.erased().text == "4"


@pytest.mark.parametrize(
    ("key", "ends"), [("up", "31.0"), ("down", "29.0"), ("pageup", "35.0"), ("pagedown", "25.0")]
)
def test_arrows_step_within_the_limits(key: str, ends: str) -> None:
    assert LINE.stepped(key, None, None).text == ends
    line = LINE
    for _ in range(40):
        line = line.stepped(key, Decimal(10), Decimal(50))
    assert Decimal(line.text) == (Decimal(50) if STEPS[key] > 0 else Decimal(10))


@given(st.text(alphabet="0123456789.,", max_size=30))
def test_typed_number_is_short_and_has_one_point(text: str) -> None:
    found = typed(LINE, text)
    assert found is not None
    assert len(found.text) <= DIGITS_MOST
    assert found.text.count(".") <= 1


def test_reference_beyond_the_limit_is_reported_and_not_given() -> None:
    profile = library.load("atv71")
    readings = fakes.readings_of(profile, {"HSP": 500, "LSP": 0, "TFR": 600}, fakes.NOW)
    wrong = RunLine("forward", "60", "Hz", 0.0, 0).checked(profile, readings)
    assert "above HSP = 50.0 Hz" in wrong.fault
    right = RunLine("forward", "45", "Hz", 0.0, 0).checked(profile, readings)
    assert right.fault == ""
    empty = RunLine("forward", "", "Hz", 0.0, 0).checked(profile, readings)
    assert empty.fault == "Type a reference, then Enter."


def test_suggestion_is_the_last_reference_else_that_of_the_drive() -> None:
    profile = library.load("atv71")
    assert proposed(profile, "37.5 Hz", {}) == ("37.5", "Hz")
    assert proposed(profile, "", {"LFR": 200}) == ("20.0", "Hz")
    assert proposed(profile, "", {}) == ("0", "Hz")


@pytest.mark.parametrize(
    ("reference", "raws", "unit", "text", "steps_to", "around"),
    [
        (HERTZ, {"REF": 200}, "Hz", "20.0", "21.0", "0 .. HIGH 60.0"),
        (PERCENT_OF_FULL, {"REF": 400}, "%", "40.0", "41.0", "0 .. HIGH 120"),
        (PERCENT, {"REF": 400}, "%", "40.0", "41.0", "%"),
        (SPEED, {"REF": 900}, "rpm", "900", "910", "0 .. HIGH 1800.0"),
        (SCALE_BY, {"REF": 200, "MODE": 0}, "Hz", "2.00", "3.00", "0 .. HIGH 60.0"),
        (SCALE_BY, {"REF": 200}, "Hz", "0", "1", "Hz"),
    ],
)
def test_run_line_has_the_unit_and_the_scale_of_the_reference(
    reference: str, raws: dict[str, int], unit: str, text: str, steps_to: str, around: str
) -> None:
    profile = installed_mixer(reference)
    assert proposed(profile, "", raws) == (text, unit)
    line = RunLine("forward", text, unit, 0.0, 0)
    plate = {"HIGH": 600, "LOW": 0, "FULL": 500, "FNOM": 500, "NNOM": 1450}
    readings = fakes.readings_of(profile, raws | plate, fakes.NOW)
    low, high, _ = limits(profile, readings)
    stepped = line.stepped("up", low, high)
    assert (stepped.text, stepped.reference) == (steps_to, f"{steps_to}{unit}")
    assert around in run_lines(line, profile, readings, 200.0, 80)[1].plain
    fault = stepped.checked(profile, readings).fault
    assert ("MODE" in fault) == (reference == SCALE_BY and "MODE" not in raws), fault


@pytest.mark.parametrize("width", [80, 120])
def test_run_line_says_what_will_happen_and_fits(width: int) -> None:
    profile = library.load("atv71")
    raws = {"HSP": 500, "LSP": 0, "TFR": 600, "ACC": 30, "INR": 1, "FRS": 500}
    readings = fakes.readings_of(profile, raws, fakes.NOW)
    reported, first, second = run_lines(LINE, profile, readings, 200.0, width, output=Decimal(0))
    assert not reported.plain.strip()
    assert "RUN FORWARD at" in first.plain
    assert "30.0  Hz" in first.plain
    assert "0 .. HSP 50.0" in first.plain
    assert "ramp 3.0 s" in first.plain
    assert "reached in 1.8 s" in first.plain
    assert second.plain.split()[:2] == ["Enter", "run"]
    assert "Space stop" in second.plain
    assert max(len(first.plain), len(second.plain)) <= width


@pytest.mark.parametrize(
    ("purpose", "output", "seconds"),
    [
        ("forward", "0", "reached in 1.8 s"),
        ("forward", "30.0", "reached in 0.0 s"),
        ("forward", "40.0", "reached in 1.0 s"),
        ("forward", "-10.0", "reached in 2.8 s"),
        ("reverse", "35.0", "reached in 5.3 s"),
        ("forward", None, ""),
    ],
)
def test_ramp_time_starts_at_the_current_speed(
    purpose: Purpose, output: str | None, seconds: str
) -> None:
    """30 Hz at 3 s up and 5 s down for 50 Hz."""
    profile = library.load("atv71")
    raws = {"HSP": 500, "TFR": 600, "ACC": 30, "DEC": 50, "INR": 1, "FRS": 500}
    readings = fakes.readings_of(profile, raws, fakes.NOW)
    line = RunLine(purpose, "30.0", "Hz", 0.0, 0)
    now = None if output is None else Decimal(output)
    _, first, _ = run_lines(line, profile, readings, 200.0, 80, output=now)
    assert seconds in first.plain
    assert ("reached in" in first.plain) is bool(seconds)
