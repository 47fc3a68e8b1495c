"""Scale of a raw word, from readings of the drive's own display."""

from __future__ import annotations

from decimal import ROUND_DOWN, ROUND_HALF_UP, Decimal

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tui.drive.errors import ValueRefused
from tui.drive.teaching import (
    LOOKS_KEPT,
    SCALES,
    DisplayLook,
    Lesson,
    LessonKind,
    learn,
    parse_display,
    scales_that_fit,
    taught_by,
)

scales = st.sampled_from(SCALES)
words = st.integers(0, 0xFFFF)
cuts = st.sampled_from([ROUND_DOWN, ROUND_HALF_UP])


def look(word: int, shown: str, unit: str = "") -> DisplayLook:
    return DisplayLook(word, Decimal(shown), unit)


def honest(word: int, scale: Decimal, signed: bool, places: int, cut: str) -> DisplayLook:
    """Reading of a correct display of a word, with this many decimals, cut or rounded."""
    count = word - 0x10000 if signed and word >= 0x8000 else word
    return DisplayLook(word, (count * scale).quantize(Decimal(1).scaleb(-places), cut), "Hz")


def taught(*looks: DisplayLook) -> Lesson:
    """The lesson of the last of these looks."""
    lesson = learn("5.01", (), looks[0])
    for look in looks[1:]:
        lesson = learn("5.01", lesson.looks, look)
    return lesson


@given(scales, st.booleans(), words, words, st.integers(0, 4), cuts)
def test_every_scale_is_found_from_two_correct_readings(
    scale: Decimal, signed: bool, number: int, other: int, places: int, cut: str
) -> None:
    first, second = (honest(word, scale, signed, places, cut) for word in (number, other))
    assume(number != other)
    step = Decimal(1).scaleb(-places)
    # two and a half digits of one are visible: enough to distinguish a scale from its neighbors
    assume(max(abs(first.shown), abs(second.shown)) >= 25 * step)
    lesson = taught(first, second)
    assert lesson.kind is LessonKind.TAUGHT, lesson.text
    assert lesson.scale is not None
    assert lesson.scale.scale == scale
    assert lesson.scale.unit == "Hz"
    far = max(number, other) >= 0x8000
    assert lesson.scale.signed is (signed if far else None)


@given(scales, st.booleans(), st.lists(words, min_size=1, max_size=12), st.integers(0, 4), cuts)
def test_correct_readings_never_give_a_wrong_scale(
    scale: Decimal, signed: bool, seen: list[int], places: int, cut: str
) -> None:
    looks = [honest(word, scale, signed, places, cut) for word in seen]
    lesson = taught(*looks)
    assert not lesson.went_wrong, lesson.text
    assert len(lesson.looks) <= LOOKS_KEPT
    if lesson.scale is not None:
        assert lesson.scale.scale == scale
        assert lesson.scale.signed in (None, signed)
        assert taught_by(lesson.looks) == lesson.scale, "what is kept tells it again"


@given(scales, words, words, st.sampled_from(["1.3", "0.7", "4", "0.1", "10"]))
def test_inconsistent_readings_give_no_scale_and_a_reason(
    scale: Decimal, number: int, other: int, wrong: str
) -> None:
    first, second = (honest(word, scale, False, 4, ROUND_HALF_UP) for word in (number, other))
    assume(number != other and min(number, other) >= 100)
    shown = (second.shown * Decimal(wrong)).quantize(Decimal("0.0001"))
    lesson = taught(first, DisplayLook(other, shown, "Hz"))
    assert lesson.kind is LessonKind.DISAGREES
    assert lesson.scale is None
    assert "no scale was learned" in lesson.text
    assert "No usual scale" in lesson.text


def test_reverse_run_shows_the_sign() -> None:
    lesson = taught(look(0, "0.0"), look(503, "50.3", "Hz"))
    assert lesson.scale is not None
    assert lesson.scale.signed is None
    assert lesson.scale.number(65036) is None, "no value, as nobody knows its sign"
    assert "raw 32768" in lesson.text
    later = learn("5.01", lesson.looks, look(65036, "-50.0"))
    assert later.kind is LessonKind.AGREES
    assert later.scale is not None
    assert later.scale.number(65036) == Decimal("-50.0")
    assert "sign" in later.text


def test_unsigned_word_is_recognized() -> None:
    lesson = taught(look(1000, "100.0"), look(40000, "4000.0"))
    assert lesson.scale is not None
    assert lesson.scale.signed is False
    assert lesson.scale.number(40000) == Decimal("4000.0")


def test_disagreeing_third_reading_discards_the_scale() -> None:
    two = taught(look(300, "30.0", "Hz"), look(503, "50.3"))
    assert two.kind is LessonKind.TAUGHT
    lesson = learn("5.01", two.looks, look(400, "20.0"))
    assert lesson.kind is LessonKind.ENDED
    assert lesson.scale is None
    assert "shown raw again" in lesson.text
    assert "Before: 1 count is 0.1 Hz" in lesson.text
    assert lesson.looks == (look(400, "20.0"),), "the last look may begin anew"


def test_third_reading_in_another_unit_discards_the_scale() -> None:
    two = taught(look(300, "30.0", "Hz"), look(503, "50.3"))
    assert learn("5.01", two.looks, look(400, "40.0", "A")).kind is LessonKind.ENDED


def test_repeated_equal_readings_give_no_scale() -> None:
    lesson = taught(look(503, "50.3", "Hz"))
    assert (lesson.kind, lesson.scale) == (LessonKind.FIRST, None)
    again = learn("5.01", lesson.looks, look(503, "50.3"))
    assert (again.kind, again.looks) == (LessonKind.SAME, lesson.looks)
    assert "another value" in again.text


def test_small_values_require_a_larger_reading() -> None:
    lesson = taught(look(0, "0.0"), look(3, "0.3"))
    assert lesson.kind is LessonKind.UNSURE
    assert "larger" in lesson.text
    assert "0.1 or" in lesson.text
    assert learn("4.01", lesson.looks, look(84, "8.4", "A")).kind is LessonKind.TAUGHT


def test_unit_may_be_added_by_a_later_reading() -> None:
    two = taught(look(300, "30.0"), look(503, "50.3"))
    assert two.scale is not None
    assert two.scale.unit == ""
    reported = learn("5.01", two.looks, look(503, "50.3", "Hz"))
    assert reported.scale is not None
    assert (reported.scale.unit, len(reported.looks)) == ("Hz", 2)


def test_reading_that_fits_no_scale_is_not_kept() -> None:
    lesson = taught(look(0, "12.0"))
    assert (lesson.kind, lesson.looks) == (LessonKind.DISAGREES, ())


def test_lesson_without_readings_has_no_scale() -> None:
    assert scales_that_fit([]) == []


@pytest.mark.parametrize(
    ("typed", "unit", "number", "means"),
    [
        ("50.3", "", "50.3", ""),
        ("50,3 hz", "", "50.3", "Hz"),
        ("-12A", "", "-12", "A"),
        ("\N{MINUS SIGN}12", "a", "-12", "A"),
        (" 1500 tr/min ", "", "1500", "rpm"),
        ("1500", "1/min", "1500", "rpm"),
        ("1500 1/min", "", "1500", "rpm"),
        ("12 m3/h", "", "12", "m³/h"),
        ("4.0", "bar", "4.0", "bar"),
        ("80 %", "%", "80", "%"),
    ],
)
def test_typed_display_value_is_parsed(typed: str, unit: str, number: str, means: str) -> None:
    assert parse_display(typed, unit) == (Decimal(number), means)


@pytest.mark.parametrize(
    ("typed", "unit"),
    [
        ("", ""), ("fast", ""), ("1e5", ""), ("1e5", "A"), ("nan", ""), ("1.2.3", ""),
        ("12 34", ""), ("50", "raw"), ("50", "<script>"), ("5", "a b"), ("99999999", ""),
        ("5 Hz", "rpm"), ("5", "\x1b[2J"), ("5", "Hertzhertz"),
    ],
)  # fmt: skip
def test_invalid_display_number_is_refused(typed: str, unit: str) -> None:
    with pytest.raises(ValueRefused):
        parse_display(typed, unit)
