"""Limits in force, the order of a list, and edits that depend on a refused edit."""

from __future__ import annotations

import pytest

from tui.drive.profile import library
from tui.drive.settings.edits import Edits
from tui.drive.settings.in_force import limit_passed, limits_in_force
from tui.drive.settings.limits import builds_on, edit_problems
from tui.drive.settings.selection import (
    Choice,
    FilterContext,
    chosen_codes,
    group_order,
    home_group,
    rows,
)

ATV71 = library.load("atv71")
HELD = {"TFR": 600, "HSP": 500, "LSP": 0, "INR": 1, "ACC": 30, "BFR": 0, "TTO": 100}


@pytest.mark.parametrize(
    ("code", "text"),
    [
        # that they limit each other is known of the sister families
        ("HSP", "0.0 .. 60.0 Hz ? (TFR)"),
        ("LSP", "0.0 .. 50.0 Hz ? (HSP)"),
        ("TFR", "50.0 (HSP) .. 1600.0 Hz"),
        ("TTO", "0.1 .. 30.0 s"),
    ],
)
def test_limit_that_another_parameter_sets_is_named(code: str, text: str) -> None:
    limits = limits_in_force(ATV71, ATV71[code], HELD)
    assert limits is not None
    assert limits.text == text


def test_own_limit_applies_if_the_other_is_wider_or_unknown() -> None:
    assert "1600.0 Hz" in getattr(limits_in_force(ATV71, ATV71["HSP"], {"LSP": 0}), "text", "")
    wide = limits_in_force(ATV71, ATV71["HSP"], {**HELD, "TFR": 30000})
    assert wide is not None
    assert wide.high_by == ""


def test_limit_by_a_multiple_counts_if_either_parameter_is_edited() -> None:
    held = {**HELD, "TA1": 10, "TA2": 80}
    assert edit_problems(ATV71, Edits().stage(ATV71, "TA1", "15", held), held) == {}
    for code, value in (("TA1", "30"), ("TA2", "95")):
        problems = edit_problems(ATV71, Edits().stage(ATV71, code, value, held), held)
        assert list(problems) == [code]
        assert "TA2 = " in problems[code]
    past = {**held, "TA1": 30}
    assert edit_problems(ATV71, Edits().stage(ATV71, "ACC", "4", past), past) == {}


def test_non_numeric_parameter_has_no_limits() -> None:
    assert limits_in_force(ATV71, ATV71["STT"], HELD) is None
    assert limits_in_force(ATV71, ATV71["RFR"], HELD) is None
    assert limits_in_force(ATV71, ATV71["ACC"], {}) is None  # its scale is not known


def test_edit_beyond_a_limit_names_it_and_staged_limits_apply() -> None:
    empty = Edits()
    past = empty.stage(ATV71, "HSP", "70", HELD)
    assert "above TFR = 60.0 Hz" in limit_passed(ATV71, empty, past, HELD)
    raised = empty.stage(ATV71, "TFR", "80", HELD)
    within = raised.stage(ATV71, "HSP", "70", HELD)
    assert limit_passed(ATV71, raised, within, HELD) == ""


def test_exact_code_comes_first_and_settings_before_readings() -> None:
    facts = FilterContext(ATV71)
    assert rows(facts, "all", "hsp")[0] == "HSP"
    assert rows(facts, "all", "acc")[0] == "ACC"
    ramp = rows(facts, "all", "ramp")
    assert ramp.index("INR") < ramp.index("FRH")


def test_groups_with_settings_come_before_those_that_are_only_read() -> None:
    order = group_order(ATV71)
    assert sorted(order) == sorted(ATV71.groups)
    assert order.index("Settings") < order.index("Monitoring")
    assert home_group(ATV71) == "Settings"
    shown = chosen_codes(FilterContext(ATV71), Choice(group="Settings"))
    assert "ACC" in shown
    assert all(ATV71[code].group == "Settings" for code in shown)


def staged(**typed: str) -> Edits:
    edits = Edits()
    for code, text in typed.items():
        edits = edits.stage(ATV71, code, text, HELD)
    return edits


@pytest.mark.parametrize(
    ("code", "missed", "base"),
    [
        ("HSP", ["TFR"], "TFR"),  # 75 Hz above the 60 Hz that stay
        ("LSP", ["TFR"], ""),
        ("LSP", ["HSP"], ""),  # 10 Hz are below the 50 Hz that stay
        ("ACC", ["INR"], "INR"),
        ("ACC", ["TFR"], ""),
        ("ACC", ["BFR"], "BFR"),  # it would have changed other settings
        ("ACC", [], ""),
    ],
)
def test_edits_that_depend_on_a_failed_edit_are_found(
    code: str, missed: list[str], base: str
) -> None:
    edits = staged(TFR="80", HSP="75", LSP="10", INR="16#0000", ACC="4.55 s", BFR="16#0001")
    edit = edits.get(code)
    assert edit is not None
    assert builds_on(ATV71, edit, missed, edits, HELD) == base
