"""The Altivar 21 profile against literal facts of its Modbus guide (1769688, 10/2009)."""

from __future__ import annotations

from decimal import Decimal

import pytest

from tui.drive.chart import read_chart
from tui.drive.errors import ValueRefused
from tui.drive.profile.library import load_file, matching_profiles, packaged_folder
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.read_plan import plan_reads
from tui.drive.settings.edits import Edits
from tui.drive.settings.limits import edit_problems
from tui.drive.settings.writable import write_refusal
from tui.drive.values import decode, encode
from tui.simulator.plant.monitoring import speed_from_frequency


@pytest.fixture(scope="module")
def profile() -> Profile:
    return load_file(packaged_folder() / "atv21.toml")


PLACES = [
    # code, wire address, scale, unit (sections 6, 8.2, 8.3)
    ("FA00", 0xFA00, "1", ""),
    ("FA20", 0xFA20, "1", ""),
    ("FA01", 0xFA01, "0.01", "Hz"),
    ("FA13", 0xFA13, "1", "rpm"),
    ("FA50", 0xFA50, "1", ""),
    ("FA51", 0xFA51, "1", ""),
    ("FD00", 0xFD00, "0.01", "Hz"),
    ("FD01", 0xFD01, "1", ""),
    ("FD06", 0xFD06, "1", ""),
    ("FE03", 0xFE03, "0.01", "%"),
    ("FE05", 0xFE05, "0.01", "%"),
    ("FE14", 0xFE14, "1", "h"),
    ("FE18", 0xFE18, "0.01", "%"),
    ("FE26", 0xFE26, "1", "%"),
    ("FE29", 0xFE29, "0.01", "kW"),
    ("FE46", 0xFE46, "1", ""),
    ("FE80", 0xFE80, "1", "h"),
    ("FE90", 0xFE90, "1", "rpm"),
    ("FB05", 0xFB05, "1", ""),
    ("FB72", 0xFB72, "1", ""),
    ("FC90", 0xFC90, "1", ""),
    ("FC91", 0xFC91, "1", ""),
    ("F800", 0x0800, "1", ""),
    ("F803", 0x0803, "1", "s"),
    ("F829", 0x0829, "1", ""),
    ("F879", 0x0879, "1", ""),
    ("ACC", 0x0009, "0.1", "s"),
    ("AU1", 0x0000, "1", ""),
]


@pytest.mark.parametrize(("code", "address", "scale", "unit"), PLACES)
def test_addresses_scales_and_units_match_the_manual(
    profile: Profile, code: str, address: int, scale: str, unit: str
) -> None:
    parameter = profile[code]
    assert (parameter.address, parameter.scale, parameter.unit) == (address, scale, unit)
    assert profile.find(f"16#{address:04X}") is parameter
    assert is_verified(parameter)


RANGES = [
    # code, min, max, factory, effective (sections 6.1, 6.3, 6.4, 8.1, 8.2)
    ("F829", 0, 4, 1, "after-reset"),
    ("F800", 0, 1, 1, "after-reset"),
    ("F801", 0, 2, 1, "after-reset"),
    ("F802", 1, 247, 1, "at-once"),
    ("F803", 0, 100, 3, "at-once"),
    ("F870", 0, 6, 0, "after-reset"),
    ("F875", 0, 11, 0, "after-reset"),
    ("ACC", 0, 32000, 100, "at-once"),
    ("AU1", 0, 2, 0, "at-once"),
    ("FA13", 0, 24000, 0, "at-once"),
    ("FA51", 0, 1023, 0, "at-once"),
]


@pytest.mark.parametrize(("code", "low", "high", "factory", "effective"), RANGES)
def test_ranges_and_factory_settings_match_the_manual(
    profile: Profile, code: str, low: int, high: int, factory: int, effective: str
) -> None:
    parameter = profile[code]
    found = (parameter.min, parameter.max, parameter.factory, parameter.effective)
    assert found == (low, high, factory, effective)


def test_acceleration_of_10_s_is_100_counts(profile: Profile) -> None:
    """The text of section 8.1 would have 1000 counts, which are 100 s."""
    acc = profile["ACC"]
    assert encode(acc, "10", profile.names(acc), Decimal(acc.scale)).raw == 100
    assert decode(acc, 1000, {}, Decimal(acc.scale)).display == "100.0 s"


def test_frequency_of_80_hz_is_16_1f40(profile: Profile) -> None:
    reference = profile["FA01"]
    assert encode(reference, "80 Hz", {}, Decimal(reference.scale)).raw == 0x1F40


ENUMERATIONS = [
    ("FE45", {0: "Terminals", 1: "Keypad", 2: "Serial link"}),
    (
        "FE46",
        {1: "VIA", 2: "VIB", 3: "Keypad", 4: "Serial link", 5: "+/- speed", 255: "Preset speed"},
    ),
    ("F800", {0: "9600", 1: "19200"}),
    ("F801", {0: "None", 1: "Even", 2: "Odd"}),
    ("CMOD", {0: "Terminals", 1: "Keypad", 2: "Serial link"}),
]


@pytest.mark.parametrize(("code", "names"), ENUMERATIONS)
def test_value_names_match_the_manual(profile: Profile, code: str, names: dict[int, str]) -> None:
    assert profile.names(profile[code]) == names


FAULTS = {
    0: "NErr", 1: "OC1", 2: "OC2", 3: "OC3", 4: "OCL", 5: "OCA", 8: "EPHI", 9: "EPHO",
    10: "OP1", 11: "OP2", 12: "OP3", 13: "OL1", 14: "OL2", 16: "OH", 17: "E", 18: "EEP1",
    19: "EEP2", 20: "EEP3", 21: "Err2", 22: "Err3", 23: "Err4", 24: "Err5", 26: "Err7",
    27: "Err8", 29: "UC", 30: "UP1", 32: "Ot", 34: "EF2", 37: "OC1P", 38: "OC2P", 39: "OC3P",
    41: "EtYP", 46: "OH2", 47: "SOUt", 50: "E-18", 51: "E-19", 52: "E-20", 53: "E-21",
    84: "Etn1",
}  # fmt: skip
"""Section 8.7; OL1 is 13 by the decimal column, its hexadecimal one is misprinted."""


def test_fault_codes_match_the_manual(profile: Profile) -> None:
    assert {fault.raw: fault.code for fault in profile.data.faults.codes} == FAULTS
    assert profile.names(profile["FE10"]) == FAULTS
    assert profile.data.faults.parameter == "FC90"
    assert profile.data.faults.history == ["FE10", "FE11", "FE12", "FE13"]


MODELS = [
    # code, class B, reference, voltage, power (section 8.9)
    (2, False, "", "200", "0.37/0.4"),
    (4, False, "ATV21H075M3X", "200", "0.75"),
    (108, False, "ATV21HD11M3X", "200", "11"),
    (112, False, "ATV21HD30M3X", "200", "30"),
    (41, False, "ATV21HU40N4", "400/460", "3.7/4"),
    (52, False, "ATV21HD75N4", "400/460", "75"),
    (136, False, "ATV21W075N4", "400/460", "0.75"),
    (136, True, "ATV21W075N4C", "400/460", "0.75"),
    (149, True, "ATV21WD37N4C", "400/460", "37"),
    (152, True, "ATV21WD75N4C", "400/460", "75"),
]


def test_model_codes_match_the_manual(profile: Profile) -> None:
    known = {
        (model.code, model.class_b): (model.reference, model.voltage, model.power_kw)
        for model in profile.data.identification.models
    }
    assert len(known) == len(profile.data.identification.models) == 64
    for code, class_b, *rating in MODELS:
        assert known[code, class_b] == tuple(rating)


def test_identification_matches_the_manual(profile: Profile) -> None:
    identification = profile.data.identification
    assert matching_profiles("ATV21H075M3X")[0] == "atv21"
    objects = [item.example for item in identification.objects]
    assert objects[1:] == ["ATV21H075M3X", "0201"]
    header, checksum = 8, 2
    frame = header + sum(2 + len(text) for text in objects) + checksum
    assert frame == 45, "section 7.9 gives the frame 45 bytes"
    assert not identification.exception_has_mei_byte


def test_functions_and_limits_match_the_manual(profile: Profile) -> None:
    found = {
        f.code: (f.max_read, f.max_write, f.broadcast, f.past_limit, f.past_limit_exception)
        for f in profile.data.functions
    }
    assert found == {
        3: (5, None, False, "exception", 3),
        6: (None, None, True, "exception", 3),
        16: (None, 2, True, "exception", 3),
        43: (None, None, False, "exception", 3),
    }
    assert profile.data.reading.single_words_only
    assert profile.data.reading.unknown_exception == 2
    assert [code.code for code in profile.data.exceptions] == [1, 2, 3, 4]


def test_blocks_match_the_manual(profile: Profile) -> None:
    read, write = profile.data.blocks
    assert (read.address, read.min_words, read.max_words) == (0x1875, 2, 5)
    assert (write.address, write.min_words, write.max_words) == (0x1870, 2, 2)
    assert read.fixed_start
    assert write.fixed_start
    assert {choice.raw: choice.parameter for choice in read.choices} == {
        1: "FD01", 2: "FD00", 3: "FE03", 4: "FE05", 5: "FC91", 6: "FE22", 7: "FD06", 8: "FD07",
        9: "FE35", 10: "FE36", 11: "FE90",
    }  # fmt: skip
    assert {choice.raw: choice.parameter for choice in write.choices} == {
        1: "FA00", 2: "FA20", 3: "FA01", 4: "FA50", 5: "FA51", 6: "FA13",
    }  # fmt: skip
    for block in profile.data.blocks:
        for slot in block.slots:
            named = {raw for raw in profile.names(profile[slot]) if raw}
            assert named == {choice.raw for choice in block.choices}


def test_manual_example_of_the_block_is_one_request(profile: Profile) -> None:
    """Section 7.5: F875..F879 = 1..5 give status, frequency, current, voltage and alarms."""
    codes = ["FD01", "FD00", "FE03", "FE05", "FC91"]
    slots = {f"F87{5 + place}": place + 1 for place in range(5)}
    (request,) = plan_reads(profile, codes, slots=slots).requests
    assert (request.address, request.count) == (0x1875, 5)
    assert len(plan_reads(profile, codes).requests) == 5, "without the block: one word each"


STATES = [
    # status word, state, direction, alarm, local (section 8.6)
    (0x6404, "running", "forward", True, False),  # printed in section 7.5
    (0x6600, "running", "reverse", False, False),
    (0x4000, "ready", "forward", False, False),
    (0xC000, "ready", "forward", False, True),
    (0x0000, "starting", "forward", False, False),
    (0x0003, "fault", "forward", False, False),
    (0x1002, "fault", "forward", False, False),
    (0x1000, "emergency", "forward", False, False),
    (0x4800, "coast", "forward", False, False),
    (0x4480, "braking", "forward", False, False),
    (0x000C, "undervoltage", "forward", True, False),
    (0x0004, "alarm-stop", "forward", True, False),
]


@pytest.mark.parametrize(("word", "state", "direction", "alarm", "local"), STATES)
def test_states_match_the_manual(
    profile: Profile, word: int, state: str, direction: str, alarm: bool, local: bool
) -> None:
    found = read_chart(profile, {"FD01": word})
    assert (found.state.id, found.direction, found.alarm, found.local) == (
        state,
        direction,
        alarm,
        local,
    )


def test_every_status_word_has_a_state(profile: Profile) -> None:
    assert all(read_chart(profile, {"FD01": word}).kind != "unknown" for word in range(0x10000))


COMMAND_BITS = {
    0: "Preset speed, bit 0", 6: "Ramp", 9: "Direction", 10: "Run", 11: "Coast stop",
    12: "Emergency stop", 13: "Fault reset", 14: "Reference priority of Modbus",
    15: "Command priority of Modbus",
}  # fmt: skip


def test_command_words_match_the_manual(profile: Profile) -> None:
    command = profile["FA00"]
    names = {bit.bit: bit.name for bit in command.bits}
    assert names.items() >= COMMAND_BITS.items()
    assert command.reserved == [3, 8]
    assert profile["FA20"].reserved == [0, *range(2, 12), 13, 14, 15]
    printed = {e.word for e in profile.data.command_examples if e.confidence == "manual"}
    assert printed == {0x0400, 0x0600, 0xC400, 0xC600}
    for word in ("16#0008", "16#C500"):
        with pytest.raises(ValueRefused, match="reserved bit"):
            encode(command, word, {}, Decimal(1))


def test_alarm_bits_match_the_manual(profile: Profile) -> None:
    alarms = {bit.bit for bit in profile["FC91"].bits if bit.alarm}
    assert alarms == {0, 1, 2, 3, 4, 5, 7, 8, 10, 13, 14, 15}
    assert [bit.bit for bit in profile["FE79"].bits] == [0, 1, 2, 3]


def test_only_command_and_reference_are_volatile(profile: Profile) -> None:
    """Section 8.2: everything else that can be written wears the EEPROM."""
    ram = {p.code for p in profile.parameters if p.access != "r" and p.storage == "ram"}
    assert ram == {"FA00", "FA20", "FA01", "FA13", "FA50", "FA51"}
    others = {p.storage for p in profile.parameters if p.access != "r" and p.code not in ram}
    assert others == {"eeprom"}


def test_speed_is_computed_as_in_the_manual(profile: Profile) -> None:
    formula = profile.data.monitoring.speed_from
    assert formula is not None
    assert (formula.frequency, formula.poles, formula.result) == ("FD00", "F856", "FE90")
    assert speed_from_frequency(6000, 4) == 1800


def test_communication_fault_matches_the_manual(profile: Profile) -> None:
    watch = profile.data.communication_fault
    assert watch is not None
    assert (watch.timeout, watch.off, watch.reaction, watch.fault) == ("F803", 0, "F603", 24)
    assert [(r.raw, r.trips) for r in watch.reactions] == [(0, True), (1, True), (2, True)]
    assert not watch.needs_write


@pytest.mark.parametrize("code", ["F829", "F603", "tyP"])
def test_parameters_that_must_never_be_written(profile: Profile, code: str) -> None:
    assert profile[code].forbidden


SURE_BY_NUMBER_ONLY = "FMSL FM vLv F171 F300 F856 FE70"


def test_uncertain_scale_is_raw_and_read_only(profile: Profile) -> None:
    for code in SURE_BY_NUMBER_ONLY.split():
        parameter = profile[code]
        assert not is_verified(parameter)
        assert (parameter.access, parameter.unit, parameter.scale) == ("r", "", "1")


SETTINGS = [
    # code, address, scale, unit, min, max, factory; of no document: each is confirmed by a person
    ("dEC", 0x0010, "0.1", "s", 0, 32000, 100),
    ("FH", 0x0011, "0.01", "Hz", 3000, 20000, 8000),
    ("LL", 0x0013, "0.01", "Hz", 0, None, 0),
    ("vL", 0x0014, "0.01", "Hz", 2500, 20000, 5000),
    ("tHr", 0x0600, "1", "%", 10, 100, 100),
    ("F415", 0x0415, "0.1", "A", 1, 2000, None),
    ("F417", 0x0417, "1", "rpm", 100, 15000, None),
    ("F500", 0x0500, "0.1", "s", 0, 32000, 200),
    ("F601", 0x0601, "1", "%", 10, 110, 110),
]


@pytest.mark.parametrize(("code", "address", "scale", "unit", "low", "high", "factory"), SETTINGS)
def test_settings_by_number_need_confirmation(
    profile: Profile,
    code: str,
    address: int,
    scale: str,
    unit: str,
    low: int | None,
    high: int | None,
    factory: int | None,
) -> None:
    parameter = profile[code]
    assert (parameter.address, parameter.scale, parameter.unit) == (address, scale, unit)
    assert (parameter.min, parameter.max, parameter.factory) == (low, high, factory)
    refusal = write_refusal(profile, parameter, "ready")
    assert refusal is not None
    assert refusal.reason == "unverified"
    assert write_refusal(profile, parameter, "ready", {code}) is None


def test_undocumented_setting_is_not_verified(profile: Profile) -> None:
    manual = "AU1 CMOD FMOD ACC F800 F801 F802 F803 F829 F870 F871 F875 F876 F877 F878 F879"
    settings = {p.code for p in profile.parameters if p.storage == "eeprom" and is_verified(p)}
    assert settings == set(manual.split())
    assert [profile[f"Sr{n}"].address for n in range(1, 8)] == [
        0x18, 0x19, 0x20, 0x21, 0x22, 0x23, 0x24,
    ]  # fmt: skip


def test_input_functions_are_named_and_unverified(profile: Profile) -> None:
    for code, factory in (("F111", "Forward"), ("F112", "Preset speed bit 1")):
        parameter = profile[code]
        assert not is_verified(parameter)
        assert parameter.access == "rw-stopped"
        assert profile.names(parameter)[38] == "Reference from F207"
        assert profile.names(parameter)[48] == "Forced local"
        assert parameter.factory is not None
        assert profile.names(parameter)[parameter.factory] == factory


def test_speed_limits_restrict_each_other(profile: Profile) -> None:
    raws = {"FH": 8000, "UL": 5000, "LL": 0, "FA01": 6000}
    past = Edits().stage(profile, "UL", "85 Hz", raws)
    assert "above FH = 80.00 Hz" in edit_problems(profile, past, raws)["UL"]
    # the reference of the line is not a setting: it limits none
    lower = Edits().stage(profile, "FH", "55 Hz", raws)
    assert edit_problems(profile, lower, raws) == {}


def test_link_settings_and_addresses_match_the_manual(profile: Profile) -> None:
    data = profile.data
    assert (data.link.baud, data.link.format, data.link.bauds) == (19200, "8E1", [9600, 19200])
    assert (data.addresses.first, data.addresses.last, data.addresses.broadcast) == (1, 247, 0)
    (rj45,) = data.connectors
    pins = {pin.pin: pin.signal for pin in rj45.pins}
    assert (pins["4"], pins["5"], pins["7"], pins["8"]) == ("D1", "D0", "24 V supply", "Common")
