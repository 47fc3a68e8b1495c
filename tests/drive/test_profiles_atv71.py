"""Facts of the Altivar 71 profile, written out from its documents."""

from __future__ import annotations

import pytest

from tui.drive.chart import UNKNOWN, read_chart, state_of
from tui.drive.errors import ValueRefused
from tui.drive.profile.library import load_file, matching_profiles, packaged_folder
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import Chart, Erratum
from tui.drive.values import check_raw, decode, encode, from_words, raw_range


@pytest.fixture(scope="module")
def atv71() -> Profile:
    return load_file(packaged_folder() / "atv71.toml")


def chart_of(profile: Profile, chart_id: str) -> Chart:
    return next(chart for chart in profile.data.charts if chart.id == chart_id)


def shown(profile: Profile, code: str, raw: int, **others: int) -> str:
    parameter = profile[code]
    return decode(
        parameter, raw, profile.names(parameter), profile.scale(parameter, others)
    ).display


def test_profile_has_every_parameter_of_the_standard_drive(atv71: Profile) -> None:
    assert len(atv71.parameters) == 806
    assert len({p.address for p in atv71.parameters}) == 806


@pytest.mark.parametrize(
    "address",
    [3113, 6063, 6665, 6690, 6692, 7140, 9117, 9217, 9676, 9690, 9697, 11507, 15607, 64280],
)
def test_words_of_specification_383_only_are_omitted(atv71: Profile, address: int) -> None:
    assert atv71.at(address) is None


@pytest.mark.parametrize(
    ("code", "address", "kind", "unit", "scale", "access"),
    [
        ("SFR", 3102, "uint16", "kHz", "0.1", "rw"),
        ("TFR", 3103, "uint16", "Hz", "0.1", "rw-stopped"),
        ("HSP", 3104, "uint16", "Hz", "0.1", "rw"),
        ("LSP", 3105, "uint16", "Hz", "0.1", "rw"),
        ("ETA", 3201, "uint16", "", "1", "r"),
        ("RFR", 3202, "int16", "Hz", "0.1", "r"),
        ("FRH", 3203, "int16", "Hz", "0.1", "r"),
        ("LCR", 3204, "uint16", "A", "0.1", "r"),
        ("OTR", 3205, "int16", "%", "0.1", "r"),
        ("ETI", 3206, "uint16", "", "1", "r"),
        ("ULN", 3207, "uint16", "V", "0.1", "r"),
        ("UOP", 3208, "uint16", "V", "1", "r"),
        ("THD", 3209, "uint16", "%", "1", "r"),
        ("OPR", 3211, "int16", "%", "1", "r"),
        ("AI1C", 5242, "int16", "V", "0.001", "r"),
        ("M1CT", 6011, "uint16", "", "1", "r"),
        ("M1EC", 6010, "uint16", "", "1", "r"),
        ("M2CT", 6031, "uint16", "", "1", "r"),
        ("M2EC", 6030, "uint16", "", "1", "r"),
        ("LFT", 7121, "uint16", "", "1", "r"),
        ("CNF", 7132, "uint16", "", "1", "r"),
        ("CHCF", 8401, "uint16", "", "1", "rw-stopped"),
        ("COP", 8402, "uint16", "", "1", "rw-stopped"),
        ("CMD", 8501, "uint16", "", "1", "rw"),
        ("LFR", 8502, "int16", "Hz", "0.1", "rw"),
        ("CMI", 8504, "uint16", "", "1", "rw"),
        ("CMDD", 8601, "uint16", "", "1", "rw"),
        ("LFRD", 8602, "int16", "rpm", "1", "rw"),
        ("ETAD", 8603, "uint16", "", "1", "r"),
        ("RFRD", 8604, "int16", "rpm", "1", "r"),
        ("SMAL", 8609, "uint32", "rpm", "1", "rw"),
        ("ACC", 9001, "uint16", "s", "0.1", "rw"),
        ("DEC", 9002, "uint16", "s", "0.1", "rw"),
        ("INR", 9020, "uint16", "", "1", "rw"),
        ("THR", 9630, "uint16", "%", "1", "r"),
        ("ITH", 9622, "uint16", "A", "0.1", "rw"),
        ("LFF", 7080, "uint16", "Hz", "0.1", "rw-stopped"),
        ("STO", 9241, "uint16", "ms", "1", "rw"),
        ("NLS", 12511, "uint16", "m/s", "0.01", "rw-stopped"),
    ],
)
def test_words_match_the_manual(
    atv71: Profile, code: str, address: int, kind: str, unit: str, scale: str, access: str
) -> None:
    parameter = atv71[code]
    assert parameter.address == address
    assert parameter.number == f"W{address}"
    assert (parameter.type, parameter.unit, parameter.scale) == (kind, unit, scale)
    assert parameter.access == access


@pytest.mark.parametrize(
    ("code", "low", "high", "factory"),
    [
        ("TFR", 100, 16000, 600),
        ("HSP", 0, 16000, 500),
        ("SFR", 10, 160, None),
        ("TTO", 1, 300, 100),
        ("ADD", 0, 247, 0),
        ("AMOA", 0, 247, 0),
        ("AMOC", 0, 247, 0),
        ("SP2", 0, 16000, 100),
        ("SP16", 0, 16000, 1000),
        ("TDC1", 1, 300, 5),
        ("LTR", -3000, 3000, 0),
        ("LFR", -32767, 32767, 0),
        ("UNS", 100, 480, None),
        ("VBR", 305, 785, None),
        ("DCF", 0, 10, 4),
        ("NLS", 20, 500, 100),
    ],
)
def test_ranges_and_factory_settings_match_the_manual(
    atv71: Profile, code: str, low: int, high: int, factory: int | None
) -> None:
    assert raw_range(atv71[code]) == (low, high)
    assert atv71[code].factory == factory


@pytest.mark.parametrize(
    ("code", "factory"),
    [
        ("CHCF", 1),
        ("INR", 1),
        ("SLL", 1),
        ("STT", 0),
        ("CD1", 1),
        ("CD2", 10),
        ("TBR", 32),
        ("TFO", 3),
        ("R1", 1),
        ("DOTD", 1),
        ("QSTD", 6),
        ("THT", 1),
    ],
)
def test_factory_settings_of_enumerations_match_the_manual(
    atv71: Profile, code: str, factory: int
) -> None:
    assert atv71[code].factory == factory


@pytest.mark.parametrize(
    ("code", "raw", "others", "text"),
    [
        ("SFR", 0x0028, {}, "4.0 kHz"),
        ("TFR", 0x0258, {}, "60.0 Hz"),
        ("HSP", 0x01F4, {}, "50.0 Hz"),
        ("LSP", 0x0000, {}, "0.0 Hz"),
        ("OTR", 725, {}, "72.5 %"),
        ("OTR", -725, {}, "-72.5 %"),
        ("ULN", 0x00F0, {}, "24.0 V"),
        ("ACC", 13, {"INR": 1}, "1.3 s"),
        ("ACC", 13, {"INR": 2}, "13 s"),
        ("ACC", 13, {"INR": 0}, "0.13 s"),
        ("ACC", 13, {}, "13 raw"),
        ("NSP", 145, {"INSP": 10}, "1450 rpm"),
        ("TLIM", 1500, {"INTP": 1}, "150.0 %"),
        ("ADD", 0, {}, "Off"),
        ("ADD", 12, {}, "12"),
        ("CHCF", 3, {}, "I/O profile"),
        ("FR1", 164, {}, "Modbus"),
        ("FR2", 164, {}, "Modbus"),
        ("CD1", 10, {}, "Modbus"),
        ("RRS", 130, {}, "Logic input LI2"),
        ("RRS", 171, {}, "Command bit 11 (CD11)"),
        ("LFT", 5, {}, "Modbus communication"),
        ("ETA", 0x8637, {}, "16#8637"),
    ],
)
def test_raw_values_have_names(
    atv71: Profile, code: str, raw: int, others: dict[str, int], text: str
) -> None:
    assert shown(atv71, code, raw, **others) == text


def test_low_word_of_a_long_value_comes_first(atv71: Profile) -> None:
    assert from_words(atv71["SMAL"], [0x0001, 0x0000]) == 1


def test_ramps_follow_their_increment(atv71: Profile) -> None:
    for code in ("ACC", "DEC", "AC2", "DE2"):
        follows = atv71[code].scale_by
        assert follows is not None
        assert follows.parameter == "INR"
        assert follows.scales == {"0": "0.01", "1": "0.1", "2": "1"}


# Link, functions, reading


def test_link_settings_and_addresses_match_the_manual(atv71: Profile) -> None:
    link = atv71.data.link
    assert (link.baud, link.format) == (19200, "8E1")
    assert link.bauds == [4800, 9600, 19200, 38400]
    assert link.formats == ["8O1", "8E1", "8N1", "8N2"]
    bauds = {c.raw: c.baud for s in link.settings if s.parameter == "TBR" for c in s.choices}
    assert bauds == {24: 4800, 28: 9600, 32: 19200, 36: 38400}
    formats = {c.raw: c.format for s in link.settings if s.parameter == "TFO" for c in s.choices}
    assert formats == {2: "8O1", 3: "8E1", 4: "8N1", 5: "8N2"}
    addresses = atv71.data.addresses
    assert (addresses.first, addresses.last, addresses.broadcast) == (1, 247, 0)
    assert (addresses.factory, addresses.off) == (0, 0)
    assert [server.parameter for server in addresses.servers] == ["AMOA", "AMOC"]


def test_functions_and_limits_match_the_manual(atv71: Profile) -> None:
    limits = {f.code: (f.max_read, f.max_write, f.broadcast) for f in atv71.data.functions}
    assert limits == {
        3: (63, None, False),
        6: (None, None, True),
        8: (None, None, False),
        16: (None, 61, True),
        23: (20, 20, False),
        43: (None, None, False),
    }
    diagnostics = atv71.function(8)
    assert diagnostics is not None
    assert diagnostics.subfunctions == [0x00, 0x0A, 0x0C, 0x0E]


def test_unknown_words_within_a_read_are_described(atv71: Profile) -> None:
    reading = atv71.data.reading
    assert reading.unknown_word == 0x8000
    assert reading.unknown_exception == 2
    assert reading.gaps_readable
    assert not reading.single_words_only


def test_identification_matches_the_manual(atv71: Profile) -> None:
    found = atv71.data.identification
    assert [(o.id, o.meaning, o.example) for o in found.objects] == [
        (0, "vendor", "Telemecanique"),
        (1, "reference", "ATV71HU15M3"),
        (2, "version", "0201"),
        (6, "name", "MACHINE 4"),
    ]
    assert found.conformity == 2
    assert found.exception_has_mei_byte
    assert matching_profiles("ATV71HU15M3") == ["atv71"]
    ratings = {model.code: model.power_kw for model in found.models}
    assert (ratings[9], ratings[23], ratings[45]) == ("1.5", "37", "1200")


def test_exceptions_match_the_manual(atv71: Profile) -> None:
    assert [e.code for e in atv71.data.exceptions] == [1, 2, 3, 4]


# Communication scanner


def test_scanner_matches_the_manual(atv71: Profile) -> None:
    read, write = atv71.data.blocks
    assert (read.direction, read.address, read.max_words) == ("read", 12741, 8)
    assert (write.direction, write.address, write.max_words) == ("write", 12761, 8)
    for block, slot, value in ((read, "NMA", "NM"), (write, "NCA", "NC")):
        assert block.slots == [f"{slot}{n}" for n in range(1, 9)]
        assert block.values == [f"{value}{n}" for n in range(1, 9)]
        assert block.selects_by == "address"
        assert block.write_when == "stopped"
    assert [atv71[code].address for code in read.slots] == list(range(12701, 12709))
    assert [atv71[code].address for code in write.slots] == list(range(12721, 12729))
    assert [atv71[code].address for code in read.values] == list(range(12741, 12749))
    assert [atv71[code].address for code in write.values] == list(range(12761, 12769))
    assert {atv71[code].access for code in (*read.slots, *write.slots)} == {"rw-stopped"}
    assert {atv71[code].access for code in write.values} == {"rw"}


def test_scanner_factory_assignment_matches_the_manual(atv71: Profile) -> None:
    assert [atv71[f"NMA{n}"].factory for n in range(1, 9)] == [3201, 8604, 0, 0, 0, 0, 0, 0]
    assert [atv71[f"NCA{n}"].factory for n in range(1, 9)] == [8501, 8602, 0, 0, 0, 0, 0, 0]


# State charts


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (0x0000, "not-ready"),
        (0x0020, "not-ready"),
        (0x0040, "disabled"),
        (0x0060, "disabled"),
        (0x0021, "ready"),
        (0x0023, "switched-on"),
        (0x0027, "enabled"),
        (0x0007, "quick-stop"),
        (0x000F, "fault-reaction"),
        (0x002F, "fault-reaction"),
        (0x0008, "fault"),
        (0x0028, "fault"),
        (0x0637, "enabled"),
        (0x8637, "enabled"),
        (0x0237, "enabled"),
        (0x8627, "enabled"),
        (0x0031, "ready"),
        (0x0250, "disabled"),
    ],
)
def test_drivecom_states_match_the_manual(atv71: Profile, word: int, state: str) -> None:
    assert state_of(chart_of(atv71, "drivecom"), {"ETA": word}).id == state


def test_no_drivecom_word_fits_two_states(atv71: Profile) -> None:
    states = chart_of(atv71, "drivecom").states
    for word in range(0x80):
        assert sum(word & s.mask == s.value for s in states) <= 1


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (0x0020, "not-ready"),
        (0x0022, "ready"),
        (0x0032, "ready"),
        (0x0036, "running"),
        (0x8636, "running"),
        (0x0028, "fault"),
        (0x002E, "fault"),
    ],
)
def test_states_of_the_io_profile_match_the_manual(atv71: Profile, word: int, state: str) -> None:
    assert state_of(chart_of(atv71, "io"), {"ETA": word}).id == state


def test_chart_follows_the_control_profile(atv71: Profile) -> None:
    chosen = {raw: atv71.chart({"CHCF": raw}) for raw in range(4)}
    assert {raw: chart.id for raw, chart in chosen.items() if chart} == {
        0: "series-8",
        1: "drivecom",
        2: "drivecom",
        3: "io",
    }


def test_undescribed_control_profile_has_no_states_and_no_commands(atv71: Profile) -> None:
    chart = chart_of(atv71, "series-8")
    assert chart.command == ""
    assert chart.transitions == []
    for word in (0x0000, 0x0027, 0x0637, 0xFFFF):
        assert read_chart(atv71, {"CHCF": 0, "ETA": word}).kind == UNKNOWN.kind


def test_status_bits_outside_the_state_match_the_manual(atv71: Profile) -> None:
    forward = read_chart(atv71, {"CHCF": 1, "ETA": 0x0637})
    assert (forward.direction, forward.reached, forward.alarm, forward.local) == (
        "forward",
        True,
        False,
        False,
    )
    reverse = read_chart(atv71, {"CHCF": 2, "ETA": 0x80B7})
    assert (reverse.direction, reverse.reached, reverse.alarm, reverse.local) == (
        "reverse",
        False,
        True,
        True,
    )


def test_drivecom_commands_match_the_manual(atv71: Profile) -> None:
    found = {
        (t.number, t.source, t.target): t.command
        for t in chart_of(atv71, "drivecom").transitions
        if t.command is not None
    }
    assert found == {
        ("2", "disabled", "ready"): 0x0006,
        ("3", "ready", "switched-on"): 0x0007,
        ("4", "switched-on", "enabled"): 0x000F,
        ("5", "enabled", "switched-on"): 0x0007,
        ("6", "switched-on", "ready"): 0x0006,
        ("7", "ready", "disabled"): 0x0000,
        ("8", "enabled", "ready"): 0x0006,
        ("9", "enabled", "disabled"): 0x0000,
        ("10", "switched-on", "disabled"): 0x0000,
        ("11", "enabled", "quick-stop"): 0x0002,
        ("12", "quick-stop", "disabled"): 0x0000,
        ("15", "fault", "disabled"): 0x0080,
        ("3, 4", "ready", "enabled"): 0x000F,
    }


def test_io_profile_has_no_drivecom_word(atv71: Profile) -> None:
    commands = {t.command for t in chart_of(atv71, "io").transitions}
    assert commands == {0x0000, 0x0001}


def test_reserved_command_bits_are_refused(atv71: Profile) -> None:
    command = atv71["CMD"]
    assert encode(command, "16#080F", {}, None).raw == 0x080F
    with pytest.raises(ValueRefused):
        check_raw(command, 0x0010, {}, None)
    assert atv71["CMI"].reserved == [3, 4, 5, 6, 7, 8, 13, 14]


# Faults and the watch over the line


@pytest.mark.parametrize(
    ("raw", "code"),
    [
        (0, "nOF"),
        (5, "SLF1"),
        (9, "OCF"),
        (12, "AnF"),
        (18, "ObF"),
        (22, "USF"),
        (34, "COF"),
        (42, "SLF2"),
        (45, "SLF3"),
        (57, "SrF"),
        (73, "HCF"),
        (76, "dLF"),
        (99, "CSF"),
    ],
)
def test_fault_codes_match_the_manual(atv71: Profile, raw: int, code: str) -> None:
    fault = atv71.fault(raw)
    assert fault is not None
    assert fault.code == code


def test_fault_table_is_complete(atv71: Profile) -> None:
    faults = atv71.data.faults
    assert len(faults.codes) == 75
    assert faults.parameter == "LFT"
    assert faults.shows_last
    assert [atv71[code].address for code in faults.history] == list(range(7200, 7209))
    assert atv71.names(atv71["LFT"]) == {f.raw: f.name for f in faults.codes}
    assert atv71.fault(105) is None


def test_fault_history_matches_the_manual(atv71: Profile) -> None:
    firsts = {"DP": 7200, "EP": 7210, "IP": 7220, "CMP": 7230, "LCP": 7240, "RFP": 7250}
    firsts |= {"RTP": 7260, "ULP": 7270, "THP": 7280, "CRP": 7290, "MD": 7300, "DM": 7310}
    for name, first in firsts.items():
        assert [atv71[f"{name}{n}"].address for n in range(9)] == list(range(first, first + 9))


def test_communication_fault_matches_the_manual(atv71: Profile) -> None:
    watch = atv71.data.communication_fault
    assert watch is not None
    assert (watch.timeout, watch.reaction, watch.fault) == ("TTO", "SLL", 5)
    assert watch.needs_write
    assert {r.raw: (r.code, r.trips, r.motor_keeps_running) for r in watch.reactions} == {
        0: ("NO", False, True),
        1: ("YES", True, False),
        2: ("STT", False, False),
        4: ("LFF", False, True),
        5: ("RLS", False, True),
        6: ("RMP", True, False),
        7: ("FST", True, False),
        8: ("DCI", True, False),
    }
    assert set(atv71.names(atv71["SLL"])) == {r.raw for r in watch.reactions}


# Bits


@pytest.mark.parametrize(
    ("code", "bits"),
    [
        ("ETA", {0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 14, 15}),
        ("CMI", {0, 1, 2, 9, 10, 11, 12, 15}),
        ("LRS5", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 13, 14, 15}),
        ("LRS6", {0, 1, 2, 3, 4, 5, 7, 8, 10, 11, 13, 14, 15}),
        ("LRS8", {15}),
        ("IL1R", set(range(14))),
        ("OL1R", {0, 1, 2, 3, 8, 9, 10, 11}),
        ("CIC", {0, 2, 3, 4, 6, 7, 9, 10, 12, 13}),
    ],
)
def test_bits_match_the_manual(atv71: Profile, code: str, bits: set[int]) -> None:
    assert {bit.bit for bit in atv71[code].bits} == bits


def test_extended_status_bit_4_is_the_speed_mode(atv71: Profile) -> None:
    assert {bit.bit: bit.name for bit in atv71["ETI"].bits}[4] == "Speed mode"


# What a person reads


def test_texts_fit_their_columns(atv71: Profile) -> None:
    for parameter in atv71.parameters:
        assert len(parameter.name) <= 40, parameter.code
        assert all(len(bit.name) <= 32 for bit in parameter.bits), parameter.code
        names = atv71.names(parameter)
        assert all(len(text) <= 32 for text in names.values()), parameter.code
        folded = [text.casefold() for text in names.values()]
        assert len(folded) == len(set(folded)), parameter.code


def test_names_differ_within_a_group(atv71: Profile) -> None:
    seen = [(p.group, p.name) for p in atv71.parameters]
    assert len(seen) == len(set(seen))


def test_unconfirmed_fact_is_marked(atv71: Profile) -> None:
    assert not is_verified(atv71["NPR"])
    assert not is_verified(atv71["LAC"])
    assert is_verified(atv71["ETA"])
    for parameter in atv71.parameters:
        if parameter.forbidden:
            assert not is_verified(parameter), parameter.code
            assert parameter.unit == "", parameter.code


def test_errata_are_recorded(atv71: Profile) -> None:
    def about(text: str) -> Erratum:
        return next(e for e in atv71.data.errata if text in e.place)

    assert "W12768" in about("NC1 to NC8").right
    assert about("second output").right.startswith("8602")


def test_monitoring_set_has_the_main_values(atv71: Profile) -> None:
    rates = {value.parameter: value.rate for value in atv71.data.monitoring.values}
    assert [code for code, rate in rates.items() if rate == "fast"][:3] == ["RFR", "FRH", "RFRD"]
    assert {"LCR", "OTR", "UOP", "ETA"} <= {c for c, r in rates.items() if r == "fast"}
    assert {"THD", "THR", "ULN", "APH", "RTH"} <= {c for c, r in rates.items() if r == "slow"}
    assert {c for c, r in rates.items() if r == "on-change"} == {"LFT", "LRS6"}
