"""Probable mistakes of a valid profile: `profiles --check` gives a hint with its line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from tui.cli.main import main
from tui.drive.profile import library

PUMP = Path(__file__).parent / "pump.toml"
ATV320 = Path(__file__).parents[1] / "line" / "profiles" / "atv320-kind.toml"
RAMP = 'max = 6000\nfactory = 300\naccess = "rw"\nstorage = "{}"\n'
SAVE = """[memory.save]
parameter = "KEEP"
raw = 1
does = "All settings are copied to EEPROM. The motor must be stopped."
source = "guide 5.4"
"""
PAIR = '\ncode = "FREQ"\nname = "Output frequency"\nnumber = "40102"\naddress = 110\ntype = "{}"\n'
FREQ = (
    '\ncode = "FREQ"\nname = "Output frequency"\nnumber = "40102"\naddress = 101\ntype = "int16"\n'
)
WATCH = "fault = 7\n"
REACTION = """fault = 7
reaction = "MODE"
reactions = [
  {{ raw = 0, name = "Stop and trip", does = "Stops.", trips = {} }},
]
"""


HINTS = {
    "a setting in RAM": (
        [(RAMP.format("eeprom"), RAMP.format("ram"))],
        "storage ram makes a command of RAMP: no setting, and in no backup. A setting has eeprom,"
        " ram-until-saved or unknown.",
        'storage = "ram"\ngroup = "Settings"',
    ),
    "a setting that nothing saves": (
        [(RAMP.format("eeprom"), RAMP.format("ram-until-saved")), (SAVE, "")],
        "parameter RAMP: neither [memory.save] nor an eeprom_address saves it, so --save is"
        " refused.",
        'storage = "ram-until-saved"',
    ),
    "a trip that is none": (
        [(WATCH, REACTION.format("false"))],
        "reaction 'Stop and trip': its text has a trip, but trips is false.",
        "{ raw = 0, name",
    ),
    "an address beside its number": (
        [(FREQ, PAIR.format("int16"))],
        "parameter FREQ: its address 110 breaks the pattern of the other 7 rows: 101 for 40102.",
        "address = 110",
    ),
}


def written(tmp_path: Path, changes: list[tuple[str, str]]) -> tuple[Path, str]:
    text = PUMP.read_text("utf-8")
    for right, wrong in changes:
        assert text.count(right) == 1, right
        text = text.replace(right, wrong)
    path = tmp_path / "own.toml"
    path.write_text(text, "utf-8")
    return path, text


@pytest.mark.parametrize("name", HINTS)
def test_probable_mistake_gets_a_hint_at_its_line(tmp_path: Path, name: str) -> None:
    changes, hint, place = HINTS[name]
    path, text = written(tmp_path, changes)
    line = text[: text.index(place)].count("\n") + 1
    assert library.hints_of(path) == [f"{path}:{line}: {hint}"]
    assert library.all_faults_of(path) == []


def test_missing_order_of_two_words_gets_a_hint(tmp_path: Path) -> None:
    path, _ = written(tmp_path, [(FREQ, PAIR.format("int32"))])
    [_, order] = library.hints_of(path)
    assert "parameter FREQ: no low_word_first states which of its two words is first" in order
    path.write_text(
        path.read_text("utf-8").replace(
            "[[charts]]", "[reading]\nlow_word_first = false\n\n[[charts]]"
        ),
        "utf-8",
    )
    assert len(library.hints_of(path)) == 1


@pytest.mark.parametrize(
    ("added", "first"), [(40001, 40001), (30001, 30001), (400, None), (40000, 40001)]
)
def test_numbers_of_the_manual_as_addresses_get_one_hint(
    tmp_path: Path, added: int, first: int | None
) -> None:
    text = re.sub(
        r"^address = (\d+)",
        lambda found: f"address = {added + int(found[1])}",
        PUMP.read_text("utf-8"),
        flags=re.M,
    )
    path = tmp_path / "own.toml"
    path.write_text(text, "utf-8")
    hints = [hint for hint in library.hints_of(path) if "manual's numbers" in hint]
    assert len(hints) == (first is not None)
    if first is not None:
        assert f"addresses from {first} up are the manual's numbers" in hints[0]
        assert f"the wire address is the number - {first}, here 100." in hints[0]
        assert ("They need function = 4" in hints[0]) == (first == 30001)


def test_sign_without_a_reverse_command_gets_a_hint(tmp_path: Path) -> None:
    text = ATV320.read_text("utf-8")
    unsigned, path = re.sub('.*id = "reverse".*\n', "", text), tmp_path / "own.toml"
    signed = unsigned.replace('feedback = "RFR"', 'feedback = "RFR"\nsigned = true')
    assert text != unsigned != signed
    for source, reported in ((text, 0), (unsigned, 0), (signed, 1)):
        path.write_text(source, "utf-8")
        assert library.all_faults_of(path) == []
        found = [hint for hint in library.hints_of(path) if "it has a sign" in hint]
        assert len(found) == reported
    line = signed[: signed.index("[[references]]")].count("\n") + 1
    assert found[0].startswith(f"{path}:{line}: reference LFR: ")
    assert found[0].endswith('reverse with the words of forward, and reverse = "negative" here.')


def test_few_high_addresses_get_no_hint(tmp_path: Path) -> None:
    path, _ = written(tmp_path, [(FREQ, FREQ.replace("address = 101", "address = 40101"))])
    assert not any("manual's numbers" in hint for hint in library.hints_of(path))


def test_profiles_without_a_doubt_get_no_hint(tmp_path: Path) -> None:
    assert library.hints_of(PUMP) == []
    path, _ = written(tmp_path, [(WATCH, REACTION.format("true"))])
    assert library.hints_of(path) == []


def test_hint_is_printed_and_the_file_is_right(tmp_path: Path) -> None:
    path, _ = written(tmp_path, HINTS["a setting in RAM"][0])
    done = CliRunner().invoke(main, ["profiles", "--check", str(path)])
    assert done.exit_code == 0, done.output
    assert "no fault found" in done.output
    assert f"hint: {path}:" in done.output
