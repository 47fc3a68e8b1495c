"""Effect of a word from another program on a drive, by its profile alone."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.drive.foreign_write import (
    ALL,
    WordKind,
    classify_words,
    setting_refusal,
    stop_deciding_codes,
    value_refusal,
)
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

ATV71, ATV31, ATV21 = library.load("atv71"), library.load("atv31"), library.load("atv21")
POWERDRIVE = library.load("powerdrive")
DRIVECOM, IO, SERIES_8 = {"CHCF": 1}, {"CHCF": 3, "TCC": 0}, {"CHCF": 0}


def kind(profile: Profile, code: str, word: int, **raws: int) -> WordKind:
    (found,) = classify_words(profile, {profile[code].address: word}, raws)
    return found.kind


@pytest.mark.parametrize(
    ("profile", "code", "word", "raws"),
    [
        (ATV71, "CMD", 0x0000, {}),
        (ATV71, "CMD", 0x0007, DRIVECOM),
        (ATV71, "CMD", 0x0002, DRIVECOM),
        (ATV71, "CMD", 0x010F, {**DRIVECOM, "DOTD": 0, "ETA": 0x0237}),
        (ATV71, "CMD", 0x0000, IO),
        (ATV31, "CMD", 0x0007, {}),
        (ATV21, "FA00", 0xC000, {}),
        (ATV21, "FA00", 0xD000, {}),
        (ATV21, "FA00", 0xC003, {"FA00": 0xC403}),
        (POWERDRIVE, "6.42", 0x0000, {}),
    ],
)
def test_words_that_can_only_stop(
    profile: Profile, code: str, word: int, raws: dict[str, int]
) -> None:
    assert kind(profile, code, word, **raws) is WordKind.STOP


@pytest.mark.parametrize(
    ("profile", "code", "word", "raws"),
    [
        # what stops in one profile of the drive runs the motor in the other
        (ATV71, "CMD", 0x0007, {}),
        (ATV71, "CMD", 0x0007, IO),
        (ATV71, "CMD", 0x0002, IO),
        (ATV71, "CMD", 0x0000, SERIES_8),
        (ATV71, "CMD", 0x010F, DRIVECOM),
        (ATV71, "CMD", 0x010F, {**DRIVECOM, "DOTD": 1, "ETA": 0x0237}),
        (ATV71, "CMD", 0x010F, {**DRIVECOM, "DOTD": 0, "ETA": 0x0233}),
        (ATV71, "CMD", 0x000F, DRIVECOM),
        (ATV71, "CMI", 0x0000, DRIVECOM),
        (ATV71, "LFR", 0, DRIVECOM),
        (ATV21, "FA00", 0x0000, {}),
        (ATV21, "FA00", 0xC400, {}),
        (ATV21, "FA00", 0xC003, {}),
        (POWERDRIVE, "6.42", 0x0001, {}),
        (POWERDRIVE, "6.43", 0x0000, {}),
    ],
)
def test_words_that_may_do_something_else_are_commands(
    profile: Profile, code: str, word: int, raws: dict[str, int]
) -> None:
    assert kind(profile, code, word, **raws) is WordKind.COMMAND


@pytest.mark.parametrize("profile", [ATV71, ATV31, ATV21, POWERDRIVE])
def test_no_run_word_passes_as_a_stop(profile: Profile) -> None:
    for chart in profile.data.charts:
        for order in chart.orders:
            if order.id in ("forward", "reverse"):
                place = order.parameter or chart.command
                for word in order.words:
                    if word not in (0xC000, 0x0001):
                        assert kind(profile, place, word) is WordKind.COMMAND, (order.id, word)


def test_scanner_word_that_forwards_a_command_is_a_command() -> None:
    codes = [code for block in ATV71.data.blocks for code in block.values]
    assert codes
    written = [code for code in codes if ATV71[code].access != "r"]
    for code in written:
        assert kind(ATV71, code, 15) is WordKind.COMMAND


def test_setting_is_distinguished_from_an_unknown_word() -> None:
    assert kind(ATV71, "ACC", 30) is WordKind.SETTING
    assert kind(ATV71, "RFR", 30) is WordKind.UNKNOWN
    (found,) = classify_words(ATV71, {64000: 1}, {})
    assert found.kind is WordKind.UNKNOWN


def test_allow_all_excludes_control_and_line_settings() -> None:
    def refusal(code: str, *allowed: str) -> str:
        (found,) = classify_words(ATV71, {ATV71[code].address: 1}, {})
        assert found.kind is WordKind.SETTING
        return setting_refusal(ATV71, found, allowed)

    assert refusal("ACC", ALL) == ""
    assert refusal("ACC", "ACC", "DEC") == ""
    assert "not allowed" in refusal("ACC", "DEC")
    assert "not allowed" in refusal("ACC")
    assert "`all` does not allow" in refusal("CHCF", ALL)
    assert refusal("CHCF", "CHCF") == ""


def test_value_beyond_its_limits_is_refused() -> None:
    acc = ATV71["ACC"]
    assert value_refusal(ATV71, acc, {acc.address: 30}) == ""
    assert value_refusal(ATV71, acc, {acc.address: 60000})


@pytest.mark.parametrize(
    ("profile", "code", "word", "codes"),
    [
        (ATV71, "CMD", 0x0007, {"CHCF"}),
        (ATV71, "CMD", 0x010F, {"CHCF", "DOTD", "ETA"}),
        (ATV71, "CMD", 0x000F, set()),
        (ATV71, "LFR", 300, set()),
        (ATV31, "CMD", 0x0007, set()),
        (ATV21, "FA00", 0xC003, {"FA00"}),
        (POWERDRIVE, "6.42", 0x0001, {"10.40"}),
    ],
)
def test_few_words_are_read_before_stop(
    profile: Profile, code: str, word: int, codes: set[str]
) -> None:
    assert set(stop_deciding_codes(profile, {profile[code].address: word})) == codes


@given(
    word=st.sampled_from([0, 1, 2, 7, 0x0F, 0x010F, 0x080F, 0xC000, 0xC003, 0xC800, 0xD000]),
    profile=st.sampled_from([ATV71, ATV31, ATV21, POWERDRIVE]),
    values=st.lists(st.sampled_from([0, 1, 2, 3, 0x33, 0x37, 0xC403]), min_size=6, max_size=6),
)
def test_words_read_before_a_stop_decide(word: int, profile: Profile, values: list[int]) -> None:
    """Whatever else is known changes nothing."""
    charts = [chart for chart in profile.data.charts if chart.command]
    known = [code for chart in charts for code in (chart.status, chart.command)]
    names = dict.fromkeys([*known, "CHCF", "DOTD", "TCC", "RRS"])
    raws = dict(zip([name for name in names if profile.get(name)], values, strict=False))
    for chart in charts:
        words = {profile[chart.command].address: word}
        read = {code: raws[code] for code in stop_deciding_codes(profile, words)}
        assert classify_words(profile, words, raws) == classify_words(profile, words, read)
