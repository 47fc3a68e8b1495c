"""Coils and discrete inputs in a profile: `--check` and `--prove`."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from tui.drive.profile import library
from tui.drive.profile.rules.registers import functions
from tui.simulator.charts.own import OwnChart
from tui.simulator.proving.proof_steps import prove_profile

FILE = Path(__file__).parent / "coils.toml"
TEXT = FILE.read_text("utf-8")
CTRL = 'number = "00002"\naddress = 1\nfunction = 1\nwords = 4\n'
FAN = 'number = "00017"\naddress = 16\nfunction = 1\n'
STAT = 'number = "10001"\naddress = 0\nfunction = 2\nwords = 3\n'
BLOCK = """
[[blocks]]
id = "block"
name = "Block"
direction = "read"
address = 400
slots = ["FAN"]
selects_by = "address"
max_words = 1

[[references]]
"""

# the change, the message, and a text of the line that it names
FAULTS: dict[str, tuple[tuple[str, str], str, str]] = {
    "a discrete input that is written": (
        ('access = "r"\ngroup = "Monitoring"\nquantity = "status_word"',
         'access = "rw"\ngroup = "Monitoring"\nquantity = "status_word"'),
        "STAT: a discrete input (function 2) can only be read: access must be r.",
        "function = 2",
    ),
    "a command on discrete inputs": (
        ('status = "STAT"\ncommand = "CTRL"', 'status = "CTRL"\ncommand = "STAT"'),
        "STAT has access r. A command word must be writable",
        'command = "STAT"',
    ),
    "a coil with a scale": (
        (FAN, FAN + 'scale = "0.1"\n'),
        "FAN: a coil (function 1) is 0 or 1 and has no scale.",
        'scale = "0.1"',
    ),
    "a coil with a unit": (
        (FAN, FAN + 'unit = "Hz"\n'),
        "FAN: a coil (function 1) is 0 or 1 and has no unit.",
        'unit = "Hz"',
    ),
    "a coil of 32 bits": (
        (FAN, FAN + 'type = "uint32"\n'),
        "FAN: a coil (function 1) is 0 or 1 and has no type.",
        'type = "uint32"',
    ),
    "inputs as a text": (
        (STAT, STAT + 'type = "ascii"\n'),
        "STAT: a discrete input (function 2) is 0 or 1 and has no type.",
        'type = "ascii"',
    ),
    "a part of a coil": (
        (FAN, FAN + "mask = 1\n"), "FAN: a coil (function 1) is 0 or 1 and has no mask.", "mask",
    ),
    "a coil in EEPROM": (
        (FAN, FAN + "eeprom_address = 17\n"),
        "FAN: a coil (function 1) is 0 or 1 and has no eeprom_address.",
        "eeprom_address",
    ),
    "a coil in a block": (
        ("\n[[references]]\n", BLOCK),
        "block block: FAN is on coils or inputs. A block holds registers.",
        "[[blocks]]",
    ),
    "coils beyond the last address": (
        (CTRL, CTRL.replace("address = 1", "address = 65533")),
        "CTRL: exceeds address 65535.",
        "address = 65533",
    ),
    "a coil at an address that no frame has": (
        (FAN, FAN.replace("address = 16", "address = 65536")), "65535", "address = 65536",
    ),
    "seventeen coils in a word": (
        (STAT, STAT.replace("words = 3", "words = 17")),
        "STAT: at most 16 coils form a word, not 17.",
        "words = 17",
    ),
    "two parameters on one coil": (
        (FAN, FAN.replace("address = 16", "address = 4")),
        "FAN: coil 4 already belongs to CTRL.",
        "address = 4",
    ),
    "a coil without its function": (
        ('code = 1\nname = "Read coils"', 'code = 7\nname = "Read coils"'),
        "FAN: function 1 is not among the functions. Add it.",
        FAN.splitlines()[2],
    ),
    "several coils without function 15": (
        ("code = 15", "code = 16"), "CTRL: 4 coils are written at once, by function 15", "access",
    ),
    "more coils than function 15 writes": (
        ("max_write = 4", "max_write = 3"),
        "CTRL: 4 coils are written at once, by function 15",
        "access",
    ),
    "a bit that no coil has": (
        ('{ bit = 3, name = "Fault reset" }', '{ bit = 4, name = "Fault reset" }'),
        "CTRL: there is no bit 4 in its 4 coils: 0 to 3.",
        "bits",
    ),
    "a state in an input that is not read": (
        ("mask = 0x2, value = 0x2", "mask = 0x8, value = 0x8"),
        "STAT has 3 bits, its mask more.",
        'id = "fault"',
    ),
    "a command in a coil that is not written": (
        ("words = [0x3]", "words = [0x11]"),
        "order reverse: 0x11 has more bits than CTRL of type uint16.",
        'id = "reverse"',
    ),
    "a stop that is a start": (
        ('name = "Stop", words = [0x0]', 'name = "Stop", words = [0x1]'),
        "order stop: its word 0x0001 is also that of forward",
        'id = "stop"',
    ),
    "a name for a value that a coil lacks": (
        ('1 = "On"', '2 = "On"'), "FAN: it cannot hold the value 2: 0 to 1.", "values",
    ),
}  # fmt: skip


def faults(tmp_path: Path, change: tuple[str, str]) -> list[str]:
    file = tmp_path / "coils.toml"
    assert change[0] in TEXT
    file.write_text(TEXT.replace(*change), "utf-8")
    return [str(fault) for fault in library.faults_of(file)]


def test_profile_of_coils_is_valid() -> None:
    assert library.faults_of(FILE) == []


@pytest.mark.parametrize("name", FAULTS)
def test_each_mistake_is_named_with_its_line(tmp_path: Path, name: str) -> None:
    change, text, place = FAULTS[name]
    found = faults(tmp_path, change)
    lines = (tmp_path / "coils.toml").read_text("utf-8").splitlines()
    own = [fault for fault in found if text in fault]
    assert own, found
    number = int(own[0].split(":")[1])
    assert place in lines[number - 1], own[0]


def failed(path: Path) -> dict[str, str]:
    return {step.title: step.fault for step in prove_profile(library.load_file(path)) if step.fault}


def test_profile_of_coils_passes_its_test() -> None:
    titles = {step.title for step in prove_profile(library.load_file(FILE))}
    assert {"stop stops from forward", "stop stops from a fault"} <= titles
    assert failed(FILE) == {}


SINGLE = (
    ("code = 15", "code = 16"),
    ('command = "CTRL"', 'command = "RUN"'),
    ('  { id = "reverse", name = "Run reverse", words = [0x3], states = ["ready", "running"] },\n',
     ""),
    ('name = "Fault reset", words = [0x8, 0x0]',
     'name = "Fault reset", parameter = "FAN", words = [1, 0]'),
    ('code = "CTRL"', 'code = "RUN"'),
    ('parameter = "CTRL"', 'parameter = "RUN"'),
    ("words = 4\nbits = [\n", "bits = [\n"),
    ('  { bit = 1, name = "Reverse" },\n  { bit = 3, name = "Fault reset" },\n', ""),
    ('storage = "eeprom"', 'storage = "ram"'),
)  # fmt: skip
"""Changes that make it a drive of single coils, without function 15."""


def single_coils(tmp_path: Path) -> Path:
    text = TEXT[: TEXT.index("[[frames]]")] + TEXT[TEXT.index("[[parameters]]") :]
    for before, after in SINGLE:
        assert before in text, before
        text = text.replace(before, after)
    file = tmp_path / "single.toml"
    file.write_text(text, "utf-8")
    return file


def test_profile_of_single_coils_passes_its_test(tmp_path: Path) -> None:
    file = single_coils(tmp_path)
    assert library.faults_of(file) == []
    assert failed(file) == {}


def test_stop_that_does_not_stop_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OwnChart, "_end", lambda *_: None)
    assert failed(FILE)["stop stops from forward"].startswith("it does not stop")


def test_drive_of_coils_alone_needs_no_function_that_reads_registers() -> None:
    """Any function that reads is enough, unless a parameter needs another one."""
    data = library.load_file(FILE).data
    (reads,) = [function for function in data.functions if function.code == 1]
    (fan,) = [parameter for parameter in data.parameters if parameter.code == "FAN"]
    only = replace(data, functions=[reads], parameters=[replace(fan, access="r")])
    assert list(functions(only)) == []
    none = replace(data, functions=[replace(reads, code=6)], parameters=[])
    assert list(functions(none)) == [
        (("functions",), "function 3 is missing, so nothing can be read.")
    ]
