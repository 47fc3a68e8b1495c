"""Units other than that of a parameter, and values that rounding changes."""

from __future__ import annotations

from decimal import Decimal

import pytest

from tui.drive.errors import ValueRefused
from tui.drive.profile import library
from tui.drive.settings.edits import Edits
from tui.drive.units import KINDS, factor_between
from tui.drive.values import encode

ATV312 = library.load("atv312")
TENTH = Decimal("0.1")


@pytest.mark.parametrize(
    ("code", "typed", "raw"),
    [
        ("ACC", "3500ms", 35),
        ("ACC", "3500 ms", 35),
        ("ACC", "3,5 s", 35),
        ("ACC", "3.5S", 35),
        ("ACC", "2min", 1200),
        ("ACC", "1 500 ms", 15),
        ("HSP", "0.05kHz", 500),
        ("HSP", "0,05 khz", 500),
        ("ItH", "5000mA", 50),
    ],
)
def test_unit_of_the_same_kind_is_understood(code: str, typed: str, raw: int) -> None:
    assert encode(ATV312[code], typed, {}, TENTH).raw == raw


@pytest.mark.parametrize("typed", ["5Hz", "5 %", "ms", "5 parsecs", "5 m", "0.05 MHz", "3.5s s"])
def test_unit_of_another_kind_is_refused(typed: str) -> None:
    with pytest.raises(ValueRefused, match="is not a number in s"):
        encode(ATV312["ACC"], typed, {}, TENTH)


def test_number_without_a_unit_is_not_converted() -> None:
    bare = next(p for p in ATV312.parameters if not p.unit and not ATV312.names(p) and not p.bits)
    with pytest.raises(ValueRefused):
        encode(bare, "5 s", {}, Decimal(1))


def test_no_two_units_of_a_kind_differ_by_capitals_alone() -> None:
    for kind in KINDS:
        assert len({unit.casefold() for unit in kind}) == len(kind)
        for text in kind:
            for other in kind:
                there, back = factor_between(text, other), factor_between(other, text)
                assert there is not None
                assert back is not None
                assert abs(there * back - 1) < Decimal("1e-20")


def test_every_unit_of_the_profiles_is_known() -> None:
    for listing in library.listings():
        for parameter in library.load(listing.id).parameters:
            assert factor_between(parameter.unit, parameter.unit) == 1


@pytest.mark.parametrize(
    ("typed", "rounded", "lossy"),
    [
        ("0.04", True, True),  # becomes 0
        ("0.00004kHz", True, True),
        ("0", False, False),
        ("3.55", True, True),  # 3.5 and 3.6 are as near
        ("3.56", True, False),
        ("3.54", True, False),
        ("3.5", False, False),
    ],
)
def test_values_changed_by_rounding(typed: str, rounded: bool, lossy: bool) -> None:
    found = encode(ATV312["LSP"], typed, {}, TENTH)
    assert (found.rounded, found.lossy) == (rounded, lossy)


def test_edit_reports_its_rounded_value() -> None:
    held = {"LSP": 0, "HSP": 500, "TFR": 600}
    (edit,) = Edits().stage(ATV312, "LSP", "0.04 Hz", {**held, "LSP": 100})
    assert edit.loss == "LSP: 0.04 Hz would be rounded to 0.0 Hz"
    (edit,) = Edits().stage(ATV312, "LSP", "3.56 Hz", held)
    assert edit.loss == ""
