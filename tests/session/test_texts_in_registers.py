"""Texts in registers (`ascii`): decoded, shown and stored as text, and never written."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.mixer import HERTZ, MIXER, installed_mixer, mixer_text
from tui.bus.fake import FakeLine
from tui.cli.main import main
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.shown import number_of, shown
from tui.drive.words import from_words, raw_of_characters, to_words
from tui.session.connect.identify import identify_drive
from tui.simulator import DriveSpec, SimulatedDrive

ROW = """
[[parameters]]
code = "SERIAL"
name = "Serial number"
number = "43300"
address = 3300
type = "ascii"
words = 4
access = "r"
group = "Identity"
source = "guide"
confidence = "manual"
"""
WORDS = [0x4142, 0x4344, 0x3132, 0x2000]
IDENTITY = '[identification]\nregisters = [{ parameter = "SERIAL", begins = ["abcd"] }]\n\n[link]\n'


def installed(row: str = ROW, *changes: tuple[str, str]) -> Profile:
    return installed_mixer(HERTZ, row, *changes)


@pytest.mark.parametrize(
    ("words", "swapped", "text"),
    [
        (WORDS, False, "ABCD12"),
        (WORDS, True, "BADC21"),
        ([0, 0, 0, 0], False, "(empty)"),
        ([0x2020] * 4, False, "(empty)"),
        ([0x4100, 0x4242, 0, 0], False, "A"),
        ([0x411B, 0x5B32, 0x4A42, 0], False, "A␛[2JB"),
        ([0xFFE9, 0x4142, 0, 0], False, "\ufffd\ufffdAB"),
        ([0x4142] * 4, False, "ABABABAB"),
    ],
)
def test_registers_are_shown_as_text(words: list[int], swapped: bool, text: str) -> None:
    row = ROW.replace("words = 4", "words = 4\nlow_byte_first = true") if swapped else ROW
    profile = installed(row)
    serial = profile["SERIAL"]
    raw = from_words(serial, words)
    value = shown(profile, serial, raw, {})
    assert (value.display, value.number) == (text, None)
    assert number_of(profile, serial, raw, {}) is None
    assert list(to_words(serial, raw)) == words


@pytest.mark.parametrize("swapped", [False, True])
def test_characters_become_the_words_that_show_them(swapped: bool) -> None:
    row = ROW.replace("words = 4", f"words = 4\nlow_byte_first = {str(swapped).lower()}")
    profile = installed(row)
    for text in ("A", "AB", "ABCDEFGH"):
        raw = raw_of_characters(profile["SERIAL"], text)
        assert shown(profile, profile["SERIAL"], raw, {}).text == text
    assert raw_of_characters(profile["SERIAL"], "ABCDEFGHI") == raw_of_characters(
        profile["SERIAL"], "ABCDEFGH"
    )


def test_read_and_backup_of_a_simulated_drive_contain_the_text(tmp_path: Path) -> None:
    installed()
    read = CliRunner().invoke(main, ["read", f"sim:{MIXER}", "SERIAL", "STAT", "--json"])
    assert read.exit_code == 0, read.output
    value = json.loads(read.stdout)["values"]["SERIAL"]
    assert (value["text"], value["raw"], value["value"]) == ("SERIAL", None, None)
    table = CliRunner().invoke(main, ["read", f"sim:{MIXER}", "SERIAL"])
    assert table.output.splitlines()[1].split()[:4] == ["SERIAL", "Serial", "number", "SERIAL"]
    assert len(table.output.splitlines()[1].split()) == 7, "no raw value"
    path = tmp_path / "mixer-set.toml"
    backup = CliRunner().invoke(main, ["backup", f"sim:{MIXER}", str(path)])
    assert backup.exit_code == 0, backup.output
    saved = tomllib.loads(path.read_text("utf-8"))
    assert saved["parameters"]["Identity"]["SERIAL"]["value"] == "SERIAL"
    restored = CliRunner().invoke(main, ["restore", f"sim:{MIXER}", str(path), "--dry-run"])
    assert restored.exit_code == 0, restored.output


def test_text_is_never_written() -> None:
    installed()
    written = CliRunner().invoke(main, ["write", f"sim:{MIXER}", "SERIAL=AB", "--arm"])
    assert written.exit_code in (2, 5)
    assert "SERIAL" in written.output
    drive = SimulatedDrive(library.load(MIXER), DriveSpec(MIXER, 1))
    assert drive.line_side.answer(1, bytes.fromhex("06 0c e4 41 42")) == bytes([0x86, 2])


async def test_beginning_of_a_text_identifies_a_drive() -> None:
    installed(ROW, ("[link]\n", IDENTITY))
    words = {100: 1, **{3300 + place: word for place, word in enumerate(WORDS)}}
    assert (await identify_drive(FakeLine({1: words}), 1)).profile == MIXER
    assert (await identify_drive(FakeLine({1: {**words, 3301: 0x4345}}), 1)).profile is None
    drive = SimulatedDrive(library.load(MIXER), DriveSpec(MIXER, 1))
    assert shown(drive.profile, drive.profile["SERIAL"], drive.raw("SERIAL"), {}).text == "abcd"


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('access = "r"', 'access = "rw"', "a text (ascii) is only read"),
        ("words = 4", 'words = 4\nunit = "Hz"', "a text (ascii) has no unit"),
        ("words = 4", 'words = 4\nscale = "0.1"', "a text (ascii) has no scale"),
        ("words = 4", 'words = 4\nvalues = { 1 = "A" }', "a text (ascii) has no values"),
        ("words = 4", 'words = 4\nquantity = "speed"', "a text (ascii) has no quantity"),
        ("words = 4", "words = 33", "32"),
        ("words = 4", "words = 20", "ascii is 20 words, but function 3 reads 16"),
        ('"ascii"', '"uint16"', "words and low_byte_first are for a text"),
        ("address = 3300", "address = 98", "address 100 also belongs to"),
        ("address = 3300", "address = 65534", "exceeds address 65535"),
    ],
)
def test_check_names_a_wrong_text(before: str, after: str, message: str) -> None:
    text = mixer_text() + ROW.replace(before, after)
    path = library.user_folder() / "mixer.toml"
    path.parent.mkdir(parents=True)
    path.write_text(text, encoding="utf-8")
    result = CliRunner().invoke(main, ["profiles", "--check", str(path)])
    assert result.exit_code == 2
    assert message in result.output, result.output
    assert "mixer.toml:" in result.output


def test_text_cannot_stand_for_a_number() -> None:
    with pytest.raises(DriveError, match="monitoring: SERIAL is a text, not a number"):
        installed(ROW, ('{ parameter = "STAT" }', '{ parameter = "SERIAL" }'))
