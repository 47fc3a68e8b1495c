"""Raw values as a person reads them, where scale and unit follow other parameters."""

from __future__ import annotations

import ast
from decimal import Decimal
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.session.fakes import parameter, profile_of
from tests.sources import ROOT, modules, tree_of
from tui.drive.errors import ValueRefused
from tui.drive.profile import library
from tui.drive.shown import depends_on, raw_of_text, shown, shown_text, typed_text

ATV31 = library.load("atv31")
ATV71 = library.load("atv71")
NOTHING: dict[str, int] = {}


@pytest.mark.parametrize(
    ("raws", "absent", "text", "typed"),
    [
        ({"Inr": 0}, set(), "0.50 s", "0.50"),
        ({"Inr": 1}, set(), "5.0 s", "5.0"),
        ({"Inr": 2}, set(), "50 s", "50"),
        # an older drive without the parameter counts in tenths; that is not the same as unread
        (NOTHING, {"Inr"}, "5.0 s", "5.0"),
        (NOTHING, set(), "50 raw", "50"),
        ({"Inr": 7}, set(), "50 raw", "50"),
    ],
)
def test_ramp_is_shown_in_the_increment_of_the_drive(
    raws: dict[str, int], absent: set[str], text: str, typed: str
) -> None:
    ramp = ATV31["ACC"]
    assert shown_text(ATV31, ramp, 50, raws, absent) == text
    assert shown(ATV31, ramp, 50, raws, absent).display == text
    assert typed_text(ATV31, ramp, 50, raws, absent) == typed


@pytest.mark.parametrize(
    ("word", "text"), [(0, "3 s"), (16, "3 min"), (32, "3 h"), (48, "3 raw"), (None, "3 raw")]
)
def test_unit_is_set_by_another_word(word: int | None, text: str) -> None:
    raws = NOTHING if word is None else {"UNT": word}
    assert shown_text(ATV71, ATV71["RTH"], 3, raws) == text


def test_bit_words_and_named_values_are_shown() -> None:
    assert shown_text(ATV71, ATV71["CMD"], 15, NOTHING) == "16#000F"
    assert typed_text(ATV71, ATV71["CMD"], 15, NOTHING) == "16#000F"
    assert shown_text(ATV71, ATV71["CHCF"], 3, NOTHING) == "I/O profile"
    assert typed_text(ATV71, ATV71["CHCF"], 3, NOTHING) == "3"
    assert shown_text(ATV71, ATV71["CMD"], None, NOTHING) == ""


def test_values_know_their_dependencies() -> None:
    assert depends_on(ATV31["ACC"]) == ("Inr",)
    assert depends_on(ATV71["RTH"]) == ("UNT",)
    assert depends_on(ATV71["CMD"]) == ()


def test_one_module_converts_text_to_raw_values() -> None:
    """A second conversion would forget the scale or the unit that follows another word."""
    found = {
        path.relative_to(ROOT).as_posix()
        for path in modules()
        if "encode" in path.read_text("utf-8")
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").endswith("values")
        and any(name.name == "encode" for name in node.names)
    }
    assert found == {"tui/drive/shown.py"}


def test_raw_of_text_follows_scale_and_unit_of_other_words() -> None:
    scaled = parameter(
        "P", 1, unit="Hz", scale_by={"parameter": "M", "scales": {"0": "0.1", "1": "1"}}
    )
    counted = parameter(
        "C", 2, unit_by={"parameter": "M", "shift": 0, "mask": 1, "units": {"0": "s", "1": "V"}}
    )
    profile = profile_of(scaled, counted, parameter("M", 3))
    assert [raw_of_text(profile, profile["P"], "20 Hz", {"M": m}).raw for m in (0, 1)] == [200, 20]
    assert raw_of_text(profile, profile["C"], "5000ms", {"M": 0}).raw == 5
    for code, text in (("P", "its scale depends on M"), ("C", "its unit depends on M")):
        with pytest.raises(ValueRefused, match=text):
            raw_of_text(profile, profile[code], "20", {})
    with pytest.raises(ValueRefused, match="is not a number in V"):
        raw_of_text(profile, profile["C"], "5 s", {"M": 1})


def test_value_of_a_learned_scale_is_shown_as_learned() -> None:
    taught = SimpleNamespace(number={7: Decimal("3.5")}.get, unit="A")
    profile = cast(Any, SimpleNamespace(taught={"P": taught}))
    word = cast(Any, SimpleNamespace(code="P"))
    known, unknown = (shown(profile, word, raw, NOTHING) for raw in (7, 40000))
    assert (known.raw, known.display, known.taught) == (7, "3.5 A", True)
    assert (unknown.raw, unknown.display, unknown.taught) == (40000, "40000 raw", False)
