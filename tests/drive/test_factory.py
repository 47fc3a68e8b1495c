"""Factory settings, and limits that follow another parameter, with their confidence.

The figures are from the makers' lists: 1.5 times a rated current of 4.8 A is raw 72, 0.2 times it
raw 9, rounded down.
"""

from __future__ import annotations

import pytest

from tui.drive.profile import library
from tui.drive.settings.compare import compare_settings, factory_side, side_of
from tui.drive.settings.edits import Edits
from tui.drive.settings.factory import factory_is_sure, factory_raw, factory_value, not_factory
from tui.drive.settings.in_force import limits_in_force
from tui.drive.settings.limits import builds_on, edit_problems, limit_sources
from tui.drive.settings.parameter_set import ParameterSet, SetHead
from tui.drive.settings.selection import FilterContext, rows, start_up_codes
from tui.drive.settings.write_sequence import ordered

ATV31 = library.load("atv31")
ATV71 = library.load("atv71")
ALTIVARS = ("atv31", "atv312", "atv71")
FAMILIES = (*ALTIVARS, "atv21", "powerdrive", "proxidrive", "varmeca")


@pytest.mark.parametrize(
    ("code", "at_50", "at_60"),
    [("HSP", 500, 600), ("tFr", 600, 720), ("FrS", 500, 600), ("Ftd", 500, 600)],
)
def test_factory_setting_follows_the_mains_standard(code: str, at_50: int, at_60: int) -> None:
    setting = ATV31[code]
    assert factory_raw(ATV31, setting, {"bFr": 0}) == at_50
    assert factory_raw(ATV31, setting, {"bFr": 1}) == at_60
    assert factory_raw(ATV31, setting, {}) is None
    assert not not_factory(ATV31, setting, {"bFr": 1, code: at_60})
    assert not_factory(ATV31, setting, {"bFr": 1, code: at_50})
    assert not not_factory(ATV31, setting, {code: at_50 + 1}), "nobody knows while bFr is not read"


def test_factory_setting_follows_the_rated_current() -> None:
    raws = {"INV": 48}
    assert factory_raw(ATV31, ATV31["CLI"], raws) == 72
    assert factory_raw(ATV31, ATV31["IdC"], raws) == 33  # 33.6
    assert factory_raw(ATV31, ATV31["CLI"], {}) is None
    # a drive that rounds its product the other way has changed nothing
    assert not not_factory(ATV31, ATV31["IdC"], {**raws, "IdC": 34})
    assert not_factory(ATV31, ATV31["IdC"], {**raws, "IdC": 35})


def test_factory_ramp_uses_the_factory_scale() -> None:
    acc = ATV31["ACC"]
    fine = {"Inr": 0}  # 0.01 s a count now
    value = factory_value(ATV31, acc, fine)
    assert value is not None
    assert value.display == "3.0 s"
    assert not not_factory(ATV31, acc, {**fine, "ACC": 300})
    assert not_factory(ATV31, acc, {**fine, "ACC": 30}), "0.30 s is not 3.0 s"
    assert not not_factory(ATV31, acc, {"ACC": 31}), "its scale is not known"


def test_value_set_by_the_drive_is_not_a_foreign_change() -> None:
    assert not not_factory(ATV31, ATV31["tUn"], {"tUn": 113})
    assert not not_factory(ATV71, ATV71["TUN"], {"TUN": 2})


def test_factory_setting_from_a_sister_family_keeps_its_mark() -> None:
    assert factory_is_sure(ATV31["HSP"])
    assert not factory_is_sure(ATV71["HSP"])
    assert factory_is_sure(ATV71["TFR"])
    assert not factory_is_sure(library.load("atv21")["FH"])
    drive = ParameterSet(SetHead("atv71"), {"BFR": 0, "HSP": 450, "TFR": 500})
    compared = compare_settings(ATV71, factory_side(ATV71, drive), side_of("now", drive))
    reported = {row.code: (row.a, row.note) for row in compared}
    assert reported["HSP"] == ("50.0 Hz ?", "factory setting unverified")
    assert reported["TFR"] == ("60.0 Hz", "")


def test_drive_at_60_hertz_is_compared_with_its_own_factory_settings() -> None:
    drive = ParameterSet(SetHead("atv31"), {"bFr": 1, "HSP": 600, "INV": 48, "CLI": 72, "tUn": 113})
    compared = compare_settings(ATV31, factory_side(ATV31, drive), side_of("now", drive))
    assert [row.code for row in compared] == ["bFr"]


@pytest.mark.parametrize(
    ("code", "typed", "reported"),
    [
        ("ItH", "0.8 A", "below 0.9 A (0.2 x INV)"),
        ("ItH", "7.3 A", "above 7.2 A (1.5 x INV)"),
        ("tA2", "91 %", "above 90 % (100 - tA1)"),
        ("HSP", "61 Hz", "above tFr = 60.0 Hz"),
        ("LSP", "51 Hz", "above HSP = 50.0 Hz"),
    ],
)
def test_value_beyond_a_limit_of_another_parameter_is_refused(
    code: str, typed: str, reported: str
) -> None:
    held = {"INV": 48, "ItH": 48, "tA1": 10, "tA2": 10, "HSP": 500, "LSP": 0, "tFr": 600}
    edits = Edits().stage(ATV31, code, typed, held)
    assert reported in edit_problems(ATV31, edits, held)[code]


@pytest.mark.parametrize("typed", ["0.9 A", "7.2 A"])
def test_value_at_the_limit_is_accepted(typed: str) -> None:
    held = {"INV": 48, "ItH": 48}
    assert edit_problems(ATV31, Edits().stage(ATV31, "ItH", typed, held), held) == {}


def test_limit_from_a_sister_family_is_marked() -> None:
    held = {"INV": 48, "ITH": 48}
    edits = Edits().stage(ATV71, "ITH", "0.5 A", held)
    assert "no document of this family states" in edit_problems(ATV71, edits, held)["ITH"]
    limits = limits_in_force(ATV71, ATV71["ITH"], held)
    assert limits is not None
    assert limits.text == "0.9 .. 7.2 A ? (INV)"
    own = limits_in_force(ATV31, ATV31["ItH"], {"INV": 48})
    assert own is not None
    assert own.text == "0.9 .. 7.2 A (INV)"


def test_limit_source_is_read_before_a_write() -> None:
    assert limit_sources(ATV31, ["ItH"]) == {"INV"}
    assert limit_sources(ATV31, ["tA1"]) == {"tA2"}
    assert limit_sources(ATV31, ["HSP"]) == {"LSP", "tFr"}


def test_values_with_a_common_sum_are_written_decreasing_first() -> None:
    held = {"tA1": 10, "tA2": 90}
    edits = Edits().stage(ATV31, "tA1", "60", held).stage(ATV31, "tA2", "40", held)
    assert [edit.code for edit in ordered(ATV31, edits, held)] == ["tA2", "tA1"]
    other = {"tA1": 60, "tA2": 40}
    back = Edits().stage(ATV31, "tA2", "90", other).stage(ATV31, "tA1", "10", other)
    assert [edit.code for edit in ordered(ATV31, back, other)] == ["tA1", "tA2"]
    edit = back.get("tA2")
    assert edit is not None
    assert builds_on(ATV31, edit, ["tA1"], back, other) == "tA1"


@pytest.mark.parametrize("family", FAMILIES)
def test_start_up_keeps_the_order_of_its_steps(family: str) -> None:
    profile = library.load(family)
    codes = start_up_codes(profile)
    assert rows(FilterContext(profile), "start-up") == codes
    assert len(codes) == len(set(codes)) > 8
    assert all(profile.get(code) is not None for code in codes)


def test_start_up_begins_with_settings_that_change_others() -> None:
    codes = start_up_codes(ATV31)
    assert codes[:4] == ["bFr", "UnS", "FrS", "nCr"]
    assert codes.index("tFr") < codes.index("LSP") < codes.index("HSP") < codes.index("ACC")
    assert start_up_codes(ATV71)[:3] == ["TCC", "CFG", "CCFG"]
    sure = {step.confidence for step in ATV31.data.start_up}
    assert sure == {"public", "analogy", "practice"}
    assert "public" not in {s.confidence for s in ATV71.data.start_up if s.step == "Nameplate"}


FACTORY = [
    # family, code, raw factory setting
    ("atv31", "rrS", 130), ("atv312", "ttO", 100), ("atv71", "ACC", 30), ("atv71", "FTD", 500),
    ("atv71", "RFC", 96), ("atv31", "SLL", 1), ("atv312", "SP2", 100), ("atv312", "tFr", 600),
]  # fmt: skip


@pytest.mark.parametrize(("family", "code", "raw"), FACTORY)
def test_factory_settings_are_those_of_the_manual(family: str, code: str, raw: int) -> None:
    assert library.load(family)[code].factory == raw
