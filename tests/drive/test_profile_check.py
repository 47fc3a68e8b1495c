"""`profiles --check`: every error in one run, with its line and the allowed values."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from tui.cli.main import main
from tui.drive.profile import library
from tui.drive.profile.toml_lines import toml_lines

COMMANDED = (Path(__file__).parent / "pump.toml").read_text(encoding="utf-8")
RUNNING = '{ id = "running", name = "Running", kind = "running", mask = 0x0002, value = 0x0002 },'
FAULT = '  { id = "fault", name = "Fault", kind = "fault", mask = 0x0004, value = 0x0004 },\n'
PAIR = """
[[parameters]]
code = "PAIR"
name = "Counter"
number = "40303"
address = 302
type = "uint32"
access = "r"
group = "Monitoring"
source = "guide 4.3"
confidence = "manual"
"""
WRITTEN_PAIR = PAIR.replace('"r"', '"rw"')
HALT = PAIR.replace("PAIR", "HALT").replace('"uint32"', '"uint16"')
INPUTS = """
[[functions]]
code = 4
name = "Read input registers"
"""
BOTH = """
[[functions]]
code = 23
name = "Read and write"
max_read = 125
max_write = 122
"""
BLOCK = """
[[blocks]]
id = "block"
name = "Block"
direction = "read"
address = 400
slots = ["MODE"]
selects_by = "address"
max_words = {}
"""
SOURCE = """
[[control_sources]]
id = "line"
name = "The line"
command = { sources = ["Modbus"] }
reference = { sources = ["Modbus"] }
settings = [{ parameter = "MODE", value = 7 }]
"""
PATH = """
[[signal_paths]]
id = "command"
carries = "command"
first = {{ {first} }}
source = "{source}"
confidence = "manual"

[[signal_paths.switches]]
name = "MODE"
parameter = "MODE"
other = {{ {other} }}
positions = [{positions}]
"""
CONTACTS = '{ contact = 1, when = [{ parameter = "MODE", values = [0] }] }, { contact = 0 }'


def path(
    first: str = 'name = "Terminals"',
    other: str = 'name = "Modbus", is_line = true',
    positions: str = CONTACTS,
    source: str = "guide 5.3",
) -> list[tuple[str, str]]:
    """A signal path with one switch, added to the file."""
    text = PATH.format(first=first, other=other, positions=positions, source=source)
    return [("\n[[enumerations]]", f"{text}\n[[enumerations]]")]


Change = tuple[str, str]
PLACE = "\n[[enumerations]]"


def also(words: str) -> Change:
    """The change that gives the running state a further word."""
    return RUNNING, RUNNING.replace(" },", f", also = [{{ {words} }}] }},")


FULL_SCALE = 'unit = "{}"\nfull_scale = {{ counts = 20000, parameter = "{}" }}'
BY_SIGN = """
[[references]]
parameter = "CTRL"
kind = "frequency"
reverse = "negative"

[faults]
"""

# the change, the message, and a text of the line that it names
FAULTS: dict[str, tuple[list[Change], str, str]] = {
    "no stop": (
        [('  { id = "stop", name = "Stop", words = [0] },\n', "")],
        "it can run a motor but has no stop",
        "orders = [",
    ),
    "a stop in some states only": (
        [('"Stop", words = [0] }', '"Stop", words = [0], states = ["running"] }')],
        "no stop applies in every state",
        "orders = [",
    ),
    "nothing is seen to run": (
        [(RUNNING, RUNNING.replace('kind = "running"', 'kind = "stopped"'))],
        "no state of the kind running",
        "states = [\n",
    ),
    "a command with bits that a word of 16 bits lacks": (
        [('"Stop", words = [0] }', '"Stop", words = [0x20000] }')],
        "order stop: 0x20000 has more bits than CTRL of type uint16.",
        'id = "stop"',
    ),
    "a negative command word of 32 bits": (
        [
            ("address = 300\n", 'address = 300\ntype = "uint32"\n'),
            ('"Stop", words = [0] }', '"Stop", words = [-2] }'),
        ],
        "order stop: -2 is negative. Write the 32 bits of CTRL in hexadecimal.",
        'id = "stop"',
    ),
    "a stop of 32 bits that is a start": (
        [
            ("address = 300\n", 'address = 300\ntype = "uint32"\n'),
            ('"Run", words = [1]', '"Run", words = [0x10001]'),
            ('"Stop", words = [0] }', '"Stop", words = [0x10001] }'),
        ],
        "order stop: its word 0x10001 is also that of forward",
        'id = "stop"',
    ),
    "a command word of 32 bits without function 16": (
        [("address = 300\n", 'address = 300\ntype = "uint32"\n')],
        "CTRL: two words are written by function 16",
        'access = "rw"\ngroup = "Command"',
    ),
    "a status word with a fraction": (
        [("address = 100\n", 'address = 100\ntype = "float32"\nscale = "0.1"\n')],
        "STAT is float32. Use uint32.",
        'status = "STAT"',
    ),
    "a state in bits that a word of 16 bits lacks": (
        [(RUNNING, RUNNING.replace("0x0002", "0x20002"))],
        "STAT has 16 bits, its mask more",
        '{ id = "running"',
    ),
    "a further word of a state that is the status word": (
        [also('parameter = "STAT", values = [1]')],
        "also names STAT. It is for words beside the status word.",
        '{ id = "running"',
    ),
    "a further word of a state that does not exist": (
        [also('parameter = "STAT9", values = [1]')],
        "STAT9",
        '{ id = "running"',
    ),
    "a further word of a state that is a measurement": (
        [also('parameter = "FREQ", values = [1]')],
        "also names FREQ, which is a measurement",
        '{ id = "running"',
    ),
    "a further word of a state with bits outside its mask": (
        [also('parameter = "TRIP", mask = 1, values = [2]')],
        "a value of TRIP has bits outside its mask",
        '{ id = "running"',
    ),
    "a further word of a state without a value": (
        [also('parameter = "TRIP", mask = 1, values = []')],
        "or none is given",
        '{ id = "running"',
    ),
    "a bit that a word of 16 bits lacks": (
        [('bit = 3, name = "Pump dry"', 'bit = 16, name = "Pump dry"')],
        "there is no bit 16 in uint16: 0 to 15",
        "bits = [",
    ),
    "a float without a resolution": (
        [(PLACE, f"{PAIR.replace('uint32', 'float32')}{PLACE}")],
        "a float32 has a resolution as its scale",
        'type = "float32"',
    ),
    "a limit of a value with an offset": (
        [('unit = "s"\nscale = "0.01"', 'unit = "s"\noffset = "-40"\nmax_from = "TOUT"')],
        "an offset or a negative scale has neither",
        '[[parameters]]\ncode = "RAMP"',
    ),
    "a command that is a part of a register": (
        [("address = 300\n", "address = 300\nmask = 0x00FF\n")],
        "CTRL is a part of a register",
        'command = "CTRL"',
    ),
    "a command word that cannot be written": (
        [('access = "rw"\ngroup = "Command"', 'access = "r"\ngroup = "Command"')],
        "CTRL has access r. A command word must be writable",
        'command = "CTRL"',
    ),
    "a command word in an input register": (
        [
            ("[[functions]]\ncode = 6", f"{INPUTS}\n[[functions]]\ncode = 6"),
            ('access = "rw"\ngroup = "Command"', 'access = "r"\nfunction = 4\ngroup = "Command"'),
        ],
        "CTRL has access r. A command word must be writable",
        'command = "CTRL"',
    ),
    "a stop word in another register that cannot be written": (
        [
            ('"Stop", words = [0] }', '"Stop", words = [0], parameter = "HALT" }'),
            ("\n[[enumerations]]", f"{HALT}\n[[enumerations]]"),
        ],
        "HALT has access r. A command word must be writable",
        '  { id = "stop"',
    ),
    "a stop word that is locked while the motor runs": (
        [('access = "rw"\ngroup = "Command"', 'access = "rw-stopped"\ngroup = "Command"')],
        "order stop: CTRL can be written only with the motor stopped (access rw-stopped)",
        '  { id = "stop"',
    ),
    "a status word that cannot be read": (
        [
            (
                'access = "r"\ngroup = "Monitoring"\nquantity = "status_word"',
                'access = "w"\ngroup = "Monitoring"\nquantity = "status_word"',
            )
        ],
        "STAT has access w. A status word must be readable",
        'status = "STAT"',
    ),
    "a read that no request holds": (
        [("max_read = 16", "max_read = 126")],
        "allowed is 1 to 125",
        "max_read = 126",
    ),
    "a read of nothing": (
        [("max_read = 16", "max_read = 0")],
        "allowed is 1 to 125",
        "max_read = 0",
    ),
    "a write that no request holds": (
        [('"Write single register"', '"Write single register"\nmax_write = 124')],
        "allowed is 1 to 123",
        "max_write = 124",
    ),
    "a write by function 23 that no request holds": (
        [("[[functions]]\ncode = 6", f"{BOTH}\n[[functions]]\ncode = 6")],
        "function 23 writes at most 121 words",
        "max_write = 122",
    ),
    "a sub-function that no request holds": (
        [('"Write single register"', '"Write single register"\nsubfunctions = [0, 65536]')],
        "allowed is 0 to 65535",
        "subfunctions = [0, 65536]",
    ),
    "a negative sub-function": (
        [('"Write single register"', '"Write single register"\nsubfunctions = [-1]')],
        "allowed is 0 to 65535",
        "subfunctions = [-1]",
    ),
    "an exception code that no reply holds": (
        [('"Write single register"', '"Write single register"\npast_limit_exception = 256')],
        "allowed is 1 to 255",
        "past_limit_exception = 256",
    ),
    **{
        f"a block of {words} words": (
            [("# Parameters come last", f"{BLOCK.format(words)}\n# Parameters come last")],
            "allowed is 1 to 125",
            f"max_words = {words}",
        )
        for words in (-1, 0, 126)
    },
    "a block that is written and no request holds": (
        [
            (
                "# Parameters come last",
                BLOCK.format(124).replace('"read"', '"write"') + "\n# Parameters come last",
            )
        ],
        "block block: a request writes at most 123 words",
        "max_words = 124",
    ),
    "a block that is shorter than its shortest access": (
        [("# Parameters come last", BLOCK.format(4) + "min_words = 5\n# Parameters come last")],
        "block block: min_words 5 is above max_words 4",
        "min_words = 5",
    ),
    "a block past the last register": (
        [
            (
                "# Parameters come last",
                BLOCK.format(4).replace("400", "65533") + "\n# Parameters come last",
            )
        ],
        "block block: 4 words from 65533 exceed address 65535",
        "address = 65533",
    ),
    "no way to the running state": (
        [('status = "STAT"\n', 'status = "STAT"\nruns_in = "running"\n')],
        "no command leads from ready to running",
        "runs_in",
    ),
    "a running state that no transition leads to": (
        [
            (
                'status = "STAT"\n',
                'status = "STAT"\ntransitions = [{ source = "running", target = "ready" }]\n',
            )
        ],
        "no transition leads to the running state running",
        'id = "running"',
    ),
    "a fault that is not seen": (
        [(FAULT, ""), ('[faults]\nparameter = "TRIP"\n', "[faults]\n")],
        "would look healthy",
        "states = [\n",
    ),
    "a hidden state": (
        [(FAULT, ""), (RUNNING, f"{RUNNING}\n{FAULT.replace('0x0004', '0x0006')}")],
        "state fault is never reached: running above it",
        'id = "fault"',
    ),
    "two words at one address": (
        [("address = 202", "address = 203")],
        "address 203 already belongs to",
        "address = 203\nunit",
    ),
    "a pair over another word": (
        [("\n[[enumerations]]", f"{PAIR.replace('302', '299')}\n[[enumerations]]")],
        "PAIR is uint32 and uses 299 to 300",
        "address = 299",
    ),
    "a pair that could not be written": (
        [("\n[[enumerations]]", f"{WRITTEN_PAIR}\n[[enumerations]]")],
        "written by function 16",
        'access = "rw"\ngroup = "Monitoring"',
    ),
    "a factory value past its limit": (
        [("factory = 300", "factory = 7000")],
        "factory 7000 is outside its limits, 10 to 6000",
        "factory = 7000",
    ),
    "letters as a key of scales": (
        [
            (
                'scale = "0.01"',
                'scale_by = { parameter = "MODE", scales = { high = "0.1" } }',
            )
        ],
        "'high' is not a raw value in decimal",
        "scale_by",
    ),
    "one fault twice": (
        [("raw = 7, code", "raw = 1, code")],
        "fault 1 occurs twice",
        'raw = 1, code = "COM"',
    ),
    "a word that is not there": (
        [('parameter = "KEEP"\nraw', 'parameter = "KEPT"\nraw')],
        "no parameter 'KEPT'. Did you mean KEEP?",
        'parameter = "KEPT"',
    ),
    "limits form a circle": (
        [
            ("min = 10\n", 'min = 10\nmax_from = "TOUT"\n'),
            ("min = 0\nmax = 60\n", 'min = 0\nmax = 60\nmax_from = "RAMP"\n'),
        ],
        "RAMP <= TOUT <= RAMP",
        'max_from = "TOUT"',
    ),
    "a proposed value that is none": (
        [("\n[[enumerations]]", f"{SOURCE}\n[[enumerations]]")],
        "MODE = 7: is not one of its values: 0 By hand, 1 Pressure, 2 Level",
        "value = 7",
    ),
    "a source of a path without a name": (
        path(first=""),
        "a source has either a name or a parameter",
        "first = {",
    ),
    "a source of a path that is this line in two ways": (
        path(first='parameter = "MODE", is_line = true'),
        "`is_line` and `word` are for a source with a name",
        "first = {",
    ),
    "a value of a path that is none": (
        path(first='parameter = "MODE", line = [7]'),
        "MODE has no value 7",
        "first = {",
    ),
    "a contact without a position": (
        path(positions="{ contact = 0 }"),
        "no position connects contact 1",
        "[[signal_paths.switches]]",
    ),
    "a contact that does not exist": (
        path(positions=CONTACTS.replace("{ contact = 0 }", "{ contact = 0 }, { contact = 2 }")),
        "must be <= 1, not 2",
        "positions = [",
    ),
    "a position after the last one": (
        path(positions="{ contact = 0 }, { contact = 1 }"),
        "a position without conditions must be the last one",
        "[[signal_paths.switches]]",
    ),
    "a position at a value that is none": (
        path(positions=CONTACTS.replace("[0]", "[9]")),
        "MODE has no value 9",
        "[[signal_paths.switches]]",
    ),
    "a word of a path that is not there": (
        path(other='name = "Modbus", is_line = true, word = "WORD"'),
        "there is no parameter 'WORD'",
        "other = {",
    ),
    "a path without a document": (
        path(source="memory"),
        "its source begins with the id of a document. Known: guide",
        'source = "memory"',
    ),
    "a factory value that is no name": (
        [('2 = "Level" }\nfactory = 0', '2 = "Level" }\nfactory = 5')],
        "MODE = 5: is not one of its values",
        "factory = 5",
    ),
    "no source": (
        [('source = "guide 5.2"', 'source = ""')],
        "Known: guide",
        'source = ""',
    ),
    "bits of two fields": (
        [
            ("address = 202", "address = 201"),
            ('code = "TOUT"', 'mask = 3\ncode = "TOUT"'),
            ('code = "MODE"', 'mask = 7\nshift = 1\ncode = "MODE"'),
        ],
        "bits 16#0002 of address 201 also belong to MODE",
        "address = 201\nunit",
    ),
    "an input register without its function": (
        [('code = "FREQ"', 'function = 4\ncode = "FREQ"')],
        "function 4 is not among the functions",
        "function = 4",
    ),
    "a group that nobody is in": (
        [("\n[[enumerations]]", '\n[[groups]]\nname = "Pumps"\n\n[[enumerations]]')],
        "no parameter is in the group 'Pumps'",
        'name = "Pumps"',
    ),
    "two words written, but one at a time": (
        [
            ("\n[[charts]]", '\n[[functions]]\ncode = 16\nname = "Write"\n\n[[charts]]'),
            ("\n[[enumerations]]", f"\n{WRITTEN_PAIR}\n[[enumerations]]"),
        ],
        "function 16 has no max_write above 1",
        'access = "rw"\ngroup = "Monitoring"',
    ),
    "a full scale in another unit": (
        [('unit = "s"\nscale = "0.01"', FULL_SCALE.format("s", "FREQ"))],
        "full scale FREQ has the unit Hz, and its own unit is s",
        "full_scale",
    ),
    "a full scale beside a scale": (
        [('unit = "s"\nscale = "0.01"', FULL_SCALE.format("s", "TOUT") + '\nscale = "0.01"')],
        "it has full_scale, so omit scale",
        "full_scale",
    ),
    "a full scale that is none": (
        [('unit = "s"\nscale = "0.01"', FULL_SCALE.format("s", "TOTU"))],
        "there is no parameter 'TOTU'. Did you mean TOUT",
        "full_scale",
    ),
    "a reference by its sign in an unsigned word": (
        [("\n[faults]\n", BY_SIGN)],
        "reference CTRL: it holds no negative value",
        'reverse = "negative"',
    ),
    "a reference by its sign with two commands": (
        [
            ("\n[faults]\n", BY_SIGN),
            ("address = 300\n", 'address = 300\ntype = "int16"\n'),
            (
                "words = [0] },\n",
                'words = [0] },\n  { id = "reverse", name = "R", words = [3] },\n',
            ),
        ],
        "the commands forward and reverse of the chart pump differ",
        'reverse = "negative"',
    ),
    "a field that is none": (
        [("min = 10\n", "mini = 10\n")],
        "`mini` is not a field of this table; did you mean min",
        "mini = 10",
    ),
    "a name that is none": (
        [('access = "rw-stopped"\nstorage', 'access = "stopped"\nstorage')],
        "Allowed: r, rw, rw-stopped, w",
        'access = "stopped"',
    ),
    "a number out of range": (
        [("address = 300", "address = 70000")],
        "allowed is 0 to 65535",
        "address = 70000",
    ),
    "an id that is a word of the command": (
        [('id = "example-pump"', 'id = "path"')],
        "path' is reserved",
        'id = "path"',
    ),
    "a field too few": (
        [('number = "40301"\n', "")],
        "the field `number` is missing",
        '[[parameters]]\ncode = "CTRL"',
    ),
}


def checked(tmp_path: Path, text: str) -> list[str]:
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    return library.faults_of(path)


def test_unbroken_test_profile_is_valid(tmp_path: Path) -> None:
    assert checked(tmp_path, COMMANDED) == []


@pytest.mark.parametrize("name", FAULTS)
def test_each_error_is_reported_at_its_line(tmp_path: Path, name: str) -> None:
    changes, reported, at = FAULTS[name]
    text = COMMANDED
    for right, wrong in changes:
        assert text.count(right) == 1, right
        text = text.replace(right, wrong)
    found = checked(tmp_path, text)
    [fault] = [item for item in found if reported in item] or [f"not told, but: {found}"]
    line = text[: text.index(at)].count("\n") + 1
    assert fault.startswith(f"{tmp_path / 'own.toml'}:{line}: "), fault


def test_all_errors_are_reported_in_one_run(tmp_path: Path) -> None:
    """Those of the form do not hide those of the rest."""
    some = ("a field that is none", "a number out of range", "no stop", "one fault twice",
            "a word that is not there", "a field too few", "a hidden state")  # fmt: skip
    text = COMMANDED
    for name in some:
        for right, wrong in FAULTS[name][0]:
            text = text.replace(right, wrong)
    found = checked(tmp_path, text)
    assert [name for name in some if not any(FAULTS[name][1] in item for item in found)] == []
    lines = [int(item.split(":")[1]) for item in found]
    assert lines == sorted(lines)


def test_several_files_are_checked(tmp_path: Path) -> None:
    right, wrong, no_toml = (tmp_path / f"{n}.toml" for n in ("right", "wrong", "none"))
    right.write_text(COMMANDED, encoding="utf-8")
    wrong.write_text(COMMANDED.replace("factory = 300", "factory = 7000"), encoding="utf-8")
    no_toml.write_text('[profile]\nid = "x\n', encoding="utf-8")
    done = CliRunner().invoke(main, ["profiles", "--check", *map(str, (right, wrong, no_toml))])
    assert done.exit_code == 2
    assert "right.toml: Example pump drive, 8 parameters, no fault found" in done.output
    assert "outside its limits" in done.output
    assert "none.toml:2: not valid TOML" in done.output
    reported = CliRunner().invoke(main, ["profiles", "--json", "--check", str(right), str(wrong)])
    assert reported.exit_code == 2
    assert [len(load["faults"]) for load in json.loads(reported.output)] == [0, 1]


def test_line_is_found_for_every_kind_of_location() -> None:
    text = '''a = 1 # [no.header]
"b.c".d = """
[not]
"""
[x]
list = [ # of tables
  { k = "}" },
  { k = [1,
     2] },
]
[[rows]]
n = 'it''s'
[[rows]]
[rows.inner]
m = 1
[[rows.more]]
o = 1979-05-27
'''.replace("it''s", "its")
    lines = toml_lines(text)
    assert lines["a",] == 1
    assert lines["b.c", "d"] == 2
    assert ("not",) not in lines
    assert lines["x", "list", 1, "k", 1] == 9
    assert (lines["rows", 0, "n"], lines["rows", 1], lines["rows", 1, "inner", "m"]) == (12, 13, 15)
    assert lines["rows", 1, "more", 0, "o"] == 17
