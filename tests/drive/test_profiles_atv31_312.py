"""Facts of the Altivar 31 and 312 against the manuals, as literal figures."""

from __future__ import annotations

from decimal import Decimal

import pytest

from tui.drive.chart import state_of
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.values import encode


@pytest.fixture(params=["atv31", "atv312"])
def profile(request: pytest.FixtureRequest) -> Profile:
    return library.load(request.param)


@pytest.mark.parametrize(
    ("code", "address", "kind", "scale", "unit"),
    [
        ("SFr", 3102, "uint16", "0.1", "kHz"),
        ("tFr", 3103, "uint16", "0.1", "Hz"),
        ("HSP", 3104, "uint16", "0.1", "Hz"),
        ("LSP", 3105, "uint16", "0.1", "Hz"),
        ("ETA", 3201, "uint16", "1", ""),
        ("rFr", 3202, "int16", "0.1", "Hz"),
        ("FrH", 3203, "uint16", "0.1", "Hz"),
        ("LCr", 3204, "uint16", "0.1", "A"),
        ("Otr", 3205, "int16", "1", "%"),
        ("OPr", 3211, "int16", "1", "%"),
        ("CMD", 8501, "uint16", "1", ""),
        ("LFr", 8502, "int16", "0.1", "Hz"),
        ("LFRD", 8602, "int16", "1", "rpm"),
        ("FRHD", 8605, "uint16", "1", "rpm"),
        ("ACC", 9001, "uint16", "0.1", "s"),
        ("dEC", 9002, "uint16", "0.1", "s"),
        ("bEn", 10003, "int16", "0.1", "Hz"),
        ("ttO", 6005, "uint16", "0.1", "s"),
    ],
)
def test_words_match_the_manual(
    profile: Profile, code: str, address: int, kind: str, scale: str, unit: str
) -> None:
    parameter = profile[code]
    assert (parameter.address, parameter.type) == (address, kind)
    assert (parameter.scale, parameter.unit) == (scale, unit)
    assert parameter.number == f"W{address}"


def test_limits_of_functions_match_the_manual(profile: Profile) -> None:
    functions = {f.code: f for f in profile.data.functions}
    assert set(functions) == {3, 6, 16, 43}
    assert (functions[3].max_read, functions[16].max_write) == (29, 27)
    assert {code for code, f in functions.items() if f.broadcast} == {6, 16}


def test_link_settings_match_the_manual(profile: Profile) -> None:
    link = profile.data.link
    assert (link.baud, link.format) == (19200, "8E1")
    choices = {s.role: {c.raw: c.baud or c.format for c in s.choices} for s in link.settings}
    assert choices["baud"] == {24: 4800, 28: 9600, 32: 19200}
    assert choices["format"] == {2: "8O1", 3: "8E1", 4: "8N1", 5: "8N2"}


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (0x0240, "disabled"),
        (0x0260, "disabled"),
        (0x0221, "ready"),
        (0x0223, "switched-on"),
        (0x0627, "enabled"),
        (0x8227, "enabled"),
        (0x0207, "quick-stop"),
        (0x000F, "fault-reaction"),
        (0x0228, "fault"),
        (0x0208, "fault"),
    ],
)
def test_states_match_the_manual(profile: Profile, word: int, state: str) -> None:
    chart = profile.chart({})
    assert chart is not None
    assert state_of(chart, {chart.status: word}).id == state


def test_ramps_follow_the_increment(profile: Profile) -> None:
    for code in ("ACC", "dEC", "AC2", "dE2"):
        scales = [profile.scale(profile[code], {"Inr": raw}) for raw in (0, 1, 2)]
        assert scales == [Decimal("0.01"), Decimal("0.1"), Decimal(1)]
        assert profile.scale(profile[code], {}) is None


def test_old_altivar_31_counts_ramps_in_tenths() -> None:
    older = library.load("atv31")
    assert older.scale(older["ACC"], {}, absent={"Inr"}) == Decimal("0.1")
    newer = library.load("atv312")
    assert newer.scale(newer["ACC"], {}, absent={"Inr"}) is None


def test_reactions_are_the_values_of_the_parameter(profile: Profile) -> None:
    watch = profile.data.communication_fault
    assert watch is not None
    assert {r.raw for r in watch.reactions} == set(profile.names(profile["SLL"])) == {0, 1, 6, 7}
    assert [r.raw for r in watch.reactions if r.motor_keeps_running] == [0]


def test_faults_match_the_manual(profile: Profile) -> None:
    codes = {f.raw: f.code for f in profile.data.faults.codes}
    assert codes[0] == "nOF"
    assert codes[5] == "SLF"
    assert codes[18] == "ObF"
    assert codes[9] == codes[23] == codes[31] == "OCF"
    assert profile.names(profile["DP1"]) == profile.names(profile["LFt"])


def test_unconfirmed_facts_are_marked() -> None:
    older = library.load("atv31")
    assert older["rFr"].confidence == "public"
    assert older["CMI"].confidence == "analogy"
    assert older["HSP"].confidence == "manual+public"
    assert library.load("atv312")["ACC"].confidence == "public"


def test_access_code_is_never_shown(profile: Profile) -> None:
    assert profile["COd"].forbidden
    assert 14 in profile["CMI"].reserved


@pytest.mark.parametrize(
    ("code", "typed"),
    [("UnS", "400 V"), ("nCr", "22.5 A"), ("ItH", "22.5 A"), ("Ctd", "22.5 A"), ("SdC1", "9.0 A"),
     ("CLI", "30.0 A"), ("HSP", "60.0 Hz"), ("tdC1", "0.5 s")],
)  # fmt: skip
def test_inputs_of_a_large_drive_can_be_typed(profile: Profile, code: str, typed: str) -> None:
    parameter = profile[code]
    scale = profile.scale(parameter, {})
    assert encode(parameter, typed, profile.names(parameter), scale).rounded is False


def test_access_level_warns(profile: Profile) -> None:
    assert "starts the motor immediately" in profile["LAC"].note


def test_value_names_are_those_of_the_family() -> None:
    """Sister families name other things with the same raw values."""
    profile = library.load("atv312")
    names = {code: profile.names(profile[code]) for code in ("NCV", "VCAL", "dO", "LAC", "IPL")}
    assert (names["NCV"][1], names["NCV"][13]) == ("0.18 kW", "15 kW")
    assert names["VCAL"][3] == "380-500 V, 3 phases"
    assert (names["dO"][129], names["dO"][1]) == ("Motor current", "Drive fault")
    assert list(names["LAC"].values()) == ["L1", "L2", "L3"]
    assert names["IPL"][1] == "Fast stop"


def test_reactions_have_their_keypad_names(profile: Profile) -> None:
    watch = profile.data.communication_fault
    assert watch is not None
    found = {r.raw: (r.code, r.name) for r in watch.reactions}
    assert found == {
        0: ("nO", "Ignored"),
        1: ("YES", "Freewheel"),
        6: ("rMP", "Ramp stop"),
        7: ("FSt", "Fast stop"),
    }
