"""Raw values as a person reads them, where scale and unit follow other parameters."""

from __future__ import annotations

import pytest

from tui.drive.profile import library
from tui.drive.shown import depends_on, shown, shown_text, typed_text

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
def test_a_ramp_in_the_unit_that_the_drive_counts_in(
    raws: dict[str, int], absent: set[str], text: str, typed: str
) -> None:
    ramp = ATV31["ACC"]
    assert shown_text(ATV31, ramp, 50, raws, absent) == text
    assert shown(ATV31, ramp, 50, raws, absent).display == text
    assert typed_text(ATV31, ramp, 50, raws, absent) == typed


@pytest.mark.parametrize(
    ("word", "text"), [(0, "3 s"), (16, "3 min"), (32, "3 h"), (48, "3 raw"), (None, "3 raw")]
)
def test_a_unit_that_a_word_tells(word: int | None, text: str) -> None:
    raws = NOTHING if word is None else {"UNT": word}
    assert shown_text(ATV71, ATV71["RTH"], 3, raws) == text


def test_words_of_bits_and_names() -> None:
    assert shown_text(ATV71, ATV71["CMD"], 15, NOTHING) == "16#000F"
    assert typed_text(ATV71, ATV71["CMD"], 15, NOTHING) == "16#000F"
    assert shown_text(ATV71, ATV71["CHCF"], 3, NOTHING) == "I/O profile"
    assert typed_text(ATV71, ATV71["CHCF"], 3, NOTHING) == "3"
    assert shown_text(ATV71, ATV71["CMD"], None, NOTHING) == ""


def test_what_a_value_depends_on() -> None:
    assert depends_on(ATV31["ACC"]) == ("Inr",)
    assert depends_on(ATV71["RTH"]) == ("UNT",)
    assert depends_on(ATV71["CMD"]) == ()
