"""Mistakes of people who write a profile: `profiles --check` refuses each by name and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.drive.profile import library

KINDS = Path(__file__).parents[1] / "line" / "profiles"
PUMP = Path(__file__).parent / "pump.toml"
FILES = {"pump": PUMP, "atv": KINDS / "atv320-kind.toml", "ms": KINDS / "ms300-kind.toml"}

STOP = 'name = "Stop", words = [0x0001] }'
RAMP = '{ id = "stop", name = "Ramp stop", words = [0x0007] }'
RESET = 'words = [0x0000, 0x0080, 0x0000], states = ["fault"] }'
RESET_ROW = f'  {{ id = "reset", name = "Fault reset", {RESET},\n'
ROWS = f"""  {{ id = "forward", name = "Run forward", words = [0x000F], states = ["operating"] }},
  {{ id = "reverse", name = "Run reverse", words = [0x080F], states = ["operating"] }},
  {RAMP},
  {{ id = "freewheel", name = "Freewheel", words = [0x0000] }},
{RESET_ROW}"""
REFERENCE = 'code = "FREQCMD"\nname = "Frequency command"\nnumber = "2001H"\naddress = 0x2001\n'
RFR_ACCESS = 'address = 3202\ntype = "int16"\nunit = "Hz"\nscale = "0.1"\naccess = "r"\n'
SOURCE = """[[control_sources]]
id = "line"
name = "The line"
command = { sources = ["Modbus"] }
reference = { sources = ["Modbus"] }
settings = [{ parameter = "STATUS", value = 1 }]

[[groups]]
name = "Command"
"""
LOCK = 'interlocks = [{ parameter = "STATUS", values = [0], orders = ["stop"], text = "Not." }]\n'

# file, right text, wrong text, message; the message names the line of the wrong text,
# or that of a further text
MISTAKES: dict[str, tuple[str, ...]] = {
    "only a reset among the commands": (
        "atv",
        ROWS.removesuffix(RESET_ROW),
        "",
        "there is no stop among its commands",
        "orders = [",
    ),
    "a way to run without a command": (
        "atv",
        ROWS + "]\n",
        "]\n",
        "there is no stop among its commands",
        "orders = [",
    ),
    "a stop equal to a start": (
        "ms",
        STOP,
        STOP.replace("0x0001", "0x0012"),
        "would run the motor",
    ),
    "a stop that passes a start": ("ms", STOP, STOP.replace("[", "[0x12, "), "would run the motor"),
    "a stop that differs in an option only": (
        "ms",
        '[[references]]\nparameter = "FREQCMD"',
        '[[charts.options]]\nid = "way"\nname = "Way"\nparameter = "CONTROL"\nmask = 0x13\n'
        'choices = [{ bits = 0, name = "Off" }]\n\n[[references]]\nparameter = "FREQCMD"',
        "order stop: its word 0x0012 is also that of forward",
        'id = "stop"',
    ),
    "a reset that starts": (
        "atv",
        RESET,
        RESET.replace("0x0000]", "0x000F]"),
        "order reset: its word 0x000f is also that of forward",
    ),
    "forward equal to reverse": (
        "ms",
        "[0x0022]",
        "[0x0012]",
        "also those of forward. If the sign of the reference gives the direction, write"
        ' reverse = "negative" in [[references]].',
        'id = "reverse"',
    ),
    "a run command to all drives": (
        "ms",
        '[0x0022], states = ["ready", "running"] }',
        '[0x0022], broadcast = true, states = ["ready", "running"] }',
        "must not be a broadcast",
    ),
    "a stop behind an interlock": (
        "ms",
        "direction = {",
        LOCK + "direction = {",
        "an interlock prevents stop",
        "interlocks",
    ),
    "a run command in a fault only": (
        "ms",
        '[0x0012], states = ["ready", "running"]',
        '[0x0012], states = ["fault"]',
        "order forward: it leads nowhere: none of its states is one of a motor at standstill",
    ),
    "a start while running only": (
        "ms",
        '[0x0012], states = ["ready", "running"]',
        '[0x0012], states = ["running"]',
        "order forward: it leads nowhere",
    ),
    "a run command beside the state of runs_in": (
        "atv",
        'words = [0x000F], states = ["operating"]',
        'words = [0x000F], states = ["ready"]',
        "order forward: it leads nowhere",
    ),
    "a run word of no transition": (
        "atv",
        '"switched-on", target = "operating", command = 0x000F',
        '"switched-on", target = "operating", command = 0x001F',
        "no transition to a running state has its word",
        'id = "forward"',
    ),
    "a stop word of no transition": (
        "atv",
        RAMP,
        RAMP.replace("0x0007", "0x0005"),
        "order stop: it leads nowhere: no transition out of a running state has its word",
    ),
    "a reset word of no transition": (
        "atv",
        RESET,
        RESET.replace("0x0080", "0x0040"),
        "order reset: it leads nowhere: no transition out of a fault has one of its words",
    ),
    "a reset in no fault": (
        "atv",
        RESET,
        RESET.replace('"fault"', '"ready"'),
        "order reset: it leads nowhere: none of its states is a fault",
    ),
    "a stop in a fault only": (
        "ms",
        STOP,
        f'{STOP},\n  {{ id = "quick-stop", name = "Q", words = [0], states = ["fault"] }}',
        "order quick-stop: it leads nowhere: it is allowed in a fault only",
        'id = "quick-stop"',
    ),
    "a transition to itself": (
        "atv",
        '"ready", target = "switched-on"',
        '"ready", target = "ready"',
        "the command leads from ready to itself",
    ),
    "a state without a way out": (
        "atv",
        '  { source = "disabled", target = "ready", command = 0x0006 },\n',
        "",
        "no transition leads out of disabled",
        '"operating", target = "disabled"',
    ),
    "a command word that is forbidden": (
        "ms",
        'address = 0x2000\naccess = "rw"',
        'address = 0x2000\nforbidden = "Not by the line."\naccess = "rw"',
        "order stop: CONTROL is never written",
        'id = "stop"',
    ),
    "a command word above its limit": (
        "ms",
        "address = 0x2000\n",
        "address = 0x2000\nmax = 32\n",
        "order reverse: 0x0022 cannot be written to CONTROL: 0 to 32",
        'id = "reverse"',
    ),
    "a command word with a reserved bit": (
        "ms",
        "address = 0x2000\n",
        "address = 0x2000\nreserved = [5]\n",
        "order reverse: 0x0022 cannot be written to CONTROL: a bit of it is reserved",
        'id = "reverse"',
    ),
    "a command word with a unit": (
        "ms",
        "address = 0x2000\n",
        'address = 0x2000\nunit = "Hz"\n',
        "CONTROL has a unit or a scale",
        'command = "CONTROL"',
    ),
    "a stop in a setting": (
        "ms",
        STOP,
        STOP.replace("words", 'parameter = "01-13", words'),
        "01-13 has a unit or a scale. A command word has none",
    ),
    "a command in a part of a word": (
        "ms",
        "address = 0x2002\n",
        "address = 0x2002\nmask = 3\n",
        "RESET is a part of a",
        'id = "reset"',
    ),
    "a reference that is read-only": (
        "ms",
        REFERENCE + 'unit = "Hz"\nscale = "0.01"\nmax = 59900\naccess = "rw"',
        REFERENCE + 'unit = "Hz"\nscale = "0.01"\nmax = 59900\naccess = "r"',
        "reference FREQCMD cannot be written",
        'parameter = "FREQCMD"\nkind',
    ),
    "a reference at standstill only": (
        "ms",
        REFERENCE + 'unit = "Hz"\nscale = "0.01"\nmax = 59900\naccess = "rw"',
        REFERENCE + 'unit = "Hz"\nscale = "0.01"\nmax = 59900\naccess = "rw-stopped"',
        "reference FREQCMD cannot be changed while the motor turns",
        'parameter = "FREQCMD"\nkind',
    ),
    "a reference without a unit": (
        "ms",
        REFERENCE + 'unit = "Hz"\n',
        REFERENCE,
        "reference FREQCMD has no unit",
        'parameter = "FREQCMD"\nkind',
    ),
    "a frequency reference in rpm": (
        "ms",
        REFERENCE + 'unit = "Hz"\n',
        REFERENCE + 'unit = "rpm"\n',
        "reference FREQCMD is a frequency in 'rpm'",
        'parameter = "FREQCMD"\nkind',
    ),
    "a reference in amperes": (
        "ms",
        'parameter = "FREQCMD"\nkind',
        'parameter = "CURRENT"\nkind',
        "reference CURRENT is a frequency in 'A'",
    ),
    "a feedback that cannot be read": (
        "atv",
        RFR_ACCESS,
        RFR_ACCESS.replace('"r"', '"w"'),
        "its feedback RFR cannot be read",
        'feedback = "RFR"',
    ),
    "an acceleration in Hz": (
        "ms",
        'name = "Acceleration time 1"\nnumber = "01-12"\naddress = 0x010C\nunit = "s"',
        'name = "Acceleration time 1"\nnumber = "01-12"\naddress = 0x010C\nunit = "Hz"',
        "acceleration in 'Hz' is not possible",
        'unit = "Hz"\nscale = "0.01"\nmax = 60000',
    ),
    "a current in volts": ("ms", 'unit = "A"', 'unit = "V"', "motor_current in 'V'"),
    "a limit in another unit": (
        "atv",
        'max_from = "HSP"',
        'max_from = "ACC"',
        "parameter LSP: its limit ACC is in s, not Hz",
    ),
    "a timeout without a unit": (
        "ms",
        'address = 0x0903\nunit = "s"',
        "address = 0x0903",
        "timeout 09-03 has the unit ''",
        'timeout = "09-03"',
    ),
    "a timeout in Hz": (
        "ms",
        'address = 0x0903\nunit = "s"',
        'address = 0x0903\nunit = "Hz"',
        "line_timeout in 'Hz' is not possible",
        'unit = "Hz"\nscale = "0.1"',
    ),
    "a status word that is a measurement": (
        "ms",
        'status = "STATUS"',
        'status = "CURRENT"',
        "CURRENT is motor_current, not a status word",
    ),
    "a status word with a scale": (
        "ms",
        "address = 0x2226\n",
        'address = 0x2226\nscale = "0.1"\n',
        "STATUS is a measurement, not a status word",
        'status = "STATUS"',
    ),
    "a status word that is the command word": (
        "ms",
        'status = "STATUS"',
        'status = "CONTROL"',
        "CONTROL is its command word",
    ),
    "a fault word that is a measurement": (
        "atv",
        '[faults]\nparameter = "LFT"',
        '[faults]\nparameter = "ULN"',
        "ULN is a measurement, not a fault word",
        'parameter = "ULN"\ncodes',
    ),
    "a key of scale_by that is no value": (
        "ms",
        'address = 0x2104\nunit = "A"\nscale = "0.01"',
        'address = 0x2104\nunit = "A"\nscale_by = { parameter = "09-02", scales = { 7 = "0.1" } }',
        "scale_by: 09-02 has no value 7",
        "scale_by",
    ),
    "a key of scale_by past the limit": (
        "ms",
        'address = 0x2104\nunit = "A"\nscale = "0.01"',
        'address = 0x2104\nunit = "A"\n'
        'scale_by = { parameter = "09-03", scales = { 1001 = "0.1" } }',
        "scale_by: 09-03 has no value 1001",
        "scale_by",
    ),
    "a key of unit_by beside its mask": (
        "ms",
        'type = "uint32"\nunit = "h"',
        'type = "uint32"\n'
        'unit_by = { parameter = "STATUS", shift = 0, mask = 3, units = { 4 = "h" } }',
        "unit_by: 4 does not fit the mask",
        "unit_by",
    ),
    "a key of factory_by that is no value": (
        "ms",
        'factory = 1000\naccess = "rw"\nstorage = "eeprom"\ngroup = "Settings"\n'
        'quantity = "acceleration"',
        'factory_by = { parameter = "09-02", raws = { 8 = 1000 } }\naccess = "rw"\n'
        'storage = "eeprom"\ngroup = "Settings"\nquantity = "acceleration"',
        "factory_by: 09-02 has no value 8",
        "factory_by",
    ),
    "a baud rate that no port has": ("ms", "baud = 9600", "baud = 9601", "no port has 9601 baud"),
    "a baud rate of none in the list": (
        "pump",
        "bauds = [9600, 19200]",
        "bauds = [9600, 19201]",
        "no port has 19201 baud",
    ),
    "a factory rate that is not offered": (
        "pump",
        "bauds = [9600, 19200]",
        "bauds = [4800, 9600]",
        "baud 19200 is not among its bauds",
        "baud = 19200",
    ),
    "a format that is none": (
        "pump",
        "bauds = [9600, 19200]",
        'bauds = [9600, 19200]\nformats = ["8E1", "8X3"]',
        "'8X3' is not a format",
        "formats",
    ),
    "a factory format that is not offered": (
        "pump",
        "bauds = [9600, 19200]",
        'bauds = [9600, 19200]\nformats = ["8N1"]',
        "format 8E1 is not among its formats",
        'format = "8E1"',
    ),
    "first above last": ("pump", "first = 1\n", "first = 32\n", "first 32 is above last 31"),
    "a name twice": (
        "ms",
        "Deceleration time 1",
        "Acceleration time 1",
        "name 'Acceleration time 1' is already used",
        'name = "Acceleration time 1"\nnumber = "01-13"',
    ),
    "a number twice": (
        "ms",
        '"01-13"\naddress',
        '"01-12"\naddress',
        "number 01-12 is already",
        '"01-12"\naddress = 0x010D',
    ),
    "a code in two cases": (
        "ms",
        'code = "CURRENT"\n',
        'code = "Status"\n',
        "code status differs from another only in its case",
        'code = "STATUS"',
    ),
    "a value name twice": (
        "ms",
        '1 = "Ramp", 2 = "Coast"',
        '1 = "Ramp", 2 = "Ramp"',
        "the name 'Ramp' occurs twice",
    ),
    "a state twice": (
        "ms",
        'id = "not-ready", name',
        'id = "ready", name',
        "chart bits: id ready occurs twice in states",
        'id = "ready", name = "Not ready"',
    ),
    "a value monitored twice": (
        "ms",
        '{ parameter = "TEMP", rate = "slow" }',
        '{ parameter = "HOURS", rate = "slow" }',
        "HOURS is monitored twice",
        '{ parameter = "HOURS", rate = "slow" },\n  { parameter = "STATUS" }',
    ),
    "a reaction twice": (
        "ms",
        "{ raw = 2, name",
        "{ raw = 1, name",
        "reaction 1 occurs twice",
        '{ raw = 1, name = "Fault, coast"',
    ),
    "a bar upside down": (
        "ms",
        '{ parameter = "CURRENT", low = "0", high = "10" }',
        '{ parameter = "CURRENT", low = "10", high = "0" }',
        "CURRENT: low 10 is not below high 0",
    ),
    "a monitored value that cannot be read": (
        "atv",
        RFR_ACCESS,
        RFR_ACCESS.replace('"r"', '"w"'),
        "monitoring: RFR cannot be read",
        '{ parameter = "RFR"',
    ),
    "a saving word that is read-only": (
        "atv",
        '[memory.save]\nparameter = "CMI"',
        '[memory.save]\nparameter = "ETA"',
        "ETA cannot be written",
        "[memory.save]",
    ),
    "a proposed setting that is read-only": (
        "ms",
        '[[groups]]\nname = "Command"\n',
        SOURCE,
        "STATUS cannot be written",
        "settings = [{",
    ),
    "a pair of which one word is read": (
        "ms",
        'code = 3\nname = "Read"\nmax_read = 8',
        'code = 3\nname = "Read"\nmax_read = 1',
        "uint32 is 2 words, but function 3 reads 1",
        'type = "uint32"',
    ),
}


def test_unbroken_files_are_valid() -> None:
    assert {name: library.faults_of(path) for name, path in FILES.items()} == {
        name: [] for name in FILES
    }


FRAME = """[[frames]]
sent = "01 03 00 64 00 02 85 D4"
answered = "01 03 04 00 02 00 C8 5A 65"
means = ["{}"]
source = "guide"

[faults]"""
CHECKED: dict[str, tuple[str, str, str]] = {
    "a kind that no simulated drive has": (
        'id = "pump"\n',
        'id = "pump"\nkind = "foo"\n',
        "there is no kind 'foo'. Allowed: plain, altivar21, drivecom, io, leroy-somer.",
    ),
    "a frame of no parameter": (
        "[faults]",
        FRAME.format("FREK = 20.0 Hz"),
        "frame: there is no parameter 'FREK'. Did you mean FREQ?",
    ),
    "a frame without a value": (
        "[faults]",
        FRAME.format("20 Hz"),
        "frame: '20 Hz' is not written as CODE = value, such as FREQ = 50.0 Hz.",
    ),
    "a frame in another unit": (
        "[faults]",
        FRAME.format("FREQ = 20.0 rpm"),
        "frame: 'FREQ = 20.0 rpm': FREQ is a number in Hz, such as 50.0 Hz.",
    ),
    "a frame without its unit": (
        "[faults]",
        FRAME.format("FREQ = 20.0"),
        "'FREQ = 20.0': FREQ is a number in Hz, such as 50.0 Hz.",
    ),
    "a frame with a unit too many": (
        "[faults]",
        FRAME.format("STAT = 2 Hz"),
        "frame: 'STAT = 2 Hz': STAT has no unit.",
    ),
    "a frame of no source": (
        "[faults]",
        FRAME.format("FREQ = 20.0 Hz").replace('"guide"', '"book 3"'),
        "frame: source 'book 3' does not begin with the id of a source. Known: guide.",
    ),
    "a frame of other registers": (
        "[faults]",
        FRAME.format("RAMP = 2.00 s"),
        "frame: RAMP is not in its registers: 100 to 101.",
    ),
}
"""Mistakes that `--check` refuses, and with which a profile can still be used."""


@pytest.mark.parametrize("name", CHECKED)
def test_mistake_is_refused_by_the_check_alone(tmp_path: Path, name: str) -> None:
    right, wrong, reported = CHECKED[name]
    text = PUMP.read_text("utf-8")
    assert text.count(right) == 1
    path = tmp_path / "own.toml"
    path.write_text(text.replace(right, wrong), "utf-8")
    found = [fault for fault in library.all_faults_of(path) if reported in fault]
    place = text.index(right) if "frame" in name else text.index(right) + len(right)
    line = text[:place].count("\n") + 1 + 3 * ("frame" in name) + ("source" in name)
    assert [item[: len(f"{path}:{line}: ")] for item in found] == [f"{path}:{line}: "]
    assert library.faults_of(path) == []


def test_frame_with_its_values_is_right(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    means = FRAME.format('FREQ = 20.0 Hz", "STAT = 16#0002')
    path.write_text(PUMP.read_text("utf-8").replace("[faults]", means), "utf-8")
    assert library.all_faults_of(path) == []


@pytest.mark.parametrize("name", MISTAKES)
def test_mistake_is_refused_at_its_line(tmp_path: Path, name: str) -> None:
    file, right, wrong, reported, *at = MISTAKES[name]
    good = FILES[file].read_text("utf-8")
    assert good.count(right) == 1, right
    text = good.replace(right, wrong)
    path = tmp_path / "own.toml"
    path.write_text(text, "utf-8")
    found = library.faults_of(path)
    named = [item for item in found if reported in item]
    line = text[: text.index(at[0] if at else wrong)].count("\n") + 1
    assert any(item.startswith(f"{path}:{line}: ") for item in named), (line, found)
