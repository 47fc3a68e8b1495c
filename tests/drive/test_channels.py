"""Command and reference sources by all channel parameters of a family."""

from __future__ import annotations

from itertools import product

import pytest

from tui.drive.channel import channel_codes, command_channel, reference_channel, switch_texts
from tui.drive.chart import read_chart
from tui.drive.command_blocked import blocked_reason
from tui.drive.orders import chart_in_force
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

AI1, MODBUS = 1, 164
TERMINALS, LINE = 1, 10
FIRST, SECOND, LI4 = 96, 97, 132
CCS_FIRST, CCS_SECOND = 98, 99
COMBINED, SEPARATE = 1, 2
IDLE = {
    "LAC": 2, "ETA": 0x0240, "ETI": 0, "LRS3": 0, "CHCF": COMBINED, "COP": 0, "FLO": 0, "FLOC": 1,
    "rFC": FIRST, "Fr1": MODBUS, "Fr2": 0, "CCS": CCS_FIRST, "Cd1": TERMINALS, "Cd2": LINE,
}  # fmt: skip
"""An Altivar 31 or 312 after power-up, set up for Modbus; no word was written."""

COMBINED_CASES = {
    "first channel": ({}, "Modbus", "Modbus"),
    "second channel by its switch": (
        {"Fr1": AI1, "Fr2": MODBUS, "rFC": SECOND, "LRS3": 1}, "Modbus", "Modbus",
    ),
    "away by the switch": (
        {"Fr2": AI1, "rFC": SECOND, "LRS3": 1}, "Terminals", "Analog input AI1",
    ),
    "away by the switch, LRS3 late": (
        {"Fr2": AI1, "rFC": SECOND}, "Terminals", "Analog input AI1",
    ),
    "an input switches, and is 0": ({"Fr2": AI1, "rFC": LI4}, "Modbus", "Modbus"),
    "an input switches, and is 1": (
        {"Fr2": AI1, "rFC": LI4, "LRS3": 1}, "Terminals", "Analog input AI1",
    ),
    "CANopen": ({"Fr1": 167}, "CANopen", "CANopen"),
    "Cd1 does not count": ({"Cd1": LINE, "Fr1": AI1}, "Terminals", "Analog input AI1"),
}  # fmt: skip
SEPARATE_CASES = {
    "both by the line": ({"Cd1": LINE}, "Modbus", "Modbus"),
    "reference elsewhere": ({"Cd1": LINE, "Fr1": AI1}, "Modbus", "Analog input AI1"),
    "command elsewhere": ({}, "Terminals", "Modbus"),
    "second command channel": ({"CCS": CCS_SECOND, "LRS3": 2}, "Modbus", "Modbus"),
    "away by the switch": (
        {"Cd1": LINE, "Cd2": TERMINALS, "CCS": CCS_SECOND, "LRS3": 2}, "Terminals", "Modbus",
    ),
    "an input switches, and is 1": ({"CCS": LI4, "LRS3": 2}, "Modbus", "Modbus"),
    "an input switches, and is 0": ({"CCS": LI4}, "Terminals", "Modbus"),
}  # fmt: skip
CASES = [
    *(({"CHCF": COMBINED, **raws}, who, ref) for raws, who, ref in COMBINED_CASES.values()),
    *(({"CHCF": SEPARATE, **raws}, who, ref) for raws, who, ref in SEPARATE_CASES.values()),
]
NAMES = [
    *(f"combined: {case}" for case in COMBINED_CASES),
    *(f"separate: {case}" for case in SEPARATE_CASES),
]
SMALL = ["atv31", "atv312"]


def held(profile: Profile, raws: dict[str, int]) -> str:
    chart = chart_in_force(profile, raws)
    assert chart is not None
    found = blocked_reason(profile, chart, "forward", raws)
    return found.text if found else ""


@pytest.mark.parametrize("family", SMALL)
@pytest.mark.parametrize(("raws", "command", "reference"), CASES, ids=NAMES)
def test_channel_in_force_is_reported(
    family: str, raws: dict[str, int], command: str, reference: str
) -> None:
    profile, held_raws = library.load(family), IDLE | raws
    state = read_chart(profile, held_raws)
    assert (state.channel, state.reference) == (command, reference)
    refused = held(profile, held_raws)
    assert bool(refused) == (command != "Modbus"), refused
    if refused:
        assert refused.startswith("The drive is not commanded by Modbus: ")


@pytest.mark.parametrize("family", SMALL)
def test_allowed_and_refused_commands_never_contradict(family: str) -> None:
    profile = library.load(family)
    choices = product((1, 2), (AI1, MODBUS), (AI1, MODBUS), (FIRST, SECOND, LI4), (CCS_FIRST, LI4),
                      (TERMINALS, LINE), (TERMINALS, LINE), range(4), (0, 0x4000))  # fmt: skip
    codes = ("CHCF", "Fr1", "Fr2", "rFC", "CCS", "Cd1", "Cd2", "LRS3", "ETI")
    for values in choices:
        raws = IDLE | dict(zip(codes, values, strict=True))
        by_line = read_chart(profile, raws).channel == "Modbus"
        assert by_line == (held(profile, raws) == ""), raws


@pytest.mark.parametrize("family", SMALL)
def test_forced_local_overrides_every_channel(family: str) -> None:
    profile = library.load(family)
    raws = IDLE | {"ETA": 0x0040}
    assert read_chart(profile, raws).channel == "Terminals, forced local"
    assert "forced to local control" in held(profile, raws)


@pytest.mark.parametrize("family", SMALL)
def test_channels_below_access_level_3_are_reported_by_the_drive(family: str) -> None:
    profile = library.load(family)
    raws = IDLE | {"LAC": 0, "ETI": 0x4000, "Fr1": AI1}
    assert read_chart(profile, raws).channel == "Modbus"
    assert read_chart(profile, raws | {"ETI": 0}).channel == "Terminals or keypad"


@pytest.mark.parametrize("family", SMALL)
@pytest.mark.parametrize("code", ["LRS3", "rFC", "Fr1", "CHCF"])
def test_unread_word_that_decides_blocks_a_start(family: str, code: str) -> None:
    profile = library.load(family)
    raws = {c: raw for c, raw in (IDLE | {"rFC": LI4}).items() if c != code}
    found = command_channel(profile, raws)
    assert found is not None
    assert found.by_line is None
    says = "which selects the source of the drive's commands, was not read."
    assert held(profile, raws) == f"{code}, {says}"


@pytest.mark.parametrize(
    ("word", "who", "by_line"),
    [(0x08, "Modbus", True), (0x01, "Terminals", False), (0x40, "CANopen", False)],
)
@pytest.mark.parametrize("profile_id", [1, 2, 3])
def test_altivar_71_reports_its_channels(
    word: int, who: str, by_line: bool, profile_id: int
) -> None:
    profile = library.load("atv71")
    raws = {"CHCF": profile_id, "ETA": 0x0631, "CCC": word, "CRC": word, "FR1": MODBUS, "CD1": LINE}
    for found in (command_channel(profile, raws), reference_channel(profile, raws)):
        assert found is not None
        assert (found.text, found.by_line) == (who, by_line)
    assert (held(profile, raws) == "") == by_line


def test_possible_channel_changes_are_reported() -> None:
    profile = library.load("atv312")
    assert switch_texts(profile, IDLE) == []
    raws = IDLE | {"FLO": LI4, "rFC": 134, "CCS": LI4, "COP": 2}
    assert switch_texts(profile, raws) == [
        "FLO is Logic input LI4: while it is 1, the drive is forced to local control.",
        "rFC is Logic input LI6: it switches between Fr1 and Fr2.",
        "COP is Command: when the channel is switched, channel 2 takes it over.",
    ]
    assert any("Cd1 and Cd2" in text for text in switch_texts(profile, raws | {"CHCF": SEPARATE}))


def test_every_channel_parameter_of_the_manuals_is_used() -> None:
    small = {"CHCF", "COP", "rFC", "Fr1", "Fr2", "CCS", "Cd1", "Cd2", "FLO", "LRS3"}
    assert small <= set(channel_codes(library.load("atv31")))
    assert small <= set(channel_codes(library.load("atv312")))
    large = {"CCC", "CRC", "CHCF", "COP", "RFC", "RCB", "CCS", "FLO"}
    assert large <= set(channel_codes(library.load("atv71")))
