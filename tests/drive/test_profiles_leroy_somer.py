"""Powerdrive, Proxidrive and Varmeca profiles against literal facts of the PX-MODBUS manual."""

from __future__ import annotations

from decimal import Decimal

import pytest

from tui.drive.chart import read_chart
from tui.drive.errors import UnknownParameter
from tui.drive.profile.library import load_file, packaged_folder
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.read_plan import plan_reads
from tui.drive.values import decode, encode

IDS = ("powerdrive", "proxidrive", "varmeca")
PROFILES = {name: load_file(packaged_folder() / f"{name}.toml") for name in IDS}


@pytest.fixture(params=IDS)
def profile(request: pytest.FixtureRequest) -> Profile:
    return PROFILES[request.param]


ADDRESSES = [
    # code, wire address (sections 4, 5.5, 5.7)
    ("1.05", 0x0068),
    ("1.42", 141),
    ("6.15", 614),
    ("6.30", 629),
    ("6.32", 631),
    ("6.34", 633),
    ("6.42", 641),
    ("6.43", 642),
    ("10.01", 1000),
    ("10.33", 1032),
    ("10.40", 1039),
    ("11.23", 1122),
    ("11.25", 1124),
    ("11.26", 1125),
    ("11.27", 1126),
    ("11.63", 1162),
    ("15.01", 1500),
    ("15.03", 1502),
    ("15.07", 1506),
]


@pytest.mark.parametrize(("code", "address"), ADDRESSES)
def test_addresses_match_the_manual(profile: Profile, code: str, address: int) -> None:
    assert profile[code].address == address
    assert profile.find(code) is profile.find(str(address))


def test_every_address_follows_from_menu_and_parameter(profile: Profile) -> None:
    for parameter in profile.parameters:
        menu, number = parameter.code.split(".")
        assert parameter.address == int(menu) * 100 + int(number) - 1
        assert parameter.number == parameter.code


def test_functions_and_limits_match_the_manual(profile: Profile) -> None:
    found = {f.code: (f.max_read, f.max_write, f.broadcast) for f in profile.data.functions}
    assert found == {
        3: (20, None, False),
        6: (None, None, True),
        16: (None, 12, False),
        23: (20, 10, False),
    }
    assert {f.past_limit for f in profile.data.functions} == {"silence"}
    assert profile.data.exceptions == []
    assert profile.data.identification.objects == []


def test_group_addresses_match_the_manual(profile: Profile) -> None:
    addresses = profile.data.addresses
    assert addresses.zero_digit_is_group
    assert (addresses.first, addresses.last, addresses.factory) == (1, 247, 1)


MODULE = [
    # code, min, max, factory, scale, unit (section 4)
    ("15.03", 0, 247, 1, "1", ""),
    ("15.05", 0, 3, 0, "1", ""),
    ("15.06", 0, 250, 10, "1", "ms"),
    ("15.07", 0, 250, 0, "0.1", "s"),
]


@pytest.mark.parametrize(("code", "low", "high", "factory", "scale", "unit"), MODULE)
def test_module_settings_match_the_manual(
    profile: Profile, code: str, low: int, high: int, factory: int, scale: str, unit: str
) -> None:
    p = profile[code]
    assert (p.min, p.max, p.factory, p.scale, p.unit) == (low, high, factory, scale, unit)


BAUDS = [300, 600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200]


@pytest.mark.parametrize(("name", "count"), [("powerdrive", 10), ("proxidrive", 7), ("varmeca", 7)])
def test_baud_rates_match_the_manual(name: str, count: int) -> None:
    """38400, 57600 and 115200 work on the Powerdrive only."""
    profile = PROFILES[name]
    rates = {raw: str(baud) for raw, baud in enumerate(BAUDS[:count])}
    for code in ("15.04", "11.25"):
        assert profile.names(profile[code]) == rates
        assert profile[code].max == count - 1
    assert profile["15.04"].factory == 6
    assert profile.data.link.bauds == BAUDS[:count]
    for setting in profile.data.link.settings:
        if setting.role == "baud":
            assert {c.raw: c.baud for c in setting.choices} == dict(enumerate(BAUDS[:count]))


def test_formats_match_the_manual(profile: Profile) -> None:
    settings = [s for s in profile.data.link.settings if s.role == "format"]
    assert [s.parameter for s in settings] == ["15.05", "11.27"]
    for setting in settings:
        assert [c.format for c in setting.choices] == ["8N2", "8N1", "8E1", "8O1"]
    assert (profile.data.link.baud, profile.data.link.format) == (19200, "8N2")


@pytest.mark.parametrize("code", ["15.03", "15.04", "15.05", "15.06", "15.07"])
def test_option_code_comes_before_the_rest_of_menu_15(profile: Profile, code: str) -> None:
    assert "15.01" in profile[code].note
    assert profile.names(profile["15.01"]) == {352: "Modbus"}
    assert profile["15.01"].access == "r"


def test_timeout_is_in_tenths_of_a_second(profile: Profile) -> None:
    timeout = profile["15.07"]
    names = profile.names(timeout)
    assert encode(timeout, "2.5 s", names, Decimal(timeout.scale)).raw == 25
    assert decode(timeout, 0, names, Decimal(timeout.scale)).text == "Off"
    watch = profile.data.communication_fault
    assert watch is not None
    assert (watch.timeout, watch.off) == ("15.07", 0)


CONTROL_BITS = {0: "6.15", 1: "6.30", 2: "6.31", 3: "6.32", 4: "6.33", 5: "6.34", 8: "1.42"}
CONTROL_BITS[13] = "10.33"


def test_control_words_match_the_manual(profile: Profile) -> None:
    command = profile["6.42"]
    assert {bit.bit for bit in command.bits} == set(CONTROL_BITS)
    assert command.reserved == [6, 7, 9, 10, 11, 12, 14, 15]
    for bit in command.bits:
        own = profile[CONTROL_BITS[bit.bit]]
        assert own.code in bit.note
        assert own.name == bit.name
        assert own.access == "rw"
    assert profile["6.43"].access == "rw-stopped"
    assert profile.names(profile["6.43"]) == {0: "Terminals", 1: "Control word"}


def test_derived_command_words_are_marked(profile: Profile) -> None:
    words = {e.word: e.confidence for e in profile.data.command_examples}
    assert words == dict.fromkeys((0x0000, 0x0001, 0x0003, 0x0009, 0x2000), "unverified")


@pytest.mark.parametrize(
    ("name", "bits"), [("powerdrive", 15), ("proxidrive", 14), ("varmeca", 14)]
)
def test_status_bits_match_the_manual(name: str, bits: int) -> None:
    """Each bit is a parameter of menu 10; 10.15 is not used on Proxidrive and Varmeca."""
    profile = PROFILES[name]
    status = profile["10.40"]
    assert [bit.bit for bit in status.bits] == list(range(bits))
    for bit in status.bits:
        assert profile[f"10.{bit.bit + 1:02}"].name == bit.name
    if bits == 14:
        with pytest.raises(UnknownParameter):
            profile["10.15"]


STATES = [
    # 10.40, 6.43, state, kind, reached, local
    (0x0000, 1, "fault", "fault", False, False),
    (0x0005, 0, "ready", "ready", False, True),
    (0x0013, 1, "running", "running", False, False),
    (0x0023, 1, "running", "running", True, False),
    (0x0007, 1, "standstill", "running", False, False),
]


@pytest.mark.parametrize(("word", "control", "state", "kind", "reached", "local"), STATES)
def test_states_match_the_manual(
    profile: Profile, word: int, control: int, state: str, kind: str, reached: bool, local: bool
) -> None:
    found = read_chart(profile, {"10.40": word, "6.43": control})
    assert (found.state.id, found.kind) == (state, kind)
    assert (found.reached, found.local) == (reached, local)
    assert found.direction is None, "the manual does not say which value is forward"


def test_every_status_word_has_a_state(profile: Profile) -> None:
    assert all(read_chart(profile, {"10.40": w}).kind != "unknown" for w in range(0x8000))


def test_undocumented_parameter_is_raw_and_read_only(profile: Profile) -> None:
    unlisted = [p for p in profile.parameters if p.group == "Unverified"]
    assert len(unlisted) >= 30
    for parameter in unlisted:
        assert (parameter.access, parameter.unit, parameter.scale) == ("r", "", "1")
        assert parameter.quantity is None
    assert {"5.01", "4.01", "10.20"} <= {p.code for p in unlisted}


def test_writable_parameters_are_in_the_manual(profile: Profile) -> None:
    for parameter in profile.parameters:
        if parameter.access != "r":
            assert parameter.source.startswith("px-modbus")
            assert is_verified(parameter)


def test_bits_of_the_status_are_read_in_one_request(profile: Profile) -> None:
    codes = [f"10.{number:02}" for number in range(1, 15)]
    (request,) = plan_reads(profile, codes).requests
    assert (request.address, request.count) == (1000, 14)


def test_varmeca_has_the_parameters_of_its_cover_diagram() -> None:
    varmeca, powerdrive = PROFILES["varmeca"], PROFILES["powerdrive"]
    for code in ("1.11", "1.17", "12.43", "12.44"):
        assert varmeca[code].source.startswith("varmeca-30")
        assert powerdrive.get(code) is None
    assert varmeca["5.01"].confidence == "public"
    assert powerdrive["5.01"].confidence == "analogy"


def test_connectors_match_the_manual(profile: Profile) -> None:
    sub_d, terminals = profile.data.connectors
    assert {p.pin: p.signal for p in sub_d.pins if p.signal != "Not connected"} == {
        "1": "0 V common", "2": "TX\\", "3": "RX\\", "6": "TX", "7": "RX", "Shield": "0 V common",
    }  # fmt: skip
    assert [p.signal for p in terminals.pins] == ["0 V common", "RX\\", "RX", "TX\\", "TX"]
