"""An invented drive whose reference each test defines: its profile as text, and installed.

Status 100, output frequency 101, command 200, reference REF 201, key switch 202, scale source MODE
203, value of 100 % FULL 204, limits LOW 205 and HIGH 206, motor plate 207 and 208.
"""

from __future__ import annotations

from tui.drive.profile import library
from tui.drive.profile.profile import Profile

MIXER = "example-mixer"
COMMAND, REFERENCE, KEY, MODE, FULL, LOW, HIGH = 200, 201, 202, 203, 204, 205, 206
HERTZ = 'unit = "Hz"\nscale = "0.1"'
SCALE_BY = (
    HERTZ + '\nscale_by = { parameter = "MODE", scales = { 0 = "0.01", 1 = "0.1", 2 = "1" } }'
)
PERCENT = 'unit = "%"\nscale = "0.1"'
PERCENT_OF_FULL = PERCENT + '\nrating = "FULL"'
VOLTS = 'unit = "V"\nscale = "0.01"'
FINE = 'unit = "Hz"\nscale = "0.0012207031250"'
FULL_SCALE = 'unit = "Hz"\nfull_scale = { counts = 16384, parameter = "FULL" }'
SIGNED = FULL_SCALE + '\ntype = "int16"\nmin = -16384\nmax = 16384'
WIDE = 'unit = "Hz"\ntype = "int32"\nfull_scale = { counts = 200000, parameter = "FULL" }'
WIDE_REFERENCE = 220
"""Address of a reference of 32 bits."""
BY_SIGN = """
[[references]]
parameter = "REF"
kind = "frequency"
reverse = "negative"
"""
SPEED = 'unit = "rpm"\nquantity = "command_speed"'

_HEAD = """
[profile]
id = "example-mixer"
name = "Example mixer"
vendor = "Example"
version = "1.0"
summary = "An invented drive for tests of references."

[[sources]]
id = "guide"
title = "Example mixer, communication guide"

[link]
baud = 19200
format = "8E1"

[[functions]]
code = 3
name = "Read"
max_read = 16

[[functions]]
code = 6
name = "Write"

[[functions]]
code = 16
name = "Write several"
max_write = 8

[[charts]]
id = "mixer"
name = "Mixer state"
status = "STAT"
command = "CTRL"
orders = [
  { id = "forward", name = "Run", words = [1], states = ["ready", "running"] },
  { id = "reverse", name = "Run reverse", words = [3], states = ["ready", "running"] },
  { id = "stop", name = "Stop", words = [0] },
]
interlocks = [{ parameter = "KEY", values = [0], text = "The key switch is on local." }]
states = [
  { id = "fault", name = "Fault", kind = "fault", mask = 0x0004, value = 0x0004 },
  { id = "running", name = "Running", kind = "running", mask = 0x0002, value = 0x0002 },
  { id = "ready", name = "Ready", kind = "ready", mask = 0x0001, value = 0x0001 },
]

[faults]
parameter = "TRIP"
codes = [{ raw = 1, code = "OC", name = "Overcurrent" }]

[monitoring]
values = [{ parameter = "FREQ", low = "0", high = "60" }, { parameter = "STAT" }]
"""


def mixer_text(reference: str = HERTZ) -> str:
    """Return the profile with these lines of its reference."""
    quantity = "" if "quantity" in reference else '\nquantity = "command_frequency"'
    hertz, rpm = HERTZ, 'unit = "rpm"'
    place = WIDE_REFERENCE if "int32" in reference else REFERENCE
    rows = [
        ("STAT", 100, "r", 'quantity = "status_word"'),
        ("FREQ", 101, "r", 'type = "int16"\nquantity = "output_frequency"\n' + HERTZ),
        ("TRIP", 102, "r", 'quantity = "fault"'),
        ("CTRL", COMMAND, "rw", ""),
        ("REF", place, "rw", reference + quantity),
        ("KEY", KEY, "rw", ""),
        ("MODE", MODE, "rw", ""),
        ("FULL", FULL, "rw", "factory = 500\n" + hertz),
        ("LOW", LOW, "rw", 'factory = 0\nquantity = "low_speed"\n' + hertz),
        ("HIGH", HIGH, "rw", 'factory = 600\nquantity = "high_speed"\n' + hertz),
        ("FNOM", 207, "rw", 'factory = 500\nquantity = "rated_frequency"\n' + hertz),
        ("NNOM", 208, "rw", 'factory = 1450\nquantity = "rated_speed"\n' + rpm),
    ]
    head = _HEAD + BY_SIGN if "min = -" in reference else _HEAD
    if head != _HEAD:
        head = head.replace("words = [3]", "words = [1]")
    return head + "".join(_row(*row) for row in rows)


def _row(code: str, address: int, access: str, more: str) -> str:
    group = "Command" if code in ("CTRL", "REF") else "Settings"
    return f"""
[[parameters]]
code = "{code}"
name = "Word {code}"
number = "4{address:04}"
address = {address}
access = "{access}"
storage = "ram"
group = "{group}"
source = "guide"
confidence = "manual"
{more}
"""


def installed_mixer(reference: str = HERTZ, more: str = "", *changes: tuple[str, str]) -> Profile:
    """Install the drive among the user profiles, with more rows and with changed texts."""
    text = mixer_text(reference) + more
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    folder = library.user_folder()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "mixer.toml").write_text(text, encoding="utf-8")
    library.load.cache_clear()
    return library.load(MIXER)
