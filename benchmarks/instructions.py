"""A start counted in instructions: the same on a busy machine as on one that does nothing.

    python -m benchmarks.instructions

Needs valgrind. Counts until the frame with the last words of the first picture is handed to the
terminal; compilation is done before.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from benchmarks.panel import SIZES
from benchmarks.terminal import NotShown, Terminal
from benchmarks.wire import ROOT

PATIENCE = 300.0
"""Seconds for one start; under valgrind it takes thirty times as long."""
PROGRAMS = {"tui": "leave", "benchmarks.hello": "Hello, world"}
"""Modules, and the last words of their first pictures."""
RUN = """
import os, runpy, sys
from textual.drivers.linux_driver import LinuxDriver
module, words = sys.argv[1:]
written, write = [], LinuxDriver.write
def until_shown(driver, data):
    written.append(data)
    write(driver, data)
    if words in "".join(written):
        os._exit(0)
LinuxDriver.write = until_shown
sys.argv = [module]
runpy.run_module(module, run_name="__main__")
"""


def instructions(module: str, words: str, size: tuple[int, int], folder: Path) -> float:
    """Millions of instructions until a program has shown its words."""
    log = folder / "valgrind"
    environment = {
        "TERM": "xterm-256color",
        "COLORTERM": "truecolor",
        "TEXTUAL_ANIMATIONS": "none",
        "PYTHONHASHSEED": "0",
        "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "",
        "PYTHONPYCACHEPREFIX": str(folder / "compiled"),
        "DRIVEPANEL_STATE": str(folder),
    }
    python = (sys.executable, "-c", RUN, module, words)
    count = ("valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null")
    for command in (python, (*count, f"--log-file={log}", *python)):
        terminal = Terminal(command, size, ROOT, environment)
        with suppress(NotShown):  # it ends without a signal
            terminal.run(PATIENCE)
        with suppress(ProcessLookupError):
            terminal.close()
    found = re.search(r"I\s+refs:\s+([\d,]+)", log.read_text())
    assert found is not None, log.read_text()
    return int(found[1].replace(",", "")) / 1e6


def main() -> None:
    """Count at both sizes and print."""
    if shutil.which("valgrind") is None:
        print("valgrind is not installed.")
        return
    for columns, rows in SIZES:
        with tempfile.TemporaryDirectory() as folder:
            ours, bare = (
                instructions(module, words, (columns, rows), Path(folder))
                for module, words in PROGRAMS.items()
            )
        print(
            f"{columns} x {rows}: {ours:.0f} million instructions to the first full picture,"
            f" bare Textual {bare:.0f}: {ours / bare:.2f} (aim 1.35)"
        )


if __name__ == "__main__":
    main()
