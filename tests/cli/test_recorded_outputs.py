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
from tests.cli.test_documents import RUNS, make_files
from tests.recorded import AFTER_A_CHANGE, sections
from tests.sources import ROOT
from tests.sweeps import kept

TEXTS = Path(__file__).parent / "recorded_outputs.txt"
KEYS = "time|seconds|begun|ended|at|age|ms|since|until|pid|load|share|size|bytes"
CHANGING = (
    (r"\d{4}-\d\d-\d\d([ T]\d\d:\d\d(:\d\d(\.\d+)?)?)?([+-]\d\d:?\d\d|Z)?", "DATE"),
    (r"\b\d\d:\d\d(:\d\d(\.\d+)?)?\b", "TIME"),
    (r"\b\d+(\.\d+)? ?(ms|s|min|h|%)(?!\w)", r"N \2"),
    (rf'("\w*({KEYS})"): -?[\d.e-]+', r"\1: N"),
    (r"pid \d+", "pid N"),
    (r"\b\d+\.\d{5,}", "N"),
    (r"/[^ ]*/drivepanel-\w{8}/", "OWN/"),
    (r"\d{10}(\.\d+)?", "EPOCH"),
)  # fmt: skip
"""Patterns of what differs from run to run, and what stands for it."""
NOT_RUN = {"ports", "listen", "watch", "scan", "counters", "why", "bundle"}
"""Commands whose output depends on this computer, or on the time that they take."""
WORDS = [words for _, words, _ in RUNS.values() if words[0] not in NOT_RUN]
COMMANDS = sorted({words[0] for words in WORDS})
QUICK = {"compare", "identify", "journal", "lines", "plan", "status", "stop", "write"}
"""Commands of the main layer; the others are for the sweeps."""
LONGEST = 6000
"""Characters that are recorded of a text; the rest is represented by a checksum of all."""
READ = {".toml", ".md", ".json", ".html"}
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
        for name in ("STATE", "CONFIG"):
            patch.setenv(f"DRIVEPANEL_{name}", f"{parent}/{name.lower()}")
        done = invoked(*(word.replace("FOLDER", str(folder)) for word in words), *options)
        found = [f"$ {' '.join((*words, *options))}", done.output.rstrip(), f"-> {done.exit_code}"]
        for path in sorted(folder.glob("new*")):
            found += [f"{path.name}:", path.read_text("utf-8")] if path.suffix in READ else ()
    text = "\n".join(found).replace(parent, "F").replace(str(ROOT), "ROOT")
    for pattern, new in CHANGING:
        text = re.sub(pattern, new, text)
    yield text if len(text) < LONGEST else f"{text[:LONGEST]}\n... {crc32(text.encode())}"


def outputs(command: str) -> Iterator[str]:
    """All that is recorded of a command."""
    own = [words for words in WORDS if words[0] == command]
    for words, options in product(own, ((), ("--json",))):
        yield from printed(words, *options)


def _section(command: str) -> partial[Iterator[str]]:
    section = partial(outputs, command)
    section.__name__ = command  # type: ignore[attr-defined]
    return section


SECTIONS = tuple(map(_section, COMMANDS))


@pytest.mark.parametrize("command", kept(COMMANDS, *QUICK))
def test_outputs_of_a_command_are_the_recorded_ones(command: str) -> None:
    assert "\n".join(outputs(command)) == sections(TEXTS)[command], AFTER_A_CHANGE
