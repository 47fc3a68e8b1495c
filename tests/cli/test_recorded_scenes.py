"""Several commands in turn on one line, with their outputs as recorded.

Each scene has a line of simulated drives, and steps. Most steps are commands. Others change the
drive as its keypad or its wires would, or write a file.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import pytest

from tests.cli.commands import invoked, put
from tests.recorded import AFTER_A_CHANGE, sections
from tests.sources import ROOT
from tui.bus.line import Timing, timing_of
from tui.bus.link import Link
from tui.simulator import Bench, Simulation, parse_drives

TEXTS = Path(__file__).parent / "recorded_scenes.txt"
CHANGING = {
    r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d(\.\d+)?)?([+-]\d\d:?\d\d|Z)?": "DATE",
    r"\b\d\d:\d\d:\d\d\b": "TIME",
    r"\b\d+\.\d+ ms\b": "N ms",
}
"""Patterns of what differs from run to run, and what stands for it."""
LONGEST = 1500
"""Characters that are recorded of an output; the rest is represented by a checksum of all."""
TIMEOUTS = {"atv31": "ttO", "atv312": "ttO", "atv71": "TTO"}
"""Codes of communication timeouts, which are set to 30 s: no drive trips on a busy computer."""
BY_HAND = {"ACC = { raw = 30, ": "ACC = { ", '"3.0 s", name = "Acc': '"4.56 s", name = "Acc'}
"""Changes of a set by a person: its raw value is deleted, and the value edited."""
PLAN = """format = 1
name = "Too much"
baud = 19200
characters = "8E1"
way = "rj45"

[master]
name = "PLC"
kind = "Twido, screws"

[[stations]]
address = 1
name = "Pump"
profile = "atv31"
cable = 900
stub = 30

[[stations]]
address = 2
cable = 200
timeout = 0.2
profile = "atv71"
"""
SETTINGS = """[lines]
pump = "LINE"
scan = "tcp:x"
bad = "tcp:x:y"
fan = { line = "LINE", device = 1, profile = "gone" }
old = 5
"""


class Scene(NamedTuple):
    """A line of drives, and what happens in turn; LINE is the line, a space ends each word."""

    drives: str
    steps: tuple[str, ...]
    files: dict[str, str] = {}


SCENES = {
    "teaching": Scene(
        "powerdrive@1",
        (
            "teach LINE -p powerdrive", "teach LINE -p powerdrive 1.21 900 rpm",
            "teach LINE -p powerdrive", "teach LINE -p powerdrive 1.21 --reference",
            "put 120 600", "teach LINE -p powerdrive 1.21 600",
            "teach LINE -p powerdrive 1.21 --json", "read LINE -p powerdrive 1.21 1.06",
            "reference LINE -p powerdrive 20 --arm", "teach LINE -p powerdrive 1.21 --reference",
            "teach LINE -p powerdrive", "teach LINE -p powerdrive 1.20",
            "reference LINE -p powerdrive 700rpm --arm",
            "teach LINE -p powerdrive 1.21 --reference --json",
            "teach LINE -p powerdrive --no-reference", "teach LINE -p powerdrive 1.21 61.5 --json",
            "teach LINE -p powerdrive 1.21 --forget", "teach LINE -p powerdrive 10.40 3",
        ),
    ),
    "blocks": Scene(
        "atv71@1",
        (
            "block LINE set NMA3=LCR nma1=w8604 NMA2=3201 --dry-run",
            "block LINE set NMA3=LCR nma1=w8604 --dry-run --json",
            "block LINE set NMA3=LCR NCA3=ACC --arm", "block LINE save new.toml",
            "block LINE save new.toml", "block LINE save new2.toml --json",
            "block LINE factory --dry-run", "block LINE factory --arm", "block LINE factory --arm",
            "block LINE load new.toml --dry-run", "block LINE load new.toml --arm",
            "block LINE", "block LINE load part.toml --arm", "block LINE load bytes.toml --arm",
            "block LINE load none.toml --arm", "block LINE set NMA3=LCR nma3=ETA --arm",
            "block LINE set NMA9=LCR --arm", "block LINE set NCA4=ETA NCA5=CMD --arm",
            "block LINE set NMA4=none =ETA --arm", "block LINE set nma3=none NMA4=9001 --arm",
            "block LINE set NMA5=LCR --arm --read-only", "block LINE verify",
        ),
        {"part.toml": "a = 1\n", "bytes.toml": "a = '\udcff'\n"},
    ),
    "settings": Scene(
        "atv312@1",
        (
            "write LINE ACC=5,5s hsp=40 --arm", "write LINE ACC=5.5 HSP=40 --arm",
            "write LINE ACC=3.56 --dry-run --json", "write LINE ACC=3.55 --arm",
            "write LINE ACC=3.55 --arm --round --json", "write LINE ACC=4 --arm --save",
            "write LINE ACC=4 --arm --save", "write LINE ACC=5 --arm --save --json",
            "write LINE HSP=70 LSP=60 --dry-run --json", "write LINE HSP=70 ACC=6 --dry-run",
            "write LINE ACC=3 W9001=4 --arm", "write LINE RFR=5 ACC=4 --arm",
            "write LINE CMD=6 --dry-run", "write LINE Add=2 --dry-run",
            "write LINE ACC=5 --arm --read-only --save", "write LINE SP2=16#0021 --arm",
            "journal --csv new.csv", "journal --drive 1/LINE", "journal --drive 2",
            "journal --json --since 1h",
        ),
    ),
    "restoring": Scene(
        "atv312@1",
        (
            "backup LINE new.toml", "backup LINE new.toml", "edit new.toml",
            "restore LINE new.toml --dry-run", "restore LINE new.toml --dry-run --round",
            "restore LINE new.toml --arm", "restore LINE new.toml --arm --round",
            "restore LINE new.toml --arm --round --read-only", "write LINE dEC=7 --arm",
            "restore LINE new.toml --arm --save", "restore LINE newest --dry-run",
            "restore LINE newest --arm", "compare new.toml LINE", "compare new.toml factory",
            "restore sim:atv21 new.toml --dry-run", "restore sim:atv21 new.toml --arm",
        ),
    ),
    "recipes": Scene(
        "atv312@1,atv312@2,atv31@3",
        (
            "write LINE ACC=5 -d 2 --arm",
            "backup LINE new.toml --recipe -d 1 -d 2 -d 3",
            "backup LINE new.toml --recipe -d 1 -d 2 -d 3",
            "backup LINE other.toml --recipe -d 1 -d 2 --json",
            "compare new.toml LINE", "write LINE ACC=6 -d 1 --arm", "compare new.toml LINE",
            "compare new.toml LINE --json -d 1", "restore LINE new.toml --dry-run -d 1 -d 2",
            "restore LINE new.toml --arm -d 1", "restore LINE new.toml --arm -p atv31",
            "compare new.toml LINE -p atv31", "compare LINE LINE -d 1 -d 2",
            "compare LINE LINE -d 1 -d 2 --json", "compare LINE LINE -d 1 -d 2 -d 3",
        ),
    ),
    "faults": Scene(
        "atv71@1",
        (
            "bench 1: trip ObF", "status LINE", "status LINE --all --addresses 1", "reset LINE",
            "reset LINE --arm", "reset LINE --arm", "bench 1: trip OCF", "reset LINE --arm --json",
            "status LINE --json", "reference LINE 20 --arm", "stop LINE",
        ),
    ),
    "lines": Scene(
        "atv71@1,atv312@2",
        (
            "lines", "identify LINE -d 1 -d 2", "settings", "read pump ACC", "read fan ACC",
            "lines", "lines --json", "read pumb ACC",
        ),
    ),
    "several-lines": Scene(
        "atv71@1,atv312@2",
        (
            "status LINE@1,2 sim:atv312@4", "status LINE@1 sim:atv312@4,atv71@5 --json",
            "status LINE sim:atv312@4 --all --addresses 1-4",
            "status LINE sim:atv312@4 --all --addresses 1-4 --json",
        ),
    ),
    "stops": Scene(
        "atv312@1",
        (
            "stop LINE --quick", "stop LINE --freewheel --json", "stop LINE --all --addresses 1",
            "stop LINE --all --addresses 1-2 --quick --json", "stop LINE --give-back",
            "stop LINE --give-back --arm", "stop LINE --read-only",
            "stop LINE --all --addresses 5-4", "stop LINE -d 1 -d 2 --give-back",
        ),
    ),
    "own-profiles": Scene(
        "atv312@1",
        (
            "profiles new mine --from atv312", "profiles new mine --from atv312", "profiles",
            "profiles mine --wiring", "profiles --check config/profiles/mine.toml",
            "damage config/profiles/mine.toml", "profiles", "profiles --json", "profiles mine",
            "profiles --check config/profiles/mine.toml --json",
            "profiles powerdrive", "profiles atv21 --wiring", "profiles v20",
            "profiles confirm atv312 LINE --force", "profiles confirm atv312",
            "profiles atv312 --to new.json", "profiles -d 2", "profiles new x --from-csv t.csv",
        ),
        {"t.csv": "code;address;name\nACC;1;Ramp\n"},
    ),
    "plans": Scene(
        "atv312@1", ("plan plan.toml", "plan plan.toml --json", "plan plan.toml --svg -"),
        {"plan.toml": PLAN},
    ),
}  # fmt: skip
QUICK = {"teaching", "blocks", "settings", "faults", "lines", "stops", "plans"}
"""Scenes of the main layer; the others are for the sweeps."""


def outputs(scene: Scene) -> Iterator[str]:
    """Output and exit status of each command, and what the files are in the end."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        patch = stack.enter_context(pytest.MonkeyPatch.context())
        patch.setenv("COLUMNS", "100")
        patch.chdir(folder)
        patch.setattr("tui.bus.share.keeping.can_start", lambda: False)
        patch.setattr("tui.bus.line.timing_of", _patient)
        for name in ("STATE", "CONFIG"):
            patch.setenv(f"DRIVEPANEL_{name}", f"{folder}/{name.lower()}")
        for name, text in scene.files.items():
            Path(name).write_text(text, "utf-8", "surrogateescape")
        drives = [
            replace(spec, sets={TIMEOUTS[spec.profile]: 300} if spec.profile in TIMEOUTS else {})
            for spec in parse_drives(scene.drives)
        ]
        simulation = stack.enter_context(Simulation(drives))
        host, port = simulation.serve_tcp()
        line, bench = f"tcp:{host}:{port}", Bench(simulation, lambda _: None)
        for step in scene.steps:
            text = "\n".join((f"$ {step}", *_taken(step, line, bench)))
            yield _recorded(text, line, folder)
        for path in sorted(Path().glob("new*")):
            yield _recorded(f"{path}:\n{path.read_text('utf-8')}", line, folder)


def _patient(link: Link) -> Timing:
    """Wait a whole second for each reply, as the fixture `patient_lines` does."""
    timing = timing_of(link)
    return replace(timing, min_timeout=timing.first_timeout)


def _recorded(text: str, line: str, folder: str) -> str:
    """A text without what differs from run to run."""
    text = text.replace(line, "LINE").replace(folder, "F").replace(str(ROOT), "ROOT")
    for pattern, new in CHANGING.items():
        text = re.sub(pattern, new, text)
    return text if len(text) < LONGEST else f"{text[:LONGEST]}\n... {crc32(text.encode())}"


def _taken(step: str, line: str, bench: Bench) -> Iterator[str]:
    """Take a step; return the output and the exit status of a command."""
    command, *words = step.split(" ")
    match command, words:
        case "put", (address, word):
            put(line, int(address), int(word))
        case "bench", _:
            bench.do(" ".join(words))
        case "edit", (name,):
            text = Path(name).read_text("utf-8")
            for old, new in BY_HAND.items():
                text = text.replace(old, new)
            Path(name).write_text(text, "utf-8")
        case "damage", (name,):
            Path(name).write_text(Path(name).read_text("utf-8").replace("[[", "[", 1), "utf-8")
        case "settings", ():
            Path("config").mkdir(exist_ok=True)
            Path("config/settings.toml").write_text(SETTINGS.replace("LINE", line), "utf-8")
        case _:
            done = invoked(command, *(word.replace("LINE", line) for word in words))
            yield done.output.rstrip()
            yield f"-> {done.exit_code}"


def _section(name: str) -> partial[Iterator[str]]:
    section = partial(outputs, SCENES[name])
    section.__name__ = name  # type: ignore[attr-defined]
    return section


SECTIONS: tuple[Callable[[], Iterator[str]], ...] = tuple(map(_section, SCENES))


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in QUICK else pytest.mark.sweep) for name in SCENES],
)
def test_outputs_of_commands_in_turn_are_the_recorded_ones(name: str) -> None:
    assert "\n".join(outputs(SCENES[name])) == sections(TEXTS)[name], AFTER_A_CHANGE
