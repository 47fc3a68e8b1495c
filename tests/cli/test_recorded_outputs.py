"""Outputs of commands on simulated lines, and the files that they write, as recorded.

`recorded_outputs.txt` has a section for each command. What differs from run to run is replaced.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache, partial
from itertools import product
from pathlib import Path
from zlib import crc32

import pytest

from tests.cli.commands import invoked
from tests.cli.test_documents import DRIVE, RUNS, make_files
from tests.recorded import AFTER_A_CHANGE, sections
from tests.sources import ROOT
from tests.sweeps import kept
from tui.session.connect.open_line import open_line

TEXTS = Path(__file__).parent / "recorded_outputs.txt"
KEYS = "time|seconds|begun|ended|at|age|ms|since|until|pid|load|share|size|bytes"
CHANGING = (
    (r"\d{4}-\d\d-\d\d([ T]\d\d:\d\d(:\d\d(\.\d+)?)?)?([+-]\d\d:?\d\d|Z)?", "DATE"),
    (r"\b\d\d:\d\d(:\d\d(\.\d+)?)?\b", "TIME"),
    (r"\b\d+(\.\d+)? ?(ms|s|min|h|%)(?!\w)", r"N \2"),
    (rf'("\w*({KEYS})"): -?[\d.e-]+', r"\1: N"),
    (r'"(us|one_by_one_us)": \d+', r'"\1": N'),
    (r"pid \d+", "pid N"),
    (r"\b\d+\.\d{5,}", "N"),
    (r"/[^ ]*/drivepanel-\w{8}/", "OWN/"),
    (r"\d{10}(\.\d+)?", "EPOCH"),
)  # fmt: skip
"""Patterns of what differs from run to run, and what stands for it."""
NOT_RUN = {"ports", "bundle", "listen"}
"""Commands whose output depends on this computer."""
TIMED = {"watch", "scan", "counters", "why"}
"""Commands whose numbers depend on the time that they take: none is recorded."""
BUSY = r"(, up to N ms: N)+|, usually N ms after a request"
"""Texts of a busy computer."""
FURTHER: tuple[tuple[str, ...], ...] = (
    ("watch", *DRIVE, "ETA", "RFR", "--every", "0.1", "--count", "2", "--csv", "FOLDER/new.csv"),
    ("read", *DRIVE, "ETA", "CMI", "RFR", "LFT", "LRS6", "3201", "-d", "9"),
    ("read", "sim:powerdrive", "-p", "powerdrive", "10.40", "5.01"),
    ("read", "sim:atv21", "FD01", "FE03", "FC91"),
    ("compare", "FOLDER/set.toml", "FOLDER/other.toml", "--all", "--format", "markdown"),
    ("compare", "FOLDER/set.toml", "FOLDER/other.toml", "--format", "csv"),
    ("compare", "FOLDER/set.toml", "factory"),
    ("compare", "FOLDER/set.toml", *DRIVE),
    ("scan", "sim:atv71@1,atv312@2,powerdrive@3", "--addresses", "1-4"),
    ("status", "sim:atv71@1,atv312@2,powerdrive@3", "--all", "--addresses", "1-3"),
    ("status", "sim:atv21"),
    ("identify", "sim:powerdrive", "-d", "1"),
    ("identify", "sim:powerdrive", "-d", "1", "--hold", "1"),
    ("reset", *DRIVE, "--arm"),
    ("reference", *DRIVE, "700", "--arm"),
    ("reference", "sim:powerdrive", "-p", "powerdrive", "20", "--arm"),
    ("write", *DRIVE, "ACC=4", "DEC=0.5", "HSP=99", "--arm"),
    ("write", *DRIVE, "ACC=4"),
    ("stop", "sim:powerdrive", "-d", "1"),
    ("why", "sim:atv71@2", "-d", "2"),
)
"""Words of the same commands with other options and families."""
WORDS = [words for _, words, _ in RUNS.values() if words[0] not in NOT_RUN]
BY_NAME = {
    name: [words for words in found if f"{words[0]}{suffix}" == name]
    for found, suffix in ((WORDS, ""), (FURTHER, " further"))
    for name in sorted({f"{words[0]}{suffix}" for words in found})
}
"""By the name of a section: the words of each run."""
QUICK = {"compare", "identify", "journal", "lines", "plan", "status", "stop", "write"}
"""Commands of the main layer; the others are for the sweeps."""
HOW_OPENED = "read_only", "wait", "program", "keeper"
"""Arguments with which a line was opened: a command that only looks cannot write to it."""
LONGEST = 6000
"""Characters that are recorded of a text; the rest is represented by a checksum of all."""
READ = {".toml", ".md", ".json", ".html", ".csv"}
"""Kinds of files that are read as text."""


@cache
def files() -> tempfile.TemporaryDirectory[str]:
    """A folder of files for the commands."""
    folder = tempfile.TemporaryDirectory()
    make_files(Path(folder.name))
    return folder


def printed(words: tuple[str, ...], *options: str) -> Iterator[str]:
    """The output of a command, its exit status, and the files that it writes."""
    with tempfile.TemporaryDirectory() as parent, pytest.MonkeyPatch.context() as patch:
        folder = Path(parent, "files")
        shutil.copytree(files().name, folder)
        patch.setenv("COLUMNS", "100")
        patch.chdir(parent)  # columns are as wide as the names of files in them
        for name in ("STATE", "CONFIG"):
            patch.setenv(f"DRIVEPANEL_{name}", f"{parent}/{name.lower()}")
        opened: list[str] = []

        def noted(text: str, **how: object) -> object:
            opened.append(", ".join(f"{name} {how[name]}" for name in HOW_OPENED if name in how))
            return open_line(text, **how)  # type: ignore[arg-type]

        patch.setattr("tui.session.connect.open_line.open_line", noted)
        done = invoked(*(word.replace("FOLDER", folder.name) for word in words), *options)
        found = [f"$ {' '.join((*words, *options))}", done.output.rstrip(), f"-> {done.exit_code}"]
        found += [f"opened: {how}" for how in dict.fromkeys(opened)]
        for path in sorted(folder.glob("new*")):
            found += [f"{path.name}:", path.read_text("utf-8")] if path.suffix in READ else ()
    text = "\n".join(found).replace(parent, "F").replace(str(ROOT), "ROOT")
    for pattern, new in CHANGING:
        text = re.sub(pattern, new, text)
    if words[0] in TIMED:
        text = re.sub(r"[ ─-]+", " ", re.sub(r"-?\d+(\.\d+)?", "N", text))
        text = re.sub(BUSY, "", text)
    yield text if len(text) < LONGEST else f"{text[:LONGEST]}\n... {crc32(text.encode())}"


def outputs(name: str) -> Iterator[str]:
    """All that is recorded in a section."""
    for words, options in product(BY_NAME[name], ((), ("--json",))):
        yield from printed(words, *options)


def _section(name: str) -> partial[Iterator[str]]:
    section = partial(outputs, name)
    section.__name__ = name  # type: ignore[attr-defined]
    return section


SECTIONS = tuple(map(_section, BY_NAME))


@pytest.mark.parametrize("name", kept(BY_NAME, *QUICK))
def test_outputs_of_a_command_are_the_recorded_ones(name: str) -> None:
    assert "\n".join(outputs(name)) == sections(TEXTS)[name], AFTER_A_CHANGE
