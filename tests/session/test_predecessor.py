"""Settings of a predecessor: what its table maps to a drive of the next family, and what not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.session.test_restoring import plan, values_of
from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet, SetHead, dump_set
from tui.drive.settings.rating import rating_codes
from tui.drive.settings.replacement import changed_settings, factory_count, identity_lines
from tui.drive.settings.restore_plan import NO_OPTIONS, Options, RestoreItem
from tui.session.settings.predecessor import predecessor_set

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


def head(profile: str, reference: str, version: str = "2.1", device: int = 4) -> SetHead:
    identity = {key: text for key, text in (("reference", reference), ("version", version)) if text}
    return SetHead(profile, device=device, time="2026-11-20T10:00", identity=identity)


@pytest.mark.parametrize(
    ("now", "before", "rating"),
    [
        ("ATV312HU09M3", "ATV31HU09M3", "Rating: the same model."),
        ("ATV312HU09M3", "ATV31HU09M3S232", "Rating: the same model, another variant"),
        ("ATV312HU15M3", "ATV31HU09M3", "Rating: another model (HU09M3, now HU15M3)"),
        ("", "ATV31HU09M3", "Rating: not known. Compare the nameplates."),
    ],
)
def test_rating_is_compared_without_the_family(now: str, before: str, rating: str) -> None:
    source = ParameterSet(head("atv31", before), OLD)
    own, old = library.load("atv312"), library.load("atv31")
    lines = identity_lines(own, head("atv312", now), NOW, old, source)
    assert any(line.startswith(rating) for line in lines)
    assert lines[-1] == "Firmware: the same version."


def test_rating_of_one_family_is_compared_by_its_words() -> None:
    profile = library.load("atv312")
    (code,) = rating_codes(profile)
    source = ParameterSet(head("atv312", "", ""), {code: 37})
    for held, text in ((37, "the same model."), (41, "another model")):
        rating, firmware = identity_lines(
            profile, head("atv312", "", ""), {code: held}, profile, source
        )[2:]
        assert text in rating
        assert firmware == "Firmware: not known."


def test_factory_settings_are_counted_where_the_predecessor_had_others() -> None:
    own, old = library.load("atv312"), library.load("atv31")
    source = values_of("atv31", {**OLD, "SP2": 120, "SP3": 200, "dEC": 42})
    codes = changed_settings(own, old, source)
    assert {"ACC", "dEC", "SP2", "SP3"} <= set(codes)
    assert not {"COd", "UnS", "Add", "nCr"} & set(codes)
    new = factory_count(own, codes, {**NOW, "SP2": 100, "SP3": 150})
    assert new.looks_new
    used = factory_count(own, codes, {**NOW, **OLD, "SP2": 120, "SP3": 200, "dEC": 42})
    assert used.at_factory == 0
    assert not used.looks_new
    assert not factory_count(own, codes, {}).looks_new


@pytest.mark.parametrize(
    ("profile", "line", "device", "found"),
    [
        ("atv312", "tcp:192.168.0.10:502", 4, True),
        ("atv31", "tcp:192.168.0.10", 4, True),
        ("atv71", "tcp:192.168.0.10", 4, False),
        ("atv312", "tcp:192.168.0.11", 4, False),
        ("atv312", "tcp:192.168.0.10", 5, False),
    ],
)
def test_newest_backup_is_of_this_address(
    profile: str, line: str, device: int, found: bool, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    made = replace(head("atv31", "ATV31HU09M3"), line="tcp:192.168.0.10")
    text = dump_set(library.load("atv31"), ParameterSet(made, OLD))
    (tmp_path / "pump.toml").write_text(text, "utf-8")
    (tmp_path / "broken.toml").write_text("[set", "utf-8")
    assert (predecessor_set(library.load(profile), line, device) is not None) is found
