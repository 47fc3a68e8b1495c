"""Refusals of each command before it opens a line: output and exit status, recorded.

Nothing here opens a line or a port: a mistake must be found before.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from click import Context

from tests.cli.commands import invoked
from tests.recorded import sections
from tests.sources import ROOT
from tui.cli.main import main

TEXTS = Path(__file__).parent / "recorded_refusals.txt"
NAMES = main.list_commands(Context(main))
NOWHERE = "serial:/dev/nowhere"
FILES = {"bad.toml": "a = ", "other.toml": "a = 1\n", "empty": ""}
# of each command; N is the line, F the folder of files
GENERAL = ("", "N -d 300", "N -d 1 -d 2", "N -p gone", "nonsense", "--nosuch", "N --json --nosuch")
OWN = (
    "accept F/other.toml N", "accept F/none.toml --check", "accept F/bad.toml --check --json",
    "backup N F/empty", "backup N F/none/x.toml", "backup N - --recipe",
    "backup N F/x --recipe --all", "block N show words", "block N write", "block N write F/none",
    "block N nothing", "block N write F/bad.toml", "bundle N -o F/empty",
    "compare F/none.toml F/other.toml", "compare F/other.toml F/other.toml", "compare N N",
    "compare F/bad.toml N --format pdf", "counters N --for 0", "counters N --frames 0",
    "export F/none ACC", "export F/empty ACC", "export F/empty",
    "export F/empty ACC --from later", "export F/empty ACC --out F/other.toml",
    "journal --since later", "journal --since 1h -d 300", "journal --csv F/other.toml", "journal",
    "journal --json", "listen N --for 0", "listen tcp:h", "listen N --pcap F/empty",
    "plan F/none.toml", "plan F/bad.toml", "plan F/other.toml --json",
    "plan --from-scan F/empty", "plan --from-scan F/none", "plan", "plan EXAMPLE",
    "plan EXAMPLE --json", "plan EXAMPLE --svg F/empty", "profiles gone", "profiles --check",
    "profiles --check F/bad.toml", "profiles --check F/other.toml --json", "profiles --from",
    "profiles --from atv71", "profiles --from gone new", "profiles --from-csv F/none new",
    "profiles --from-csv F/other.toml new", "profiles --from-csv F/other.toml New",
    "profiles atv71 --wiring", "profiles --wiring", "profiles atv31 ACC", "profiles atv31 GONE",
    "profiles atv31 --json --to F/x", "profiles --prove F/none.toml", "profiles --prove atv31",
    "profiles", "publish N ACC", "publish N ACC --mqtt http://h",
    "publish N ACC --mqtt mqtt://h --every 0", "read N", "read N ACC --rated-current 0",
    "record N ACC --trigger x", "record N ACC --before 0", "record N ACC --count 0", "record N",
    "reference N", "reference N fast", "reference N 30Hz --arm", "replay F/none",
    "replay F/empty --at later", "report N F/other.toml", "report N --page F/x --all",
    "report N --all --addresses 9-1", "restore N F/none.toml", "restore N F/bad.toml --arm",
    "restore N", "restore N F/other.toml --dry-run --arm", "run N", "run N --reference 30Hz",
    "run N --for 0 --arm", "run N --arm --reverse --leave-running",
    "run N --arm --take-control --read-only", "scan N --addresses 0", "scan N --addresses 9-1",
    "scan N --addresses 1-999", "scan N --all-settings --yes", "serve", "serve N --tcp x",
    "serve N --allow-commands", "serve N --metrics x", "serve N", "serve N --map 1",
    "serve N --tcp 1502 --allow-writes", "simulate", "simulate gone", "simulate atv71@300",
    "simulate atv71 --pty x --tcp 1", "simulate atv71 --set ACC",
    "simulate atv71 --line-fault odd=1", "simulate atv71 --line-fault lost=2",
    "simulate atv71 --baud 1 --tcp 1", "status N --all --addresses x", "stop N --all -d 2",
    "stop N --quick --freewheel", "stop", "stop N --give-back", "teach N", "teach N FOUT",
    "teach N FOUT x y z", "teach N FOUT --forget 3", "watch N", "watch N ACC --every 0",
    "watch N ACC --count 0", "watch N ACC --append", "watch N ACC --csv F/other.toml",
    "watch N ACC --rotate never", "why N --json -d 300", "write N", "write N ACC", "write N ACC=",
    "write N =5", "write N ACC=5", "write N ACC=5 --dry-run --arm",
    "write N ACC=5 --read-only --arm",
)  # fmt: skip
STARTS = {"bundle", "demo", "lines", "ports", "replay", "serve", "simulate"}
"""Commands of which only their own refusals are tried: others would start or write something."""


def tried(words: str) -> Iterator[str]:
    """The output of a command line, without the names of the folders of this run."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "100")
        for name, text in FILES.items():
            Path(folder, name).write_text(text, "utf-8")
        places = {"N": NOWHERE, "EXAMPLE": str(ROOT / "docs" / "plan" / "hall-2.toml")}
        line = [places.get(word, word.replace("F/", f"{folder}/")) for word in words.split(" ")]
        done = invoked(*filter(None, line))
        output = done.output.replace(folder, "F").replace(str(ROOT), "ROOT")
        output = output.replace(os.environ["DRIVEPANEL_STATE"], "STATE")
        output = re.sub(r"(Ports found: [^.]*|No serial port was found)\.", "[ports]", output)
        yield f"$ {words}\n{output.rstrip()}\n-> {done.exit_code}"


def general() -> Iterator[str]:
    for name in NAMES:
        for words in GENERAL if name not in STARTS else ():
            yield from tried(f"{name} {words}".rstrip())


def own() -> Iterator[str]:
    for words in OWN:
        yield from tried(words)


SECTIONS = (general, own)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_refusals_of_commands_are_the_recorded_ones(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
