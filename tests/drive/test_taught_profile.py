"""Profile of one drive: that of its family, with learned scales."""

from __future__ import annotations

from decimal import Decimal

import pytest

from tui.drive.control_source import control_taking
from tui.drive.orders import choose, locked_by
from tui.drive.profile import library
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.settings.factory import not_factory
from tui.drive.settings.writable import is_setting, write_refusal
from tui.drive.shown import shown, typed_text
from tui.drive.taught_profile import teachable_codes, why_not_taught, with_taught
from tui.drive.teaching import TaughtScale

LEROY_SOMER = ("powerdrive", "proxidrive", "varmeca")
RPM = TaughtScale(Decimal(1), "rpm", None)
HERTZ = TaughtScale(Decimal("0.1"), "Hz", True)


@pytest.fixture(params=LEROY_SOMER)
def family(request: pytest.FixtureRequest) -> Profile:
    return library.load(str(request.param))


def test_scale_of_every_leroy_somer_measurement_can_be_learned(family: Profile) -> None:
    assert {"1.06", "1.21", "4.01", "5.01", "5.02"} <= {*teachable_codes(family)}
    for code in ("6.42", "10.40", "6.43", "15.07", "10.01"):
        assert why_not_taught(family, code), code


@pytest.mark.parametrize("id", ["atv21", "atv31", "atv312", "atv71"])
def test_known_scale_of_a_family_cannot_be_learned(id: str) -> None:
    family = library.load(id)
    reported = [p for p in family.parameters if p.unit or p.values or p.bits or p.scale != "1"]
    assert reported
    assert not {p.code for p in reported} & {*teachable_codes(family)}
    written = [p for p in family.parameters if p.access != "r" and is_verified(p)]
    assert not {p.code for p in written} & {*teachable_codes(family)}, "no measurements"


def test_value_with_a_learned_scale_has_its_sign_and_mark(family: Profile) -> None:
    own = with_taught(family, {"5.01": HERTZ, "1.21": RPM})
    value = shown(own, own["5.01"], 65236, {})
    assert (value.display, value.taught) == ("-30.0 Hz", True)
    # code that still has the family's parameter gets the same result
    assert shown(own, family["5.01"], 65236, {}) == value
    assert typed_text(own, own["5.01"], 300, {}) == "30.0"
    unsure = shown(own, own["1.21"], 65236, {})
    assert (unsure.display, unsure.taught) == ("65236 raw", False)
    assert not shown(own, own["4.01"], 84, {}).taught
    assert not shown(family, family["5.01"], 300, {}).taught


def test_value_with_a_learned_scale_stays_read_only(family: Profile) -> None:
    own = with_taught(family, {"1.21": RPM}, "1.21")
    refused = write_refusal(own, own["1.21"], "ready", ("1.21",))
    assert refused is not None
    assert refused.reason == "read-only"
    assert not is_setting(own, own["1.21"])
    assert not not_factory(own, own["1.21"], {"1.21": 900})


def test_only_run_commands_select_the_confirmed_reference(
    family: Profile,
) -> None:
    own = with_taught(family, {"1.21": RPM}, "1.21")
    raws = {"10.40": 1, "6.43": 1}
    (before,), (after,) = family.data.charts, own.data.charts
    for order, word in (("forward", 0x0103), ("reverse", 0x0109)):
        assert choose(after, order, raws).words == [word]  # type: ignore[arg-type]
    rest = [item for item in after.orders if item.id not in ("forward", "reverse")]
    assert rest == [item for item in before.orders if item.id not in ("forward", "reverse")]
    assert own.quantity("command_speed") == own["1.21"]
    assert own.quantity("command_frequency") is None


@pytest.mark.parametrize("unit", ["", "%", "A"])
def test_preset_in_another_unit_accepts_no_reference(family: Profile, unit: str) -> None:
    own = with_taught(family, {"1.21": TaughtScale(Decimal(1), unit, None)}, "1.21")
    assert own.quantity("command_speed") is None
    assert own.data.charts == family.data.charts


def test_profile_without_learned_scales_is_unchanged(family: Profile) -> None:
    assert with_taught(family, {}) is family
    assert with_taught(family, {"NOSUCH": HERTZ, "10.40": HERTZ}, "1.21") is family


def test_control_source_is_line_terminals_or_unknown(family: Profile) -> None:
    unknown, line, terminals = (
        control_taking(family, raws) for raws in ({}, {"6.43": 1}, {"6.43": 0})
    )
    for found in (unknown, line, terminals):
        assert found is not None
        assert found.can_take
        assert found.can_give_back
    taken = [found.taken for found in (unknown, line, terminals) if found is not None]
    assert taken == [None, True, False]
    assert control_taking(library.load("atv71"), {}) is None


@pytest.mark.parametrize(
    ("word", "holds"), [(0, False), (1, False), (3, True), (9, True), (0x20, True)]
)
def test_control_is_not_taken_while_a_run_command_waits(
    family: Profile, word: int, holds: bool
) -> None:
    (chart,) = family.data.charts
    assert (locked_by(chart, "take-control", {"6.42": word}) is not None) is holds
    assert locked_by(chart, "forward", {"6.42": word}) is None
    assert locked_by(chart, "hand-back", {"6.42": word}) is None
