"""The page of a family: warnings, waiting, pins, rules, addresses, lamps, commands, errata."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.sweeps import kept
from tui.drive.family_page import PageSection, family_page, page_lines
from tui.drive.model import model_codes, model_of, model_read
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

ALTIVAR = ["atv21", "atv31", "atv312", "atv71"]
LEROY = ["powerdrive", "proxidrive", "varmeca"]
FAMILIES = [*ALTIVAR, *LEROY]
COMMON_SECTIONS = [
    "Warnings",
    "Before you open the drive",
    "Line",
    "Addresses",
    "On a communication loss",
    "After a fault reset",
    "Command words",
    "Errors in the manuals",
]


def section(family: str, title: str) -> PageSection:
    (found,) = [
        page_section
        for page_section in family_page(library.load(family))
        if page_section.title == title
    ]
    return found


def text_of(family: str, title: str = "") -> str:
    sections = family_page(library.load(family))
    kept = [section for section in sections if not title or section.title == title]
    return "\n".join(
        f"{row.head} {row.text} {row.sure}" for section in kept for row in section.rows
    )


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_has_its_sections(family: str) -> None:
    titles = [section.title for section in family_page(library.load(family))]
    assert [title for title in COMMON_SECTIONS if title not in titles] == []
    assert [title for title in titles if title.startswith("Pins: ")]
    assert ("Signal names" in titles) is (family in ALTIVAR)


# the manuals' tables of accessories, by family
NUMBERS = [
    "LU9GC3", "VW3A8306TF03", "VW3A8306TF10", "VW3A8306RC", "VW3A8306R", "VW3A8306D30",
    "VW3A8306R03", "VW3A8306R10", "VW3A8306R30", "TSXCSA100", "TSXCSA200", "TSXCSA500",
    "TSXSCA50", "TSXSCA62", "VW3A8306", "TWDXCARJ030", "TSXSCPCM4030", "TSXSCYCM6030",
    "VW3P07306R10", "TSXSCA72", "TSXPACC01", "TSXSCPCU4030",
]  # fmt: skip
OWN_NUMBERS = {
    "atv21": [*NUMBERS, "TSXETG100", "VW3A3303"],
    "atv31": [*NUMBERS, "174CEV30010"],
    "atv312": ["TSXCSA100", "TSXCSA200", "TSXCSA500", "VW3A8200"],
    "atv71": [*NUMBERS, "174CEV30010", "VW3A8306DRC", "VW3A8306DR", "TSXSCPCU4530", "TSXSCYCU4530"],
}


@pytest.mark.parametrize("family", OWN_NUMBERS)
def test_page_has_every_catalog_number_of_the_manual(family: str) -> None:
    page = "\n".join(text_of(family, title) for title in ("Parts to order", "Cables by master"))
    words = page.replace(" ", "")
    assert [number for number in OWN_NUMBERS[family] if number not in words] == []


def test_masters_of_one_manual_are_not_those_of_another() -> None:
    assert "174 CEV 300 10" not in text_of("atv21", "Cables by master")
    assert "TSX ETG 100" not in text_of("atv71", "Cables by master")
    assert "SUB-D: " not in text_of("atv31", "Cables by master")
    assert not text_of("powerdrive", "Parts to order")


# limits of the manuals' schematics: slaves, length, tap links, polarization, terminator
SCHEMATICS = {
    "Modbus standard": (
        "31 slaves",
        "1000 m at 19200",
        "links of 20 m.",
        "450 to 650 ohm",
        "120 ohm",
    ),
    "Uni-Telway": ("28 slaves", "1000 m at 19200", "share 40 m, divided", "4700 ohm", "120 ohm"),
    "Jbus, 2 wires": ("31 slaves", "1300 m at 19200", "Tap links of 3 m.", "470 ohm", "150 ohm"),
    "Mixed": (
        "31 slaves",
        "1000 m at 19200",
        "162 to 650 ohm",
        "at most 18 stations have",
        "120 ohm",
    ),
}


@pytest.mark.parametrize("family", FAMILIES)
def test_schematics_have_the_limits_of_the_manuals(family: str) -> None:
    rows = {row.head: row for row in section(family, "Schematics").rows if row.head}
    for name, parts in SCHEMATICS.items():
        assert [part for part in parts if part not in rows[name].text] == []
        assert ("sister" in rows[name].sure) is (
            family in LEROY or (family, name) == ("atv21", "Mixed")
        )
    assert ("In the drive" in rows) is (family in ALTIVAR)
    assert ("switches low" in text_of(family, "Schematics")) is (family == "atv21")


def test_drawing_of_a_schematic_is_not_wrapped() -> None:
    lines = page_lines(family_page(library.load("atv71")), 100)
    drawn = [line.text for line in lines if line.text.lstrip().startswith(("D1 --", "D0 --"))]
    assert len(drawn) == 4
    assert all(len(line) == 58 for line in drawn)


def test_keypad_functions_without_an_address_are_named() -> None:
    assert [row.head for row in section("atv21", "On the keypad only").rows] == ["AUH", "AUF"]


@pytest.mark.parametrize("family", FAMILIES)
def test_page_has_every_pin_rule_command_and_erratum(family: str) -> None:
    data = library.load(family).data
    page = text_of(family)
    reported = [
        *(pin.signal for connector in data.connectors for pin in connector.pins),
        *(warning for connector in data.connectors for warning in connector.warnings),
        *(rule.rule for rule in data.line_rules),
        *(f"16#{example.word:04X} {example.does}" for example in data.command_examples),
        *(f"Right: {erratum.right}." for erratum in data.errata),
        *(family_warning.text for family_warning in data.wiring.warnings),
        *(data.communication_fault.warnings if data.communication_fault else ()),
        *(server.name for server in data.addresses.servers),
    ]
    assert [item for item in reported if item not in page] == []


WARNED = [
    ("atv31", "With SLL = 0 a motor keeps running"),
    ("atv312", "With SLL = 0 a motor keeps running"),
    ("atv71", "With SLL = 0 a motor keeps running"),
    ("atv21", "With F803 = 0 the drive does not detect communication loss"),
    *((family, "Behind a gateway") for family in FAMILIES),
    ("atv71", "factory setting of the address is OFF"),
    ("atv21", "can be set to 0: the drive then does not answer"),
    *((family, "digit 0 (10, 20, 100 to 110) call a group") for family in LEROY),
]


@pytest.mark.parametrize(("family", "text"), WARNED)
def test_page_has_the_warnings_of_the_manuals(family: str, text: str) -> None:
    assert text in text_of(family, "Warnings")
    assert all(row.warns for row in section(family, "Warnings").rows)


@pytest.mark.parametrize("family", FAMILIES)
def test_no_warning_is_repeated(family: str) -> None:
    gateways = [r for r in section(family, "Warnings").rows if "gateway" in r.text]
    assert len(gateways) == 1
    texts = [row.text for row in section(family, "Warnings").rows]
    assert len(texts) == len(set(texts))


def test_fact_from_another_manual_is_marked() -> None:
    marks = {row.text: row.sure for row in section("atv312", "Warnings").rows}
    (gateway,) = [sure for text, sure in marks.items() if "gateway" in text]
    assert gateway == "sister family ?"
    (own,) = [row.sure for row in section("atv71", "Warnings").rows if "gateway" in row.text]
    assert own == ""
    wait = section("atv31", "Before you open the drive").rows[0]
    assert (wait.text, wait.sure) == (
        "15 minutes; DC bus below 42 V, measured",
        "sister family ?",
    )


WAITS = {
    "atv21": "15 minutes; DC bus below 45 V, measured",
    "atv312": "15 minutes; DC bus below 42 V, measured",
    "atv71": "15 minutes; DC bus below 45 V, measured",
    "powerdrive": "unknown",
    "proxidrive": "unknown",
    "varmeca": "unknown",
}


@pytest.mark.parametrize("family", WAITS)
def test_page_has_the_wait_before_opening_the_drive(family: str) -> None:
    assert section(family, "Before you open the drive").rows[0].text == WAITS[family]


@pytest.mark.parametrize("family", ALTIVAR)
def test_page_has_signal_names_of_several_standards(family: str) -> None:
    rows = {row.head: row.text for row in section(family, "Signal names").rows}
    assert rows == {
        "D0": "EIA/TIA-485: A or A'; Uni-Telway: D(A); Jbus: RD+/TD+ or L+",
        "D1": "EIA/TIA-485: B or B'; Uni-Telway: D(B); Jbus: RD-/TD- or L-",
        "Common": "EIA/TIA-485: C or C'; Uni-Telway: 0VL",
    }


def test_page_of_altivar_71_has_other_servers_and_lamps() -> None:
    addresses = text_of("atv71", "Addresses")
    assert "AMOA another server" in addresses
    assert "AMOC another server" in addresses
    assert "factory setting OFF" in addresses
    assert "MOD Lit for 200 ms" in text_of("atv71", "Lamps and display")


@pytest.mark.parametrize("family", kept(FAMILIES, "atv71", "varmeca"))
@given(width=st.integers(40, 160))
def test_no_line_is_wider_than_the_page(family: str, width: int) -> None:
    for line in page_lines(family_page(library.load(family)), width):
        assert len(line.head + line.text) <= width or line.kind == "title"


def test_page_does_not_control_terminal() -> None:
    data = library.load("atv71").data
    bad = msgspec.structs.replace(data.wiring.warnings[0], text="a\x1b[2Jb")
    wiring = msgspec.structs.replace(data.wiring, warnings=[bad])
    pins = msgspec.structs.replace(data.connectors[0], name="a\x1b[2Jb")
    profile = Profile(msgspec.structs.replace(data, wiring=wiring, connectors=[pins]))
    assert all("\x1b" not in line.head + line.text for line in page_lines(family_page(profile), 80))


# Models


def test_altivar_21_models_have_code_and_class() -> None:
    profile = library.load("atv21")
    known = profile.data.identification
    assert model_codes(profile) == ["FB05", "FB72"]
    assert len(known.models) == 64
    assert sum(bool(model.reference) for model in known.models) == 60
    for model in known.models:
        raws = {"FB05": model.code, "FB72": int(model.class_b) << 7}
        assert model_of(profile, raws) == model


def test_models_that_share_a_code_need_the_class() -> None:
    profile = library.load("atv21")
    counts: dict[int, int] = {}
    for model in profile.data.identification.models:
        counts[model.code] = counts.get(model.code, 0) + 1
    for code, count in counts.items():
        assert (model_of(profile, {"FB05": code}) is None) is (count > 1), code
    assert model_of(profile, {}) is None


def test_model_names_are_shortened() -> None:
    profile = library.load("atv21")
    assert model_read(profile, {"FB05": 6, "FB72": 0}) == "ATV21HU15M3X, 200 V, 1.5 kW"
    assert model_read(profile, {"FB05": 136, "FB72": 0x80}) == (
        "ATV21W075N4C, 400/460 V, 0.75 kW, IP54, class B filter"
    )
    assert model_read(profile, {"FB05": 999, "FB72": 0}) == "code 999, not in the profile"
    assert model_read(profile, {}) == ""
    assert model_read(library.load("atv312"), {"FB05": 6}) == ""


def test_section_without_rows_is_omitted() -> None:
    data = msgspec.structs.replace(library.load("atv71").data, errata=[], line_rules=[])
    titles = [section.title for section in family_page(Profile(data))]
    assert "Errors in the manuals" not in titles
    assert all(replace(section).rows for section in family_page(Profile(data)))
