"""Staged edits: typed values become values of the drive, in an order that it accepts."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.drive.errors import UnknownParameter, ValueRefused
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.settings.edits import Edit, Edits, command_settings, consequences
from tui.drive.settings.limits import edit_problems, limit_pairs
from tui.drive.settings.writable import cuts_line
from tui.drive.settings.write_sequence import ordered
from tui.drive.shown import shown

ATV71, ATV31, ATV312, ATV21 = (library.load(p) for p in ("atv71", "atv31", "atv312", "atv21"))
HELD = {"ACC": 30, "DEC": 30, "INR": 1, "HSP": 500, "LSP": 0, "TFR": 600, "AC2": 50, "DE2": 50}


def test_typed_value_is_staged_and_rounding_reported() -> None:
    edits = Edits().stage(ATV71, "ACC", "3.14 s", HELD)
    (edit,) = edits
    assert (edit.old, edit.new, edit.old_text, edit.text) == (30, 31, "3.0 s", "3.1 s")
    assert edit.rounded
    assert edit.remark == "ACC: 3.14 s is rounded to 3.1 s."
    assert edits.after(HELD)["ACC"] == 31
    assert HELD["ACC"] == 30


def test_typing_the_current_value_removes_the_edit() -> None:
    edits = Edits().stage(ATV71, "ACC", "5", HELD)
    assert len(edits) == 1
    assert len(edits.stage(ATV71, "ACC", "3.0", HELD)) == 0


@pytest.mark.parametrize("typed", ["soon", "-1", "100000", ""])
def test_impossible_value_is_not_staged(typed: str) -> None:
    edits = Edits().stage(ATV71, "DEC", "7", HELD)
    with pytest.raises(ValueRefused):
        edits.stage(ATV71, "ACC", typed or "?", HELD)
    assert [edit.code for edit in edits] == ["DEC"]


def test_unknown_code_is_refused() -> None:
    with pytest.raises(UnknownParameter):
        Edits().stage(ATV71, "NOSUCH", "1", HELD)


def test_edit_with_an_unread_scale_is_not_staged() -> None:
    with pytest.raises(ValueRefused, match="INR"):
        Edits().stage(ATV71, "ACC", "5", {"ACC": 30})


def test_undo_removes_one_edit_or_all() -> None:
    edits = Edits().stage(ATV71, "ACC", "5", HELD).stage(ATV71, "DEC", "7", HELD)
    left = edits.undo("ACC", ATV71, HELD)
    assert [edit.code for edit in left] == ["DEC"]
    assert len(left.undo("NOSUCH", ATV71, HELD)) == 1
    assert len(edits) == 2
    assert len(Edits()) == 0


def test_ramp_keeps_its_engineering_value_when_its_scale_is_edited() -> None:
    edits = Edits().stage(ATV71, "ACC", "5 s", HELD)
    assert edits.get("ACC") is not None
    for typed, raw, text in (("0.01 s", 500, "5.00 s"), ("1 s", 5, "5 s")):
        both = edits.stage(ATV71, "INR", typed, HELD)
        edit = both.get("ACC")
        assert edit is not None
        assert (edit.new, edit.text, edit.old_text) == (raw, text, "3.0 s")
        back = both.undo("INR", ATV71, HELD).get("ACC")
        assert back is not None
        assert back.new == 50


def test_scale_that_cannot_hold_a_staged_ramp_is_not_staged() -> None:
    edits = Edits().stage(ATV71, "ACC", "900 s", HELD)
    with pytest.raises(ValueRefused, match="ACC"):
        edits.stage(ATV71, "INR", "0.01 s", HELD)


def test_unedited_ramps_that_change_with_their_scale_are_reported() -> None:
    edits = Edits().stage(ATV71, "INR", "1 s", HELD).stage(ATV71, "ACC", "4", HELD)
    reported = consequences(ATV71, edits, HELD)
    assert reported == [
        "DEC keeps its raw value 30: 3.0 s becomes 30 s.",
        "AC2 keeps its raw value 50: 5.0 s becomes 50 s.",
        "DE2 keeps its raw value 50: 5.0 s becomes 50 s.",
    ]
    assert consequences(ATV71, Edits().stage(ATV71, "ACC", "4", HELD), HELD) == []


def test_old_drive_without_a_ramp_increment_counts_in_tenths() -> None:
    edits = Edits().stage(ATV31, "ACC", "5", {"ACC": 30}, {"Inr"})
    assert [edit.new for edit in edits] == [50]


@pytest.mark.parametrize(
    ("typed", "order"),
    [
        ({"LSP": "55", "HSP": "58"}, ["HSP", "LSP"]),
        ({"LSP": "70", "HSP": "80", "TFR": "90"}, ["TFR", "HSP", "LSP"]),
        ({"HSP": "10", "TFR": "20"}, ["HSP", "TFR"]),
    ],
)
def test_limits_are_written_before_the_values_they_block(
    typed: Mapping[str, str], order: list[str]
) -> None:
    assert codes(stage(ATV71, typed, HELD), ATV71, HELD) == order


def test_lower_limit_is_lowered_first() -> None:
    held = {**HELD, "LSP": 300, "HSP": 500}
    assert codes(stage(ATV71, {"LSP": "5", "HSP": "10"}, held), ATV71, held) == ["LSP", "HSP"]


def test_mixed_edits_are_written_in_order() -> None:
    held = {"Inr": 1, "ACC": 30, "LAC": 0, "Fr1": 0, "Add": 1, "tbr": 32, "ttO": 100, "SLL": 1,
            "tFO": 3, "CFG": 0, "bFr": 0}  # fmt: skip
    typed = {
        "Add": "7", "tbr": "9600", "ttO": "5", "ACC": "2", "Inr": "0.01 s", "LAC": "L3",
        "bFr": "60 Hz",
    }  # fmt: skip
    known = ATV31.names(ATV31["tbr"])
    typed["tbr"] = next(text for text in known.values() if text.startswith("9600"))
    names = ATV31.names(ATV31["bFr"])
    typed["bFr"] = names[1]
    edits = stage(ATV31, typed, held)
    assert codes(edits, ATV31, held) == ["bFr", "LAC", "Inr", "ACC", "ttO", "tbr", "Add"]


def test_value_beyond_another_parameter_is_reported_with_both() -> None:
    edits = Edits().stage(ATV71, "LSP", "55", HELD)
    reported = edit_problems(ATV71, edits, HELD)
    assert reported == {
        "LSP": "LSP = 55.0 Hz would be above HSP = 50.0 Hz. Change HSP as well,"
        " or use another value."
    }
    assert edit_problems(ATV71, edits.stage(ATV71, "HSP", "60", HELD), HELD) == {}
    lowered = Edits().stage(ATV71, "TFR", "40", HELD)
    assert "below HSP = 50.0 Hz" in edit_problems(ATV71, lowered, HELD)["TFR"]
    assert edit_problems(ATV71, Edits().stage(ATV71, "ACC", "4", HELD), {**HELD, "LSP": 600}) == {}


def test_edits_are_updated_if_the_drive_already_has_the_value() -> None:
    edits = stage(ATV71, {"ACC": "5", "DEC": "7"}, HELD)
    later = edits.now(ATV71, {**HELD, "ACC": 50, "DEC": 10})
    assert [(edit.code, edit.old, edit.new) for edit in later] == [("DEC", 10, 70)]


def test_disabling_the_timeout_has_a_warning() -> None:
    edits = Edits().stage(ATV21, "F803", "0", {"F803": 3})
    assert "timeout" in edits.items[0].warning
    assert "timeout" in edits.items[0].remark


def test_settings_that_end_the_connection_are_known() -> None:
    assert cuts_line(ATV21, ATV21["F802"])
    assert not cuts_line(ATV21, ATV21["F800"])
    assert cuts_line(ATV71, ATV71["ADD"])
    assert not cuts_line(ATV71, ATV71["TTO"])
    assert not cuts_line(ATV312, ATV312["Add"])
    assert not cuts_line(ATV71, ATV71["ACC"])


class Cutting:
    """A drive that clamps a written value to its current limits."""

    def __init__(self, profile: Profile, raws: Mapping[str, int]) -> None:
        self.profile, self.raws = profile, dict(raws)

    def write(self, edit: Edit) -> None:
        raw = edit.new
        for low, high in limit_pairs(self.profile):
            if edit.code == low:
                raw = min(raw, self.raws[high])
            if edit.code == high:
                raw = max(raw, self.raws[low])
        self.raws[edit.code] = raw


SPEEDS = {
    "atv71": ("LSP", "HSP", "TFR"),
    "atv31": ("LSP", "HSP", "tFr"),
    "atv312": ("LSP", "HSP", "tFr"),
}
rising = st.lists(st.integers(100, 599), min_size=3, max_size=3).map(sorted)


@given(
    family=st.sampled_from(sorted(SPEEDS)), old=rising, new=rising, take=st.permutations(range(3))
)
def test_write_order_ends_with_every_value_set(
    family: str, old: list[int], new: list[int], take: list[int]
) -> None:
    """Whatever the values are, and in whatever order they were staged."""
    profile = library.load(family)
    held = dict(zip(SPEEDS[family], old, strict=True))
    edits = Edits()
    for place in take:
        edits = edits.stage_raw(profile, SPEEDS[family][place], new[place], held)
    drive = Cutting(profile, held)
    for edit in ordered(profile, edits, held):
        drive.write(edit)
    assert drive.raws == edits.after(held) == dict(zip(SPEEDS[family], new, strict=True))
    assert edit_problems(profile, edits, held) == {}


@given(
    seconds=st.decimals("0.5", "99.99", places=2),  # less than a count is out of range
    first=st.sampled_from(["0.01 s", "0.1 s", "1 s"]),
    last=st.sampled_from(["0.01 s", "0.1 s", "1 s"]),
    scale_first=st.booleans(),
)
def test_ramp_and_scale_end_as_typed(
    seconds: Decimal, first: str, last: str, scale_first: bool
) -> None:
    """Within half a count of the last scale, whenever the scales were edited."""
    edits = Edits()
    steps = [("INR", first), ("ACC", f"{seconds} s"), ("INR", last)]
    for code, typed in steps if scale_first else [steps[1], steps[0], steps[2]]:
        edits = edits.stage(ATV71, code, typed, HELD)
    after = edits.after(HELD)
    value = shown(ATV71, ATV71["ACC"], after["ACC"], after)
    assert value.number is not None
    count = Decimal(last.removesuffix(" s"))
    assert abs(value.number - seconds) <= count / 2
    edit = edits.get("ACC")
    if edit is not None:
        assert edit.rounded == (value.number != seconds)


@given(data=st.data())
def test_write_order_contains_each_edit_once(data: st.DataObject) -> None:
    profile = data.draw(st.sampled_from([ATV31, ATV312, ATV71, ATV21]))
    writable = [
        p for p in profile.parameters if p.access.startswith("rw") and p.factory is not None
    ]
    chosen = data.draw(st.lists(st.sampled_from(writable), unique_by=lambda p: p.code, max_size=12))
    sources = {"Inr": 1, "INR": 1, "INT": 0, "INTP": 0, "INSP": 0}
    held = {p.code: sources.get(p.code, -1) for p in profile.parameters}
    edits = Edits()
    for parameter in chosen:
        try:
            edits = edits.stage_raw(profile, parameter.code, parameter.factory or 0, held)
        except ValueRefused:
            continue
    order = ordered(profile, edits, held)
    assert sorted(edit.code for edit in order) == sorted(edit.code for edit in edits)


def stage(profile: Profile, typed: Mapping[str, str], held: Mapping[str, int]) -> Edits:
    edits = Edits()
    for code, text in typed.items():
        edits = edits.stage(profile, code, text, held)
    return edits


def codes(edits: Edits, profile: Profile, held: Mapping[str, int]) -> list[str]:
    return [edit.code for edit in ordered(profile, edits, held)]


@pytest.mark.parametrize("family", ["atv31", "atv312", "atv71"])
def test_ignoring_communication_loss_is_never_written(family: str) -> None:
    profile = library.load(family)
    watch = profile.data.communication_fault
    assert watch is not None
    with pytest.raises(ValueRefused, match="never written by Drive Panel"):
        Edits().stage_raw(profile, watch.reaction, 0, {watch.reaction: 1})
    # a value that the drive already has is not an edit
    assert len(Edits().stage_raw(profile, watch.reaction, 0, {watch.reaction: 0})) == 0


def test_change_of_the_command_source_is_reported() -> None:
    """An input that is on at the new source would start the motor."""
    staged = Edits().stage(ATV71, "CD1", "1", {"CD1": 10, **HELD})
    assert consequences(ATV71, staged, HELD) == [
        "CD1 decides who commands the motor. If a run command is on at the new source, the motor"
        " starts."
    ]
    same = Edits().stage(ATV71, "CD1", "10", {"CD1": 10, **HELD})
    assert consequences(ATV71, same, HELD) == []


@pytest.mark.parametrize(
    ("family", "codes"),
    [
        ("atv71", {"CHCF", "CD1", "CD2", "CCS", "FR1", "FR2", "RFC"}),
        ("atv312", {"CHCF", "Cd1", "Cd2", "CCS", "Fr1", "LAC", "rFC"}),
        ("atv21", {"CMOD"}),
        ("powerdrive", {"6.43"}),
    ],
)
def test_settings_of_the_command_source_are_known(family: str, codes: set[str]) -> None:
    assert codes <= command_settings(library.load(family))


def test_raw_value_is_checked_by_the_scale_without_a_parameter_that_the_drive_lacks() -> None:
    """An Altivar 31 without a ramp increment counts in tenths; the refusal shows seconds."""
    with pytest.raises(ValueRefused, match=r"6000\.0 s is out of range, 0\.1 s to 3276\.0 s"):
        Edits().stage_raw(ATV31, "ACC", 60_000, {"ACC": 30}, {"Inr"})
    with pytest.raises(ValueRefused, match="raw 60000 is out of range"):
        Edits().stage_raw(ATV31, "ACC", 60_000, {"ACC": 30})
