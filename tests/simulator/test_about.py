"""Sources of the simulated behavior, and statements of it that no other test covers."""

from __future__ import annotations

import pytest

from tui.drive.profile.library import load
from tui.simulator.about import BY_CHART, EVERY, Behavior, behaviors_of, guessed_codes
from tui.simulator.rules import TRAITS

from .exchange import Exchange


@pytest.mark.parametrize("family", TRAITS)
def test_every_family_has_behavior_of_its_own_with_a_source(family: str) -> None:
    found = behaviors_of(load(family))
    assert len(found) > len(EVERY)
    assert all(item.text and item.source for item in found)


def test_behavior_of_one_family_is_not_shown_for_another() -> None:
    def texts(family: str) -> str:
        return " ".join(item.text for item in behaviors_of(load(family)))

    assert "30 s" in texts("atv312")
    assert "30 s" not in texts("atv71")
    assert "FA50" not in texts("atv312")


@pytest.mark.parametrize("family", TRAITS)
def test_values_of_guesses_exist(family: str) -> None:
    profile = load(family)
    codes = guessed_codes(profile)
    assert codes == {code for code in codes if profile.get(code) is not None}
    thermal = profile.quantity("motor_thermal")
    assert thermal is None or thermal.code in codes
    printed = profile.quantity("output_frequency")
    assert printed is None or printed.code not in codes


def test_every_guess_of_a_value_names_one_that_exists() -> None:
    rows = [row for rows in (EVERY, *BY_CHART.values()) for row in rows]
    profiles = [load(family) for family in TRAITS]
    known = {p.code for profile in profiles for p in profile.parameters}
    known |= {p.quantity for profile in profiles for p in profile.parameters if p.quantity}
    assert {mark for row in rows for mark in row.shows_in} <= known
    assert all(row.provenance == "guess" for row in rows if row.shows_in)


def test_named_families_exist() -> None:
    rows: list[Behavior] = [row for rows in BY_CHART.values() for row in rows]
    assert {family for row in rows for family in row.families} <= TRAITS.keys()


def test_reserved_bits_of_fa50_are_kept_without_effect() -> None:
    played = Exchange("atv21", sets={"F130": 38})
    played.play("""
        > 02 06 FA50 00FE
        < 02 06 FA50 00FE
        > 02 03 FA50 0001
        < 02 03 02 00FE
        > 02 03 FD07 0001
        < 02 03 02 0000
        > 02 06 FA50 00FF
        > 02 03 FD07 0001
        < 02 03 02 0001
        > 02 06 FA50 0100
        < 02 86 03
    """)


def test_raw_250_of_15_07_is_25_s() -> None:
    played = Exchange("powerdrive", sets={"15.07": 250})
    played.play("> 02 03 0001 0001")
    played.wait(24)
    assert played.drive.fault is None
    played.wait(1.5)
    assert played.drive.fault is not None


def test_timeout_of_an_altivar_312_is_accepted_up_to_10_s() -> None:
    played = Exchange("atv312")
    played.play("""
        > 02 06 1775 0064
        < 02 06 1775 0064
        > 02 06 1775 0065
        < 02 86 03
    """)
