"""Raw words and engineering values, both ways, for every parameter of every profile."""

from __future__ import annotations

from decimal import Decimal

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tui.drive.errors import ValueRefused
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.values import (
    NOT_A_NUMBER,
    decimals_of,
    decode,
    encode,
    engineering,
    from_words,
    hexadecimal,
    is_enumeration,
    is_signed_type,
    percent_of,
    raw_range,
    set_bits,
    to_words,
    type_range,
)
from tui.simulator.plant.monitoring import speed_from_frequency

PROFILES = [listing.id for listing in library.listings()]
ALL = [(profile, p) for profile in map(library.load, PROFILES) for p in profile.parameters]


def parameter(**fields: object) -> Parameter:
    """A parameter with the fields that a test does not care about filled in."""
    return msgspec.convert(
        {
            "code": "P",
            "name": "p",
            "number": "W1",
            "address": 1,
            "access": "rw",
            "group": "All",
            "source": "manual",
            "confidence": "manual",
            **fields,
        },
        Parameter,
    )


@settings(max_examples=1500)
@given(which=st.integers(0, len(ALL) - 1), share=st.floats(0, 1))
def test_raw_value_survives_conversion_to_text(which: int, share: float) -> None:
    """Text shown by the panel can be typed back and gives the same raw value."""
    profile, p = ALL[which]
    names = profile.names(p)
    low, high = raw_range(p)
    raw = low + round((high - low) * share)
    if is_enumeration(p):
        raw = sorted(names)[round((len(names) - 1) * share)]
    for bit in p.reserved:
        raw &= ~(1 << bit)
    assert from_words(p, to_words(p, raw)) == raw
    scale = Decimal(p.scale)
    value = decode(p, raw, names, scale)
    same_name = [r for r, text in names.items() if text.casefold() == value.text.casefold()]
    if len(same_name) > 1:
        return
    back = encode(p, value.text, names, scale)
    assert (back.raw, back.rounded) == (raw, False)
    if value.number is not None:
        assert encode(p, value.display, names, scale).raw == raw


SCALES = st.one_of(
    st.decimals(Decimal("0.0000001"), 1000, allow_nan=False, allow_infinity=False, places=10),
    st.integers(1, 100_000).map(lambda counts: round(Decimal(60) / counts, 13)),
    st.sampled_from(["0.1", "0.01", "0.25", "1.5", "10", "1", "0.125", "0.0012207031250"]).map(
        Decimal
    ),
).filter(lambda scale: scale > 0)


@settings(max_examples=500)
@given(scale=SCALES, raw=st.integers(-0x8000, 0x7FFF))
def test_shown_digits_lead_back_to_the_raw_value_and_no_further(scale: Decimal, raw: int) -> None:
    p = parameter(unit="Hz", scale=f"{scale:f}", type="int16")
    value = decode(p, raw, {}, scale)
    for typed in (value.text, value.display, f"{value.text}hz", value.text.replace(".", ",")):
        back = encode(p, typed, {}, scale)
        assert (back.raw, back.rounded, back.lossy) == (raw, False, False)
    assert value.number is not None
    assert abs(value.number - raw * scale) < scale / 2
    assert value.text != decode(p, raw + 1, {}, scale).text
    decimals = len(value.text.partition(".")[2])
    assert decimals == decimals_of(scale)
    assert decimals == 0 or scale < Decimal(100).scaleb(-decimals), "two digits a count at most"


@pytest.mark.parametrize(
    ("scale", "raw", "text"),
    [
        ("0.1", 200, "20.0"),
        ("0.01", 2000, "20.00"),
        ("0.25", 81, "20.25"),
        ("1.5", 3, "4.5"),
        ("10", 2, "20"),
        ("0.0012207031250", 16385, "20.001"),
        ("0.0018311105685", -10923, "-20.001"),
        ("0.0030518509476", 3, "0.009"),
    ],
)
def test_number_has_the_digits_of_its_scale(scale: str, raw: int, text: str) -> None:
    p = parameter(unit="Hz", scale=scale, type="int16")
    value = decode(p, raw, {}, Decimal(scale))
    assert (value.text, f"{value.number:f}") == (text, text)


@pytest.mark.parametrize(
    ("typed", "rounded", "lossy"),
    [
        ("20", False, False),
        ("20.001", False, False),
        ("20.0012207031250", False, False),
        ("20.0005", True, False),
        ("0.0003", True, True),
    ],
)
def test_long_scale_rounds_only_numbers_between_its_counts(
    typed: str, rounded: bool, lossy: bool
) -> None:
    p = parameter(unit="Hz", scale="0.0012207031250")
    found = encode(p, typed, {}, Decimal("0.0012207031250"))
    assert (found.rounded, found.lossy) == (rounded, lossy)


@given(raw=st.integers(-0x8000, 0x7FFF))
def test_signed_words_are_decoded(raw: int) -> None:
    p = parameter(type="int16")
    (word,) = to_words(p, raw)
    assert 0 <= word <= 0xFFFF
    assert from_words(p, [word]) == raw


@pytest.mark.parametrize("low_first", [True, False])
@given(raw=st.integers(-(2**31), 2**31 - 1))
def test_values_of_32_bits_are_decoded(low_first: bool, raw: int) -> None:
    p = parameter(type="int32", low_word_first=low_first)
    words = to_words(p, raw)
    assert len(words) == 2
    assert from_words(p, words) == raw
    assert words[0 if low_first else 1] == raw & 0xFFFF


@pytest.mark.parametrize(
    ("typed", "raw", "rounded"),
    [("13", 130, False), ("13.05", 131, True), ("13.04 s", 130, True), ("0,5", 5, False),
     ("1.25s", 13, True), ("999.9", 9999, False)],
)  # fmt: skip
def test_rounding_is_half_away_from_zero_and_reported(typed: str, raw: int, rounded: bool) -> None:
    p = parameter(unit="s", scale="0.1", min=1, max=9999)
    found = encode(p, typed, {}, Decimal("0.1"))
    assert (found.raw, found.rounded) == (raw, rounded)


def test_negative_half_is_rounded_away_from_zero() -> None:
    p = parameter(unit="Hz", scale="0.1", type="int16")
    assert encode(p, "-0.25", {}, Decimal("0.1")).raw == -3


@pytest.mark.parametrize(
    ("typed", "words"),
    [("1000", "out of range, 0.1 s to 999.9 s"), ("0", "out of range"), ("fast", "not a number"),
     ("", "not a number"), ("nan", "not a number"), ("inf", "not a number"),
     ("16#FFFFF", "does not fit"), ("16#XY", "not a hexadecimal")],
)  # fmt: skip
def test_refused_text_has_a_reason(typed: str, words: str) -> None:
    p = parameter(unit="s", scale="0.1", min=1, max=9999)
    with pytest.raises(ValueRefused, match=words):
        encode(p, typed, {}, Decimal("0.1"))


@pytest.mark.parametrize(
    "typed", ["1e999999999", "-1e999999", "1e-999999999", "9" * 5000, "0." + "0" * 500 + "1"]
)
def test_absurd_number_is_refused(typed: str) -> None:
    p = parameter(unit="s", scale="0.1", min=1, max=9999)
    with pytest.raises(ValueRefused, match="out of range") as refused:
        encode(p, typed, {}, Decimal("0.1"))
    assert len(str(refused.value)) < 100


def test_names_are_typed_in_any_case_or_as_numbers() -> None:
    p = parameter(values={"0": "Terminals", "2": "Serial link"})
    names = {0: "Terminals", 2: "Serial link"}
    assert encode(p, "serial LINK", names, Decimal(1)).raw == 2
    assert encode(p, "0", names, Decimal(1)).raw == 0
    with pytest.raises(ValueRefused, match="not one of its values"):
        encode(p, "1", names, Decimal(1))


@pytest.mark.parametrize(
    ("family", "code", "former"),
    [
        ("atv312", "Fr1", "Analogue input AI1"),
        ("atv71", "STP", "DC bus kept up"),
        ("atv71", "SLL", "Speed kept"),
        ("atv71", "BST", "travelling"),
    ],
)
def test_former_names_of_values_are_still_read(family: str, code: str, former: str) -> None:
    profile = library.load(family)
    names = profile.names(profile[code])
    assert former not in names.values()
    present = {"Analogue input AI1": "Analog input AI1", "DC bus kept up": "DC bus maintained"}
    present |= {"Speed kept": "Speed maintained", "travelling": "Traveling"}
    assert names[encode(profile[code], former, names, Decimal(1)).raw] == present[former]


def test_number_with_a_special_name_is_still_a_number() -> None:
    p = parameter(values={"0": "Off"}, unit="s", min=0, max=100)
    assert decode(p, 0, {0: "Off"}, Decimal(1)).text == "Off"
    assert decode(p, 3, {0: "Off"}, Decimal(1)).display == "3 s"
    assert encode(p, "off", {0: "Off"}, Decimal(1)).raw == 0


@pytest.mark.parametrize("names", [1, 3, 8])
def test_names_of_a_quarter_of_the_range_are_an_enumeration_of_less_a_number(names: int) -> None:
    values = {str(number): f"name {number}" for number in range(names)}
    for low in (-2, 0, 5):
        last = low + 4 * names - 1
        assert is_enumeration(parameter(type="int16", values=values, min=low, max=last))
        assert not is_enumeration(parameter(type="int16", values=values, min=low, max=last + 1))


def test_reserved_bits_must_be_zero() -> None:
    p = parameter(bits=[{"bit": 0, "name": "run"}], reserved=[3])
    assert encode(p, "16#0001", {}, Decimal(1)).raw == 1
    with pytest.raises(ValueRefused, match="reserved bit 3"):
        encode(p, "16#0008", {}, Decimal(1))
    assert [bit.name for bit in set_bits(p.bits, 9)] == ["run"]


def test_unknown_scale_is_shown_raw_and_never_written() -> None:
    p = parameter(unit="s", scale_by={"parameter": "Inr", "scales": {"1": "0.1"}})
    value = decode(p, 30, {}, None)
    assert value.display == "30 raw"
    with pytest.raises(ValueRefused, match="depends on Inr"):
        encode(p, "3.0", {}, None)


@pytest.mark.parametrize(
    ("raw", "poles", "rpm"), [(5000, 4, 1500), (6000, 2, 3600), (3333, 4, 1000), (0, 4, 0)]
)
def test_speed_follows_the_formula_of_the_manual(raw: int, poles: int, rpm: int) -> None:
    assert speed_from_frequency(raw, poles) == rpm


def test_speed_without_poles_is_refused() -> None:
    with pytest.raises(ValueRefused):
        speed_from_frequency(5000, 0)


def test_percentage_is_converted_to_its_rating() -> None:
    assert percent_of(Decimal("45.66"), Decimal("3.3")) == Decimal("1.5")
    assert percent_of(Decimal(50), Decimal("0.25")) == Decimal("0.13")


def test_every_range_fits_its_type() -> None:
    for profile, p in ALL:
        low, high = raw_range(p)
        assert type_range(p)[0] <= low <= high <= type_range(p)[1], (profile.id, p.code)


def test_every_factory_setting_is_accepted() -> None:
    for profile, p in ALL:
        if p.factory is None or p.scale_by or p.forbidden:
            continue
        names = profile.names(p)
        low, high = raw_range(p)
        inside = low <= p.factory <= high or p.factory in names
        assert inside, (profile.id, p.code, p.factory)


def find_everything(profile: Profile) -> int:
    return sum(profile.find(p.code) is p for p in profile.parameters)


@pytest.mark.parametrize("profile_id", PROFILES)
def test_every_code_of_a_profile_is_found(profile_id: str) -> None:
    profile = library.load(profile_id)
    assert find_everything(profile) == len(profile.parameters)


@pytest.mark.parametrize(
    ("type", "low", "high"),
    [
        ("uint16", 0, 65535),
        ("int16", -32768, 32767),
        ("uint32", 0, 4294967295),
        ("int32", -2147483648, 2147483647),
    ],
)
def test_each_type_has_its_range(type: str, low: int, high: int) -> None:
    assert type_range(parameter(type=type)) == (low, high)


def test_field_has_the_range_of_its_mask() -> None:
    assert type_range(parameter(mask=7, shift=4)) == (0, 7)


@pytest.mark.parametrize(
    ("fields", "raw", "held", "words"),
    [
        ({"type": "uint16"}, 65536, None, "P: 65536 does not fit uint16"),
        ({"type": "int16"}, -32769, None, "P: -32769 does not fit int16"),
        ({"mask": 0x0F, "shift": 4}, 3, None, "P is a part of a word"),
        ({"mask": 0x0F, "shift": 4}, 16, 0, "P: 16 does not fit"),
    ],
)
def test_raw_value_that_does_not_fit_its_words_is_refused_with_the_reason(
    fields: dict[str, object], raw: int, held: int | None, words: str
) -> None:
    with pytest.raises(ValueRefused, match=words):
        to_words(parameter(**fields), raw, held)


@given(held=st.integers(0, 0xFFFF), raw=st.integers(0, 15), shift=st.integers(0, 12))
def test_field_keeps_the_other_bits_of_its_word(held: int, raw: int, shift: int) -> None:
    p = parameter(mask=0x0F, shift=shift)
    (word,) = to_words(p, raw, held)
    assert 0 <= word <= 0xFFFF
    assert from_words(p, [word]) == raw
    others = [bit for bit in range(16) if not shift <= bit < shift + 4]
    assert all(word >> bit & 1 == held >> bit & 1 for bit in others)


@pytest.mark.parametrize(("low_first", "words"), [(False, (0x0001, 0x0002)), (True, (2, 1))])
def test_value_of_32_bits_has_its_words_in_the_order_of_the_drive(
    low_first: bool, words: tuple[int, int]
) -> None:
    p = parameter(type="uint32", low_word_first=low_first)
    assert to_words(p, 0x0001_0002) == words
    assert from_words(p, words) == 0x0001_0002


def test_refusal_names_the_first_four_names() -> None:
    names = {number: f"name {number}" for number in range(6)}
    p = parameter(values={str(number): text for number, text in names.items()})
    with pytest.raises(ValueRefused) as refused:
        encode(p, "what", names, Decimal(1))
    assert str(refused.value) == "P: 'what' is not one of name 0, name 1, name 2, name 3."


@pytest.mark.parametrize(
    ("percent", "rating", "value"),
    [("50", "4.0", "2.0"), ("33.3", "4.00", "1.33"), ("12.5", "10", "1"), ("15", "10", "2")],
)
def test_percentage_has_the_decimals_of_its_rating(percent: str, rating: str, value: str) -> None:
    assert str(percent_of(Decimal(percent), Decimal(rating))) == value


@pytest.mark.parametrize(
    ("scale", "decimals", "raw", "shown"),
    [
        ("1", 0, 5, "5"), ("0.1", 1, 5, "0.5"), ("0.25", 2, 3, "0.75"), ("10", 0, 5, "50"),
        ("0.0018310546875", 3, 10, "0.018"), ("0.0018310546875", 3, 3, "0.005"),
        ("0.0125", 2, 2, "0.03"), ("1.23456789", 0, 2, "2"), ("0.005", 3, 1, "0.005"),
    ],
)  # fmt: skip
def test_value_has_the_decimals_of_its_scale_or_those_that_tell_two_counts_apart(
    scale: str, decimals: int, raw: int, shown: str
) -> None:
    assert decimals_of(Decimal(scale)) == decimals
    assert f"{engineering(raw, Decimal(scale)):f}" == shown


@pytest.mark.parametrize(
    ("least", "most", "expected"),
    [(None, None, (0, 65535)), (0, None, (0, 65535)), (5, 9, (5, 9)), (None, 0, (0, 0))],
)
def test_raw_range_is_that_of_the_profile_within_the_type(
    least: int | None, most: int | None, expected: tuple[int, int]
) -> None:
    assert raw_range(parameter(min=least, max=most)) == expected


@pytest.mark.parametrize(
    ("values", "least", "most", "enumeration"),
    [
        ({"0": "No", "1": "Yes"}, 0, 1, True), ({"0": "No", "1": "Yes"}, 0, 7, True),
        ({"0": "No", "1": "Yes"}, 0, 8, False), ({"0": "No", "1": "Yes"}, None, 8, True),
        ({"0": "No", "1": "Yes"}, 0, None, True), ({}, 0, 1, False),
    ],
)  # fmt: skip
def test_value_is_a_number_if_its_range_exceeds_its_names_by_far(
    values: dict[str, str], least: int | None, most: int | None, enumeration: bool
) -> None:
    assert is_enumeration(parameter(values=values, min=least, max=most)) is enumeration
    assert not is_enumeration(parameter(values=values, min=least, max=most, unit="A"))
    assert not is_enumeration(parameter(values=values, min=least, max=most, scale="0.1"))


@pytest.mark.parametrize(("raw", "unsure"), [(99, False), (100, False), (101, True)])
def test_value_above_what_is_verified_has_a_question_mark(raw: int, unsure: bool) -> None:
    value = decode(parameter(sure_up_to=100, unit="A", scale="0.1"), raw, {}, Decimal("0.1"))
    assert (value.text, value.unsure) == (f"{raw / 10:.1f}{'?' if unsure else ''}", unsure)
    assert value.unit == "A"


@pytest.mark.parametrize(
    ("raw", "scale", "offset", "text"),
    [
        (5, "0.1", "0", "0.5"), (0, "0.1", "0", "0.0"), (5, "0.1", "10", "10.5"),
        (0, "0.1", "-40", "-40.0"), (0, "-0.1", "0", "0.0"), (5, "-0.1", "0", "-0.5"),
        (5, "1", "0.25", "5.25"), (2, "0.33333", "0", "0.7"),
    ],
)  # fmt: skip
def test_value_has_its_offset_its_decimals_and_no_negative_zero(
    raw: int, scale: str, offset: str, text: str
) -> None:
    assert f"{engineering(raw, Decimal(scale), offset):f}" == text


PLAIN = {"unit": "Hz", "scale": "0.1"}


@pytest.mark.parametrize(
    ("fields", "raw", "scale", "number", "unit", "text"),
    [
        ({"bits": [{"bit": 0, "name": "a"}]}, 0x237, "1", None, "", "16#0237"),
        ({**PLAIN, "type": "float32"}, NOT_A_NUMBER, "0.1", None, "", "not a number"),
        ({**PLAIN, "type": "float32"}, 15, "0.1", "1.5", "Hz", "1.5"),
        ({**PLAIN, "type": "int32"}, NOT_A_NUMBER, "1", str(NOT_A_NUMBER), "Hz", "-2147483648"),
        (PLAIN, 7, "0.1", None, "", "seven"),
        ({"values": {"7": "seven"}}, 8, "1", None, "", "unknown (8)"),
        (PLAIN, 15, None, "15", "raw", "15"),
        (PLAIN, 15, "0.1", "1.5", "Hz", "1.5"),
        ({**PLAIN, "offset": "-40"}, 15, "0.1", "-38.5", "Hz", "-38.5"),
        ({**PLAIN, "sure_up_to": 15}, 15, "0.1", "1.5", "Hz", "1.5"),
        ({**PLAIN, "sure_up_to": 14}, 15, "0.1", "1.5", "Hz", "1.5?"),
    ],
)  # fmt: skip
def test_raw_value_is_shown_as_its_kind_requires(
    fields: dict[str, object], raw: int, scale: str | None, number: str | None, unit: str, text: str
) -> None:
    by = Decimal(scale) if scale is not None else None
    found = decode(parameter(**fields), raw, {7: "seven"}, by)
    assert (found.raw, found.unit, found.text) == (raw, unit, text)
    assert isinstance(found.raw, int)
    assert found.number == (Decimal(number) if number is not None else None)
    assert (found.unsure, found.taught) == (text.endswith("?"), False)
    assert found.display == (f"{text} {unit}" if unit else text)


@pytest.mark.parametrize(
    ("fields", "is_named"),
    [
        ({"values": {"0": "off", "1": "on"}}, True), ({"enumeration": "list"}, True), ({}, False),
        ({"values": {"0": "off"}, "unit": "s"}, False),
        ({"values": {"0": "off"}, "scale": "0.1"}, False),
        ({"values": {"0": "off"}, "full_scale": {"counts": 5, "parameter": "F"}}, False),
        ({"values": {"0": "off"}, "min": 0, "max": 3}, True),
        ({"values": {"0": "off"}, "min": 0, "max": 4}, False),
        ({"values": {"0": "off"}, "max": 4}, True), ({"values": {"0": "off"}, "min": 0}, True),
        ({"enumeration": "list", "min": 0, "max": 4}, True),
    ],
)  # fmt: skip
def test_values_are_names_unless_they_are_those_of_a_number(
    fields: dict[str, object], is_named: bool
) -> None:
    assert is_enumeration(parameter(**fields)) == is_named


def test_raw_range_is_that_of_the_profile_else_of_the_type() -> None:
    for fields, ends in (
        ({}, (0, 65535)), ({"type": "int16"}, (-32768, 32767)), ({"min": 0, "max": 5}, (0, 5)),
        ({"type": "int16", "min": -5}, (-5, 32767)), ({"type": "int16", "max": 0}, (-32768, 0)),
        ({"type": "uint32"}, (0, (1 << 32) - 1)), ({"type": "int32"}, (-(1 << 31), (1 << 31) - 1)),
        ({"mask": 7}, (0, 7)), ({"type": "float32"}, (NOT_A_NUMBER + 1, -NOT_A_NUMBER - 1)),
    ):  # fmt: skip
        assert raw_range(parameter(**fields)) == ends


def test_words_are_those_of_the_value_and_a_field_keeps_its_other_bits() -> None:
    field = parameter(shift=4, mask=7)
    assert to_words(field, 5, held=0xFF8F) == (0xFFDF,)
    assert from_words(field, [0xFFDF]) == 5
    with pytest.raises(ValueRefused, match="other bits were not read"):
        to_words(field, 5)
    with pytest.raises(ValueRefused, match="P: 8 does not fit uint16"):
        to_words(field, 8, held=0)
    wide, low = (parameter(type="int32", low_word_first=first) for first in (False, True))
    assert (to_words(wide, -2), to_words(low, -2)) == ((0xFFFF, 0xFFFE), (0xFFFE, 0xFFFF))
    assert (from_words(wide, [0x0001, 0x0002]), from_words(low, [1, 2])) == (0x10002, 0x20001)
    unsigned = parameter(type="uint32", low_word_first=False)
    assert [from_words(each, [0x8000, 0]) for each in (wide, unsigned)] == [-(1 << 31), 1 << 31]
    small = parameter(type="int16")
    assert (from_words(small, [0x7FFF]), from_words(small, [0x8000])) == (0x7FFF, -0x8000)
    assert (to_words(small, -1), to_words(parameter(), 0xFFFF)) == ((0xFFFF,), (0xFFFF,))
    single = parameter(type="float32", scale="0.5", low_word_first=False)
    assert to_words(single, 3) == (0x3FC0, 0)  # 1.5
    assert from_words(single, [0x3FC0, 0]) == 3
    assert from_words(single, [0x7F80, 0]) == NOT_A_NUMBER  # infinite
    assert from_words(single, [0x4E80, 0]) == NOT_A_NUMBER  # 2**30: 2**31 counts
    assert from_words(single, [0x4E7F, 0xFFFF]) == (1 << 31) - 128
    with pytest.raises(ValueRefused, match="a float of 32 bits cannot hold it exactly"):
        to_words(parameter(type="float32"), (1 << 24) + 1)
    assert (hexadecimal(small, -1), hexadecimal(wide, 0x10237)) == ("16#FFFF", "16#00010237")
    assert [is_signed_type(each) for each in (small, wide, single, parameter())] == [
        True, True, True, False,
    ]  # fmt: skip


def test_set_bits_are_those_that_are_named_and_1() -> None:
    bits = parameter(bits=[{"bit": bit, "name": str(bit)} for bit in (0, 1, 4, 15)]).bits
    for word, names in ((0x8002, "1 15"), (0x0001, "0"), (0x0010, "4"), (0x7FEC, "")):
        assert " ".join(bit.name for bit in set_bits(bits, word)) == names


def test_text_is_the_bytes_of_its_words_in_their_order() -> None:
    text = parameter(type="ascii", words=3)
    raw = int.from_bytes(b"ATV71\0", "big")
    assert from_words(text, [0x4154, 0x5637, 0x3100]) == raw
    assert to_words(text, raw) == (0x4154, 0x5637, 0x3100)
    for held, shown in ((raw, "ATV71"), (0, "(empty)")):
        found = decode(text, held, {}, Decimal(1))
        assert (found.raw, found.number, found.display) == (held, None, shown)
