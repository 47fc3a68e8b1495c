"""Signal paths: the live source of command and reference, and the steps to make it this line."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import pytest

from tests.drive.test_channels import CASES, IDLE, NAMES, SMALL
from tui.drive.channel import command_channel, reference_channel
from tui.drive.profile import library
from tui.drive.signal_path import (
    Signal,
    path_codes,
    path_state,
    source_name,
    source_word,
    ways_to_line,
)

SIGNALS: tuple[Signal, ...] = ("reference", "command")
AI1, MODBUS, LI1, LI5 = 1, 164, 129, 133
ATV71 = {
    "CHCF": 1, "FR1": MODBUS, "FR2": AI1, "FR1B": 0, "RFC": 96, "RCB": 96, "CD1": 1, "CD2": 10,
    "CCS": 98, "FLO": 0, "FLOC": 1, "IL1R": 0, "LRS7": 0b0101, "CCC": 8, "CRC": 8,
    "LFR": 400, "CMD": 15, "AI1C": 3100,
}  # fmt: skip
AT_TERMINALS = {"CCC": 1, "CRC": 1}
ATV21 = {
    "CMOD": 0, "FMOD": 1, "F207": 2, "F111": 2, "F112": 6, "F113": 10, "FD06": 0, "FD01": 0x4000,
    "FA00": 0, "FA01": 0, "FE45": 0, "FE46": 1, "FE35": 0, "FE36": 0,
}  # fmt: skip
PX = {"6.43": 0, "6.42": 0}
SERIAL = {"FE45": 2, "FE46": 4}

Case = tuple[str, Mapping[str, int], str, str]
"""Family, values, and the sources of command and reference; empty if not known."""
LIVE: dict[str, Case] = {
    "atv71 combined": ("atv71", ATV71, "Modbus", "Modbus"),
    "atv71 combined, RFC at FR2": (
        "atv71", {**ATV71, **AT_TERMINALS, "RFC": 97}, "Terminals", "AI1",
    ),
    "atv71 combined, LI5 closed": (
        "atv71", {**ATV71, **AT_TERMINALS, "RFC": LI5, "LRS7": 0b0110}, "Terminals",
        "AI1",
    ),
    "atv71 combined, LI5 open": ("atv71", {**ATV71, "RFC": LI5}, "Modbus", "Modbus"),
    "atv71 separate": ("atv71", {**ATV71, "CHCF": 2, "CCC": 1}, "Terminals", "Modbus"),
    "atv71 separate, CCS at CD2": ("atv71", {**ATV71, "CHCF": 3, "CCS": 99}, "Modbus", "Modbus"),
    "atv71 separate, LI5 at CD2": (
        "atv71", {**ATV71, "CHCF": 2, "CCS": LI5, "LRS7": 0b1001}, "Modbus", "Modbus",
    ),
    "atv71 reference 1B": (
        "atv71", {**ATV71, "CHCF": 2, "CD1": 10, "FR1B": AI1, "RCB": LI5, "LRS7": 0b10101,
                  "CRC": 1},
        "Modbus", "AI1",
    ),
    "atv71 forced local": (
        "atv71", {**ATV71, **AT_TERMINALS, "FLO": LI1, "IL1R": 1}, "Terminals", "AI1",
    ),
    "atv71 forced local assigned": ("atv71", {**ATV71, "FLO": LI1, "IL1R": 2}, "Modbus", "Modbus"),
    "atv71 forced local by a card": ("atv71", {**ATV71, "FLO": 142}, "", ""),
    "atv71 contradicted": ("atv71", {**ATV71, **AT_TERMINALS}, "", ""),
    "atv71 8 series": ("atv71", {**ATV71, "CHCF": 0}, "", "Modbus"),
    "atv21 factory": ("atv21", ATV21, "Terminals", "VIA"),
    "atv21 network": ("atv21", {**ATV21, **SERIAL, "CMOD": 2, "FMOD": 4}, "Serial link",
                      "Serial link"),
    "atv21 priority bits": ("atv21", {**ATV21, **SERIAL, "FA00": 0xC000}, "Modbus",
                            "Modbus"),
    "atv21 one priority bit": ("atv21", {**ATV21, "FE45": 2, "FA00": 0x8000}, "Modbus", "VIA"),
    "atv21 input R forces local": (
        "atv21", {**ATV21, "F112": 48, "FD06": 2, "FA00": 0xC000}, "Terminals", "Terminals",
    ),
    "atv21 input R open": ("atv21", {**ATV21, **SERIAL, "F112": 48, "FA00": 0xC000}, "Modbus",
                           "Modbus"),
    "atv21 other input closed": (
        "atv21", {**ATV21, **SERIAL, "F112": 48, "FD06": 5, "FA00": 0xC000}, "Modbus",
        "Modbus",
    ),
    "atv21 reference F207": (
        "atv21", {**ATV21, "CMOD": 2, "FMOD": 4, "F112": 38, "FD06": 2, "FE45": 2, "FE46": 2},
        "Serial link", "VIB",
    ),
    "atv21 keypad": (
        "atv21", {**ATV21, "FD01": 0xC000, "FE45": 1, "FE46": 3, "FA00": 0xC000}, "Keypad",
        "Keypad",
    ),
    "atv21 contradicted": ("atv21", {**ATV21, **SERIAL}, "", ""),
    "powerdrive terminals": ("powerdrive", PX, "Terminals", ""),
    "proxidrive control word": ("proxidrive", {**PX, "6.43": 1}, "Control word", ""),
    "varmeca control word": ("varmeca", {**PX, "6.43": 1}, "Control word", ""),
}  # fmt: skip


def live(family: str, carries: Signal, raws: Mapping[str, int]) -> str:
    profile = library.load(family)
    state = path_state(profile, carries, raws)
    if state is None or state.live is None:
        return ""
    return source_name(profile, state.live, raws)


@pytest.mark.parametrize("case", LIVE)
def test_live_source_follows_the_diagram_of_the_manual(case: str) -> None:
    family, raws, command, reference = LIVE[case]
    assert live(family, "command", raws) == command
    assert live(family, "reference", raws) == reference


@pytest.mark.parametrize("case", LIVE)
def test_missing_value_never_lights_another_source(case: str) -> None:
    family, raws, command, reference = LIVE[case]
    for code in raws:
        left = {known: raw for known, raw in raws.items() if known != code}
        assert live(family, "command", left) in (command, ""), code
        assert live(family, "reference", left) in (reference, ""), code


@pytest.mark.parametrize("carries", SIGNALS)
@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "atv71", "powerdrive"])
def test_nothing_read_lights_nothing(family: str, carries: Signal) -> None:
    state = path_state(library.load(family), carries, {})
    if state is None:
        assert (family, carries) == ("powerdrive", "reference")
    else:
        assert state.live is None
        assert state.unknown.endswith("was not read")


@pytest.mark.parametrize("family", SMALL)
@pytest.mark.parametrize(("raws", "command", "reference"), CASES, ids=NAMES)
def test_live_source_is_the_channel_in_force(
    family: str, raws: Mapping[str, int], command: str, reference: str
) -> None:
    assert live(family, "command", {**IDLE, **raws}) == command
    assert live(family, "reference", {**IDLE, **raws}) == reference.removeprefix("Analog input ")


@pytest.mark.parametrize("family", SMALL)
def test_path_and_channel_never_contradict(family: str) -> None:
    profile = library.load(family)
    codes = ("LAC", "CHCF", "Fr1", "Fr2", "rFC", "CCS", "Cd1", "Cd2", "LRS3", "ETI", "ETA")
    choices = product((0, 2), (1, 2), (AI1, MODBUS), (AI1, MODBUS), (96, 97, 132), (98, 99, 132),
                      (1, 10), (1, 10), range(4), (0, 0x4000), (0x0040, 0x0240))  # fmt: skip
    for values in choices:
        raws = {**IDLE, **dict(zip(codes, values, strict=True))}
        channels = (reference_channel(profile, raws), command_channel(profile, raws))
        for carries, channel in zip(SIGNALS, channels, strict=True):
            state = path_state(profile, carries, raws)
            assert state is not None
            assert channel is not None
            if state.live is None:  # reference of access level L1, which no document describes
                assert raws["LAC"] == 0, raws
                assert raws["ETI"] == 0, raws
                assert carries == "reference", raws
            else:
                assert state.by_line is channel.by_line, raws


WAYS: dict[str, tuple[str, Mapping[str, int], Signal, list[str]]] = {
    "CD1": (
        "atv71", {**ATV71, "CHCF": 2, "CCC": 1}, "command",
        ["set CD1 to Modbus", "set CCS to Command channel 2"],
    ),
    "the input that sets CCS": (
        "atv71", {**ATV71, "CHCF": 2, "CCC": 1, "CCS": LI5}, "command",
        ["set CD1 to Modbus", "switch the input that sets CCS"],
    ),
    "forced local": (
        "atv71", {**ATV71, **AT_TERMINALS, "FLO": LI1, "IL1R": 1}, "reference",
        ["open LI1", "set FR2 to Modbus, set RFC to Reference channel 2 and open LI1"],
    ),
    "RFC back": (
        "atv71", {**ATV71, **AT_TERMINALS, "RFC": 97}, "command",
        ["set RFC to Reference channel 1", "set FR2 to Modbus"],
    ),
    "live already": ("atv71", ATV71, "command", []),
    "not known": ("atv71", {**ATV71, **AT_TERMINALS}, "command", []),
    "CMOD or a command": (
        "atv21", ATV21, "command",
        ["set CMOD to Serial link", "send a command"],
    ),
    "the key of the drive": (
        "atv21", {**ATV21, "FD01": 0xC000, "FE45": 1, "FA00": 0x8000}, "command",
        ["press LOC/REM on the drive",
         "set CMOD to Serial link, clear bit 15 of FA00 and press LOC/REM on the drive"],
    ),
    "6.43": (
        "powerdrive", PX, "command",
        ["press t on Monitor (while the drive is locked)"],
    ),
    "access level": ("atv31", {**IDLE, "LAC": 0, "ETA": 0x0240}, "command", []),
}  # fmt: skip


@pytest.mark.parametrize("case", WAYS)
def test_ways_to_this_line_name_the_fewest_steps_first(case: str) -> None:
    family, raws, carries, expected = WAYS[case]
    profile = library.load(family)
    state = path_state(profile, carries, raws)
    assert state is not None
    assert [way.text for way in ways_to_line(profile, state, raws)] == expected


def test_source_has_the_word_of_its_value() -> None:
    profile = library.load("atv71")
    state = path_state(profile, "reference", ATV71)
    assert state is not None
    assert state.live is not None
    assert source_word(state.live, ATV71) == "LFR"
    assert source_word(state.path.switches[0].other, ATV71) == "AI1C"
    assert {"LFR", "AI1C", "CMD", "RFC", "CCC", "IL1R"} <= set(path_codes(profile))


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "atv71", "powerdrive"])
def test_switch_is_named_by_its_parameter(family: str) -> None:
    for path in library.load(family).data.signal_paths:
        for switch in path.switches:
            assert switch.name.startswith(switch.parameter), (path.id, switch.name)
            sources = [path.first, *(switch.other for switch in path.switches)]
            assert any(source.is_line or source.line for source in sources), path.id
