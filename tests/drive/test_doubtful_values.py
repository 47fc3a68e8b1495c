"""Values of which the manuals do not say whether they have a sign."""

from __future__ import annotations

import pytest

from tui.cli.shared.output import value_field
from tui.drive.profile import library
from tui.drive.shown import shown
from tui.drive.values import from_words
from tui.session.reading import Reading
from tui.session.shown import Quality


@pytest.mark.parametrize("family", ["atv31", "atv312"])
@pytest.mark.parametrize("code", ["Otr", "OPr"])
@pytest.mark.parametrize(("word", "text"), [(63536, "-2000 %"), (0xFFFF, "-1 %"), (85, "85 %")])
def test_regenerated_torque_and_power_are_negative(
    family: str, code: str, word: int, text: str
) -> None:
    profile = library.load(family)
    parameter = profile[code]
    assert shown(profile, parameter, from_words(parameter, [word]), {}).display == text


@pytest.mark.parametrize("code", ["FE18", "FE20", "FE21"])
@pytest.mark.parametrize(("word", "text"), [(32767, "327.67"), (32768, "327.68?"), (0, "0.00")])
def test_value_above_32767_is_marked(code: str, word: int, text: str) -> None:
    profile = library.load("atv21")
    parameter = profile[code]
    value = shown(profile, parameter, from_words(parameter, [word]), {})
    assert value.text == text
    assert value.unsure == text.endswith("?")
    reported = value_field(Reading(parameter, word, value, Quality.GOOD, 0.0))
    assert reported.text == text
    assert (reported.unsure is True) == value.unsure
