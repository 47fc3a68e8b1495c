"""Drives of a profile of the user are recognized by a register, or by the text of function 17."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.mixer import MIXER, installed_mixer, mixer_text
from tui.bus.api import Priority
from tui.bus.errors import ChecksumFault
from tui.bus.fake import FakeLine
from tui.bus.requests import Read, ReportId, own_words_of
from tui.cli.main import main
from tui.cli.shared.profile_choice import unidentified
from tui.drive.finding import PresenceProbe
from tui.drive.profile import library
from tui.drive.profile.new_file import new_profile_text
from tui.drive.profile.profile import Profile
from tui.session.connect.contradiction import contradiction, own_words
from tui.session.connect.identify import ScanResult, find_drive, identify_drive
from tui.simulator import DriveSpec, SimulatedDrive
from tui.simulator.proving.proof_steps import prove_profile

TYPE, LEROY_STATUS = 3300, 1039
ROW = """
[[parameters]]
code = "{0}"
name = "Word {0}"
number = "4{1}"
address = {1}
access = "r"
group = "Identity"
source = "guide"
confidence = "manual"
"""
ROWS = ROW.format("TYPE", TYPE) + ROW.format("CODE", TYPE + 1)
LINK = "[link]\n"
BY_REGISTER = 'registers = [{ parameter = "TYPE", values = [3100, 3101] }]'
FUNCTION_17 = '[[functions]]\ncode = 17\nname = "Report server id"\n\n'
BY_TEXT = """reference_prefixes = ["MIXER-7"]
objects = [{ id = 1, meaning = "reference", example = "MIXER-72" }]"""


@pytest.fixture
def packaged() -> None:
    """Keep the packaged profiles in the list."""


@pytest.fixture(autouse=True)
def few_profiles(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Leave only the profiles of the user: the others take time to load."""
    if "packaged" not in request.fixturenames:
        monkeypatch.setattr(library, "packaged_folder", lambda: tmp_path)


STATUS = PresenceProbe(100, (MIXER,))
WORDS = {100: 1, TYPE: 3101}


def identified_by(text: str, more: str = "") -> tuple[str, str]:
    return LINK, f"[identification]\n{text}\n\n{more}{LINK}"


def installed(text: str = BY_REGISTER, more: str = "") -> Profile:
    return installed_mixer('unit = "Hz"\nscale = "0.1"', ROWS, identified_by(text, more))


async def found(line: FakeLine) -> ScanResult:
    probes = (STATUS, PresenceProbe(LEROY_STATUS))
    return await find_drive(
        line, 1, probes, priority=Priority.BACKGROUND, within=0.01, patience=0.02
    )


async def test_register_identifies_a_drive_without_functions_43_and_17() -> None:
    installed()
    line = FakeLine({1: WORDS})
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.by) == (MIXER, "registers")
    assert all(isinstance(request, Read) for request in line.requests if request.changes)
    assert (await identify_drive(line, 1)).profile == MIXER


@pytest.mark.parametrize("words", [{}, {TYPE: 3102}, {TYPE: 0}])
async def test_drive_without_the_value_stays_unknown(words: dict[int, int]) -> None:
    installed()
    line = FakeLine({1: {100: 1, **words}})
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.by) == (None, "read of register 100")
    assert (await identify_drive(line, 1)).profile is None


async def test_two_registers_must_both_fit() -> None:
    both = BY_REGISTER.replace(" }]", ' }, { parameter = "CODE", values = [7] }]')
    installed(both)
    assert (await identify_drive(FakeLine({1: {**WORDS, TYPE + 1: 7}}), 1)).profile == MIXER
    assert (await identify_drive(FakeLine({1: {**WORDS, TYPE + 1: 8}}), 1)).profile is None
    assert (await identify_drive(FakeLine({1: WORDS}), 1)).profile is None


async def test_register_of_32_bits_is_read_word_by_word() -> None:
    wide = ROW.format("WIDE", 3400) + 'type = "uint32"\n'
    text = 'registers = [{ parameter = "WIDE", values = [70000] }]'
    installed_mixer('unit = "Hz"\nscale = "0.1"', wide, identified_by(text))
    line = FakeLine({1: {100: 1, 3400: 70000 & 0xFFFF, 3401: 1}})
    assert (await identify_drive(line, 1)).profile == MIXER
    line.devices[1].words[3401] = 2
    assert (await identify_drive(line, 1)).profile is None


async def test_damaged_register_leaves_the_drive_unknown() -> None:
    installed()
    line = FakeLine({1: WORDS})
    line.fail_read(1, TYPE, ChecksumFault(1, 3, TYPE))
    result = await found(line)
    assert result.identity is not None
    assert result.identity.profile is None
    assert result.error


async def test_drive_that_may_be_of_another_make_stays_unknown(packaged: None) -> None:
    # a Leroy-Somer drive has 1.05 at 104, and its status word tells it from the mixer
    row = ROW.format("KIND", 104)
    text = 'registers = [{ parameter = "KIND", values = [1500] }]'
    installed_mixer('unit = "Hz"\nscale = "0.1"', row, identified_by(text))
    alone, leroy = FakeLine({1: {100: 1, 104: 1500}}), FakeLine({1: {104: 1500, LEROY_STATUS: 1}})
    assert (await identify_drive(alone, 1)).profile == MIXER
    other = await identify_drive(leroy, 1)
    assert (other.profile, other.candidates) == (
        None,
        (MIXER, "powerdrive", "proxidrive", "varmeca"),
    )


async def test_function_17_identifies_for_commands_too() -> None:
    installed(BY_TEXT, FUNCTION_17)
    line = FakeLine({1: WORDS})
    line.devices[1].called = b"MIXER-72"
    identity = await identify_drive(line, 1)
    assert (identity.profile, identity.reference) == (MIXER, "MIXER-72")
    line.devices[1].called = b"OTHER-1"
    assert (await identify_drive(line, 1)).profile is None


BY_BYTES = BY_TEXT.replace("MIXER-72", "16#2A00FF01").replace("MIXER-7", "16#2A00")


async def test_bytes_of_function_17_identify_a_drive_without_a_text() -> None:
    installed(BY_BYTES, FUNCTION_17)
    line = FakeLine({1: WORDS})
    line.devices[1].called = own_words_of(b"\x11\x04\x2a\x00\xff\x01")
    identity = await identify_drive(line, 1)
    assert (identity.profile, identity.reference) == (MIXER, "16#2A00FF01")
    scanned = (await found(line)).identity
    assert scanned is not None
    assert scanned.profile == MIXER
    line.devices[1].called = own_words_of(b"\x11\x02\x2b\x00")
    assert (await identify_drive(line, 1)).reference == "", "bytes of no profile are no name"
    assert own_words_of(b"\x11\x00") == b""


def test_simulated_drive_replies_the_bytes_of_function_17() -> None:
    profile = installed(BY_BYTES, FUNCTION_17)
    drive = SimulatedDrive(profile, DriveSpec(MIXER, 1))
    assert drive.line_side.answer(1, b"\x11") == b"\x11\x04\x2a\x00\xff\x01"
    [step] = [step for step in prove_profile(profile) if "function 17" in step.title]
    assert step.fault == ""


async def test_function_17_is_not_requested_if_no_profile_has_it() -> None:
    installed()
    line = FakeLine({1: WORDS})
    await identify_drive(line, 1)
    assert ReportId(1) not in line.requests


async def test_brief_identification_reads_no_register() -> None:
    installed()
    line = FakeLine({1: WORDS})
    assert (await identify_drive(line, 1, brief=True)).profile is None
    assert Read(1, TYPE, 1) not in line.requests


async def test_named_profile_is_refused_if_its_register_has_another_value() -> None:
    profile = installed()
    reported = await own_words(FakeLine({1: {100: 1, TYPE: 7}}), 1, profile)
    assert contradiction(reported, profile) == (
        f"Device 1 has TYPE (4{TYPE}) 7: the profile Example mixer does not fit it."
    )
    assert contradiction(await own_words(FakeLine({1: WORDS}), 1, profile), profile) == ""
    assert contradiction(await own_words(FakeLine({1: {100: 1}}), 1, profile), profile) == ""


async def test_named_profile_of_another_family_is_refused_by_the_registers(packaged: None) -> None:
    installed()
    atv = library.load("atv71")
    text = contradiction(await own_words(FakeLine({1: WORDS}), 1, atv), atv)
    assert text.startswith("Device 1 has the registers of Example mixer: the profile Altivar 71")
    assert contradiction(await own_words(FakeLine({1: {100: 1}}), 1, atv), atv) == ""


async def test_other_profile_contradicts_the_registers(packaged: None) -> None:
    installed()
    identity = await identify_drive(FakeLine({1: WORDS}), 1)
    text = contradiction(identity, library.load("atv71"))
    assert text.startswith("Device 1 has the registers of Example mixer: ")


def test_simulated_drive_has_the_register_and_the_text() -> None:
    profile = installed(f"{BY_TEXT}\n{BY_REGISTER}", FUNCTION_17)
    drive = SimulatedDrive(profile, DriveSpec(MIXER, 1))
    assert drive.raw("TYPE") == 3100
    assert drive.line_side.answer(1, b"\x11") == b"\x11\x0a\x01\xffMIXER-72"
    steps = [step for step in prove_profile(profile) if "identifies" in step.title]
    assert [(step.title, step.fault) for step in steps] == [
        ("register TYPE identifies the drive", ""),
        ("function 17 identifies the drive", ""),
    ]


@pytest.mark.sweep
def test_scan_recognizes_two_drives_of_different_makes(packaged: None) -> None:
    installed()
    line = f"sim:{MIXER}@1,atv312@2,powerdrive@3"
    result = CliRunner().invoke(main, ["scan", line, "--addresses", "1-3"])
    assert "Example mixer" in result.output, result.output
    assert "Altivar 312" in result.output
    assert "likely" in result.output


def checked(*changes: tuple[str, str], name: str = "mixer.toml") -> Result:
    row = ROW.format("IN", TYPE + 2) + "function = 4\n"
    real = ROW.format("REAL", TYPE + 3) + 'type = "float32"\n'
    text = mixer_text() + ROWS + (row if "IN" in str(changes) else "")
    text += real if "REAL" in str(changes) else ""
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    path = library.user_folder() / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return CliRunner().invoke(main, ["profiles", "--check", str(path)])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('registers = [{ parameter = "TYPE", values = [] }]', "it needs values, or"),
        ('registers = [{ parameter = "NONE", values = [3100] }]', "there is no parameter 'NONE'"),
        ('registers = [{ parameter = "TYPE", values = [0] }]', "0 is also the value of"),
        ('registers = [{ parameter = "TYPE", values = [65535] }]', "65535 is also the value"),
        ('registers = [{ parameter = "TYPE", values = [70000] }]', "70000 does not fit uint16"),
        ('registers = [{ parameter = "TYPE", values = [7] }]', "Add a second register"),
        ('registers = [{ parameter = "KEY", values = [700] }]', "its access must be r"),
        ('registers = [{ parameter = "IN", values = [700] }]', "only read by function 3"),
        ('registers = [{ parameter = "REAL", values = [7] }]', "a float32 has no exact value."),
        (
            'registers = [{ parameter = "TYPE", begins = ["ABC"] }]',
            "it needs values, or for a text",
        ),
        ('reference_prefixes = ["MI"]', "too short"),
        ('reference_prefixes = ["16#2A"]', "needs at least two bytes"),
        ('reference_prefixes = ["16#2AF"]', "needs at least two bytes"),
        ('reference_prefixes = ["ATV312"]', "the profile atv312 has the prefix 'ATV312' too"),
    ],
)
def test_check_names_a_wrong_identification_with_its_line(
    text: str, message: str, packaged: None
) -> None:
    result = checked(identified_by(text))
    assert result.exit_code == 2, result.output
    line = mixer_text()[: mixer_text().index(LINK)].count("\n") + 2
    assert message.casefold() in result.output.casefold()
    assert f"mixer.toml:{line}: " in result.output


def test_check_refuses_function_17_without_a_fitting_text() -> None:
    assert "function 17 has no text" in checked(identified_by("", FUNCTION_17)).output
    other = identified_by(BY_TEXT.replace("MIXER-72", "OTHER"))
    assert "'OTHER' begins with none of reference_prefixes" in checked(other).output


async def test_two_profiles_with_the_same_registers_identify_no_drive(packaged: None) -> None:
    installed()
    second = identified_by(BY_REGISTER), (f'id = "{MIXER}"', 'id = "mixer-2"')
    result = checked(*second, name="second.toml")
    assert "the profile example-mixer has the same registers and values" in result.output
    identity = await identify_drive(FakeLine({1: WORDS}), 1)
    assert identity.profile is None


async def test_family_that_may_have_the_values_and_differs_in_nothing_is_named(
    packaged: None,
) -> None:
    installed()
    text = (mixer_text() + ROWS).replace(f'id = "{MIXER}"', 'id = "mixer-2"')
    (library.user_folder() / "second.toml").write_text(text, encoding="utf-8")
    result = checked(identified_by(BY_REGISTER))
    assert "drives of mixer-2 may contain these values too" in result.output
    assert (await identify_drive(FakeLine({1: WORDS}), 1)).profile is None


async def test_reference_that_two_profiles_claim_identifies_no_drive(packaged: None) -> None:
    installed('reference_prefixes = ["ATV312"]')
    line = FakeLine({1: {}})
    line.devices[1].identity = {1: b"ATV312HU09M3"}
    identity = await identify_drive(line, 1)
    assert (identity.profile, set(identity.candidates)) == (None, {"atv312", MIXER})
    text = str(unidentified(identity))
    assert "'ATV312HU09M3', which fits the profiles atv312, example-mixer equally" in text
    assert "Choose one with -p" in text


def test_copy_of_a_profile_identifies_no_drive() -> None:
    own = identified_by(f"{BY_TEXT}\n{BY_REGISTER}")
    text = new_profile_text(mixer_text().replace(*own), MIXER, "copy")
    assert "3100" not in text
    tables = '[[identification.registers]]\nparameter = "TYPE"\nvalues = [3100]\n\n'
    text = new_profile_text(mixer_text().replace(LINK, tables + LINK), MIXER, "copy")
    assert "3100" not in text
    assert LINK in text
