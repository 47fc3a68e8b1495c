"""Parameter sets as text: every parameter there and back, and every fault with its line."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tui.drive.errors import UnknownProfile
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.settings.compare import Side, compare_settings, factory_side, rows_text, side_of
from tui.drive.settings.parameter_set import ParameterSet, SetError, SetHead, dump_set
from tui.drive.settings.set_file import FileThere, load_set, read_set, write_file
from tui.drive.values import is_enumeration, raw_range, type_range

FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]
HEAD = SetHead("atv71", "1.0", "Altivar 71", "2024-05-01T10:00:00+00:00", "serial:/dev/x", 2, "0.1")
SMALL = {"INR": 1, "ACC": 30, "HSP": 500, "CHCF": 1, "ETA": 0x21, "RFR": -503}


def small(**more: int) -> str:
    return dump_set(library.load("atv71"), ParameterSet(HEAD, {**SMALL, **more}))


def read(text: str) -> ParameterSet:
    return load_set(text, "set.toml", library.load)


@settings(max_examples=25)
@given(data=st.data())
@pytest.mark.sweep
def test_every_parameter_of_every_profile_survives_a_round_trip(data: st.DataObject) -> None:
    """Any word that a drive may return, also one without a name in the profile."""
    profile = library.load(data.draw(st.sampled_from(FAMILIES)))
    seed = data.draw(st.randoms(use_true_random=False))
    raws = {p.code: seed.randint(*type_range(p)) for p in profile.parameters}
    head = SetHead(
        profile.id, "1", 'a "name"\\ with\tall\x7f', "t", "l", 7, "0", {"reference": "ATV"}
    )
    values = ParameterSet(head, raws)
    text = dump_set(profile, values)
    back = load_set(text, "set.toml", library.load)
    assert dict(back.raws) == raws
    assert back.head == head
    assert dump_set(profile, back) == text


@settings(max_examples=25)
@given(data=st.data())
def test_value_without_its_raw_word_is_the_same(data: st.DataObject) -> None:
    """The readable text suffices, for every value in its range."""
    profile = library.load(data.draw(st.sampled_from(FAMILIES)))
    seed = data.draw(st.randoms(use_true_random=False))
    raws = {p.code: seed.choice(allowed(profile, p)) for p in profile.parameters if not p.unit_by}
    text = dump_set(profile, ParameterSet(SetHead(profile.id), raws))
    alone = re.sub(r"raw = -?\d+, ", "", text)
    assert "raw =" not in alone.replace("# `raw`", "")
    assert dict(load_set(alone, "set.toml", library.load).raws) == raws


def allowed(profile: Profile, parameter: Parameter) -> list[int]:
    """Some raw values that a person may type for a parameter."""
    names = profile.names(parameter)
    if is_enumeration(parameter) and names:
        return sorted(names)
    low, high = raw_range(parameter)
    reserved = sum(1 << bit for bit in parameter.reserved)
    some = [low, high, (low + high) // 2, min(max(0, low), high)]
    return [raw for raw in some if not raw & reserved] or [0]


def test_each_parameter_has_one_line_in_a_stable_order() -> None:
    text = small()
    assert 'ACC = { raw = 30, value = "3.0 s", name = "Acceleration time" }\n' in text
    assert text == small()
    other = small(ACC=31)
    assert sum(a != b for a, b in zip(text.splitlines(), other.splitlines(), strict=True)) == 1
    places = [text.index(f"\n{code} = ") for code in ("ETA", "RFR", "ACC", "CHCF")]
    order = [p.code for p in library.load("atv71").parameters]
    wanted = sorted(("ETA", "RFR", "ACC", "CHCF"), key=order.index)
    assert [("ETA", "RFR", "ACC", "CHCF")[places.index(p)] for p in sorted(places)] == wanted


def test_unread_parameters_are_listed_with_reason() -> None:
    profile = library.load("powerdrive")
    values = ParameterSet(SetHead("powerdrive"), {"15.07": 50}, {"15.03": 'no "answer"'})
    text = dump_set(profile, values)
    assert '"15.07" = { raw = 50, ' in text
    assert load_set(text, "f", library.load).absent == {"15.03": 'no "answer"'}


def test_hand_edited_value_counts_if_raw_is_removed() -> None:
    text = small().replace('raw = 30, value = "3.0 s"', 'value = "4,25 s"')
    with_scale = text.replace('raw = 1, value = "0.1 s"', 'value = "0.01 s"')
    assert read(with_scale).raws["ACC"] == 425
    assert read(with_scale).raws["INR"] == 0
    assert read(small().replace('raw = 30, value = "3.0 s"', "value = 4.5")).raws["ACC"] == 45
    rounded = read(small().replace('raw = 30, value = "3.0 s"', 'value = "4.56 s"'))
    assert (rounded.raws["ACC"], rounded.notes) == (46, {"ACC": "ACC: 4.56 s is rounded to 4.6 s."})


FAULTS = [
    # old text, new text, line of the error, expected message
    ('value = "3.0 s"', 'value = "5.0 s"', "ACC", "raw 30 is 3.0 s, but value is 5.0 s"),
    ("raw = 30", "raw = 300", "ACC", "Delete raw in this line"),
    ("raw = 30", "raw = 70000", "ACC", "does not fit uint16"),
    ("raw = 30", "raw = 3.0", "ACC", "whole number"),
    ("raw = 30", "raw = true", "ACC", "whole number"),
    ("raw = 30", "row = 30", "ACC", "'row' is not a field"),
    ('raw = 30, value = "3.0 s"', 'value = "soon"', "ACC", "'soon'"),
    ('raw = 30, value = "3.0 s", ', "", "ACC", "neither raw nor value"),
    ('value = "3.0 s"', "value = true", "ACC", "text or a number"),
    ('value = "3.0 s"', 'value = "3.0 s', "ACC", "not a parameter set"),
    ("format = 1", "format = 9", "[set]", "format 9"),
    ('profile = "atv71"', "profile = 5", "[set]", "not a parameter set"),
    ("parameters = 6", "parameters = 7", "[set]", "states 7 parameters, but the file has 6"),
]


@pytest.mark.parametrize(("right", "wrong", "place", "expected"), FAULTS)
def test_set_error_is_reported_with_its_line(
    right: str, wrong: str, place: str, expected: str
) -> None:
    text = small().replace(right, wrong, 1)
    assert text != small()
    start = "[set]" if place == "[set]" else f"{place} = "
    line = next(n for n, row in enumerate(text.splitlines(), 1) if row.startswith(start))
    with pytest.raises(SetError) as caught:
        read(text)
    assert str(caught.value).startswith(f"set.toml:{line}: ")
    assert expected in str(caught.value)


def test_duplicate_parameter_is_refused() -> None:
    line = next(row for row in small().splitlines() if row.startswith("ACC = "))
    doubled = small().replace("[end]", f'[parameters."Another"]\n{line}\n\n[end]')
    with pytest.raises(SetError, match=r"set\.toml:\d+: ACC is already in line \d+"):
        read(doubled)


@given(share=st.floats(0, 0.999))
def test_truncated_file_is_always_detected(share: float) -> None:
    """At any character, also between two lines."""
    text = small()
    # without its last line break it is still whole
    cut = text[: int((len(text) - 1) * share)]
    with pytest.raises(SetError):
        read(cut)


def test_file_truncated_between_lines_is_always_detected() -> None:
    """As after a full disk: the existing part is valid TOML."""
    lines = small().splitlines(keepends=True)
    for count in range(len(lines) - 1):
        with pytest.raises(SetError):
            read("".join(lines[:count]))


@pytest.mark.parametrize("text", ["", "\x00\x01", "a = 1\n", "[profile]\nid = 'atv71'\n", "{}"])
def test_foreign_files_are_refused(text: str) -> None:
    with pytest.raises(SetError, match=r"set\.toml:\d+: not a parameter set"):
        read(text)


def test_set_of_an_unknown_profile_is_refused() -> None:
    with pytest.raises(UnknownProfile):
        read(small().replace('profile = "atv71"', 'profile = "atv99"'))


def test_unknown_codes_are_kept_separately() -> None:
    text = small().replace("ACC = {", "AXX = {")
    found = read(text)
    assert found.unknown == {"AXX": "3.0 s"}
    assert "AXX" not in found.raws


# On disk


def test_file_is_written_completely_and_read_back(tmp_path: Path) -> None:
    path = tmp_path / "pump.toml"
    write_file(path, small())
    assert read_set(path).raws == SMALL
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["pump.toml"]
    if os.name == "posix":
        fresh = tmp_path / "fresh"
        fresh.touch()
        assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(fresh.stat().st_mode)


def test_existing_file_is_not_overwritten_without_force(tmp_path: Path) -> None:
    path = tmp_path / "pump.toml"
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(FileThere, match="--force"):
        write_file(path, small())
    assert path.read_text(encoding="utf-8") == "mine"
    write_file(path, small(), force=True)
    assert read_set(path).raws == SMALL
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["pump.toml"]


@pytest.mark.skipif(os.name != "posix", reason="needs a named pipe")
def test_pipe_is_not_replaced_even_with_force(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(SetError, match="not a regular file"):
        write_file(pipe, small(), force=True)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert [path.name for path in tmp_path.iterdir() if not path.is_dir()] == ["pipe"]


def test_unusable_path_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SetError, match="cannot be written"):
        write_file(tmp_path / "no" / "pump.toml", small())
    with pytest.raises(SetError, match="cannot be read"):
        read_set(tmp_path / "nothing.toml")
    (tmp_path / "latin").write_bytes(b"\xe9")
    with pytest.raises(SetError, match="UTF-8"):
        read_set(tmp_path / "latin")


# Comparing


def test_differences_exclude_measurements() -> None:
    profile = library.load("atv71")
    a = Side("a", SMALL)
    b = Side("b", {**SMALL, "ACC": 50, "RFR": 100, "ETA": 0x27, "CMD": 15})
    assert [(row.code, row.a, row.b) for row in compare_settings(profile, a, b)] == [
        ("ACC", "3.0 s", "5.0 s")
    ]
    every = compare_settings(profile, a, b, all_rows=True)
    assert {row.code for row in every} == {*SMALL, "CMD"}
    assert [row.code for row in every if row.differs] == ["ACC"]


def test_equal_ramps_with_different_scales_are_equal() -> None:
    profile = library.load("atv71")
    a, b = Side("a", {"INR": 1, "ACC": 30}), Side("b", {"INR": 0, "ACC": 300})
    assert [row.code for row in compare_settings(profile, a, b)] == ["INR"]
    c = Side("c", {"INR": 0, "ACC": 30})
    assert [row.code for row in compare_settings(profile, a, c)] == ["INR", "ACC"]


def test_difference_in_decimals_counts() -> None:
    profile = library.load("atv71")
    a, b = Side("a", {"INR": 1, "ACC": 30}), Side("b", {"INR": 1, "ACC": 31})
    assert [(row.a, row.b) for row in compare_settings(profile, a, b)] == [("3.0 s", "3.1 s")]


def test_unread_side_differs_and_unknown_side_does_not() -> None:
    profile = library.load("atv71")
    a = Side("a", SMALL)
    b = Side("b", {k: v for k, v in SMALL.items() if k != "ACC"}, {"ACC": "refused"})
    (row,) = compare_settings(profile, a, b)
    assert (row.code, row.b, row.note) == ("ACC", "-", "refused")
    bare = Side("c", {k: v for k, v in SMALL.items() if k != "ACC"})
    assert compare_settings(profile, a, bare) == []


@pytest.mark.parametrize("family", FAMILIES)
def test_factory_settings_differ_from_themselves_in_nothing(family: str) -> None:
    profile = library.load(family)
    left = {p.code: p.factory for p in profile.parameters if p.factory is not None}
    side = factory_side(profile, ParameterSet(SetHead(family), left))
    assert compare_settings(profile, side, side) == []
    assert (
        compare_settings(profile, side, side_of("f", ParameterSet(SetHead(family), side.raws)))
        == []
    )


def test_differences_are_written_in_each_format() -> None:
    profile = library.load("atv71")
    rows = compare_settings(
        profile, Side("a", {"INR": 1, "ACC": 30}), Side("b", {"INR": 1, "ACC": 50})
    )
    labels = ("old.toml", "sim:atv71")
    text = rows_text(rows, labels, "text")
    assert re.search(r"^\*  ACC   Acceleration time  3\.0 s     5\.0 s$", text, re.MULTILINE), text
    markdown = rows_text(rows, labels, "markdown")
    assert "| yes | ACC | Acceleration time | 3.0 s | 5.0 s |  |" in markdown
    assert rows_text(rows, labels, "csv").splitlines()[1] == (
        "ACC,Acceleration time,Settings,3.0 s,5.0 s,30,50,yes,"
    )
    assert "No setting differs" in rows_text([], labels, "text")
