"""Settings of a predecessor: what its table maps to a drive of the next family, and what not."""

from __future__ import annotations

import pytest

from tests.session.test_restoring import plan, values_of
from tui.drive.profile import library
from tui.drive.settings.restore_plan import NO_OPTIONS, Options, RestoreItem

NOW = {
    "Inr": 1, "ACC": 30, "dEC": 30, "HSP": 500, "LSP": 0, "tFr": 600, "UnS": 230, "nCr": 37,
    "Fr1": 1, "COd": 0, "rSC": 0, "ttO": 100, "Add": 1,
}  # fmt: skip
OLD = {
    "Inr": 1, "ACC": 55, "dEC": 30, "HSP": 450, "LSP": 0, "tFr": 600, "UnS": 400, "nCr": 41,
    "Fr1": 164, "COd": 1234, "rSC": 77, "ttO": 50, "Add": 9,
}  # fmt: skip


def items(options: Options = NO_OPTIONS) -> dict[str, RestoreItem]:
    """The plan for a set of an Altivar 31 and an Altivar 312, by code."""
    found = plan("atv312", NOW, values_of("atv31", OLD), options)
    assert found.across
    assert found.mapped_by
    return {item.code: item for item in found.items}


def test_settings_of_a_predecessor_are_mapped_by_code_and_value() -> None:
    found = items()
    written = {code: item.new for code, item in found.items() if item.kind == "write"}
    assert written == {"ACC": "5.5 s", "HSP": "45.0 Hz", "Fr1": "Modbus", "ttO": "5.0 s"}
    assert found["dEC"].kind == "equal"


def test_settings_that_are_not_mapped_have_a_reason() -> None:
    found = items()
    skipped = {code: item.reason for code, item in found.items() if item.kind == "skip"}
    assert skipped == {
        "atv31 COd": "no counterpart", "atv31 rSC": "no counterpart", "Add": "line",
        "UnS": "rating", "nCr": "rating",
    }  # fmt: skip
    assert "keypad" in found["atv31 COd"].text
    assert found["atv31 rSC"].new == "77"


def test_every_setting_of_the_set_is_in_the_plan() -> None:
    codes = {code.removeprefix("atv31 ") for code in items()}
    assert codes == set(OLD)


def test_motor_data_of_a_predecessor_are_written_by_option_only() -> None:
    found = items(Options(rating=True))
    assert {code: found[code].new for code in ("UnS", "nCr")} == {"UnS": "400 V", "nCr": "4.1 A"}


def test_ramp_of_a_predecessor_keeps_its_seconds_in_another_scale() -> None:
    old = values_of("atv31", {"ACC": 30})  # a drive without a ramp increment
    found = plan("atv312", {"Inr": 0, "ACC": 100}, old)
    assert [(edit.code, edit.new, edit.text) for edit in found.edits] == [("ACC", 300, "3.00 s")]


def test_table_is_not_used_in_the_other_direction() -> None:
    found = plan("atv31", NOW, values_of("atv312", OLD))
    assert not found.mapped_by
    assert {item.code: item.reason for item in found.items}["atv312 Fr1"] == "no counterpart"


@pytest.mark.parametrize("id_", [listing.id for listing in library.listings()])
def test_tables_of_predecessors_name_existing_settings(id_: str) -> None:
    for table in library.load(id_).data.predecessors:
        old = library.load(table.profile)
        assert all(old.get(code) is not None for code in (*table.codes, *table.unlike))
