"""Keys and seconds of fourteen everyday tasks, driven in a terminal as a person would.

    python -m benchmarks.keys [--panel FOLDER] [--before]

Each task is a list of keys, with the text that must be on the screen before the next key. It counts
the keys, and the seconds until the last text appears. Time for reading and thinking is not
included. `--panel` runs the panel of another checkout, `--before` the keys that version 0.1 needed
for the same.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.line.terminal import Terminal
from tests.programs import is_running, kill_keepers, wait_until
from tui.simulator import DriveSpec, Simulation
from tui.simulator.drive import SimulatedDrive

Step = tuple[str, str]
"""A key as tmux names it, and the words to wait for behind it; none where empty."""
SETTLED = 0.35
"""Seconds that a question must be open before its answer counts."""
SLACK = 0.1
"""Seconds between two keys with nothing to wait for: nearer ones count as one piece."""


@dataclass(frozen=True, slots=True)
class Task:
    """One thing that people do, from Monitor unless it says otherwise."""

    name: str
    now: Sequence[Step]
    before: Sequence[Step]
    prepare: Callable[[SimulatedDrive], None] = lambda _drive: None


STEPS = """[startup]
profile = "atv71"

[[steps]]
step = "Preparation"
kind = "record"
from_profile = "Preparation"
fields = [{ name = "Preparation done", kind = "tick" }, { name = "Name" }]

[[steps]]
step = "Direction"
kind = "direction"
text = "Run briefly."
source = "benchmark"
confidence = "practice"
hz = [5.0]
reverse = "PHR"
"""
"""A start-up of two steps, so that none is reached by Tab only."""


def typed(text: str) -> list[Step]:
    """Letters one after another."""
    return [(letter, "") for letter in text]


ARM = FIRST = ("a", " ARMED")
"""A stop disarms now; before, a drive once armed stayed so while keys came."""
TASKS = (
    Task(
        "open the drive that was found, run at 30 Hz",
        [("Enter", "Timeout"), ARM, ("r", "RUN FORWARD"), *typed("30"),
         ("Enter!", "accelerating")],
        [("Enter", "STANDBY"), FIRST, ("f", "Reference"), *typed("30"), ("Enter", "DONE Ref"),
         ("r", "FORWARD")],
    ),
    Task("5 Hz more", [("PageUp", "35")], [("PageUp", "35")]),
    Task("stop", [("Space", "STOPPED")], [("Space", "STOPPED")]),
    Task(
        "reverse at 20 Hz, and stop",
        [ARM, ("v", "RUN REVERSE"), *typed("20"), ("Enter!", "REVERSE"), ("Space", "STOPPED")],
        [("f", "Reference"), *typed("20"), ("Enter", "DONE Ref"), ("v", "REVERSE"),
         ("Space", "STOPPED")],
    ),
    Task(
        "look up a fault and clear it",
        [ARM, ("x", "ObF Overbraking. Likely cause"), ("y!", "is reset.")],
        [("h", "Overbraking"), ("Escape", "State"), ("x", "DONE")],
        lambda drive: drive.provoke("ObF"),
    ),
    Task(
        "change a ramp and keep it",
        [("/", "search"), *typed("ACC"), ("Enter", "Enter Stage"), *typed("5"),
         ("Enter!", "staged"), ARM, ("w", "Write 1"), ("y!", "verified"), ("S", "EEPROM?"),
         ("y!", "saved to EEPROM")],
        [("3", "settings"), ("/", "search"), *typed("ACC"), ("Enter", ""), ("Enter", ""),
         *typed("5"), ("Enter", "staged"), ("w", "Write 1"), ("y", "written"),
         ("s", "EEPROM?"), ("y", "saved to EEPROM")],
    ),
    Task(
        "back everything up",
        [("C-k", "Saved")],
        [("b", "Back up to"), ("Enter", "parameters")],
    ),
    Task(
        "compare with the last backup (before: the factory settings)",
        [("C-d", "Differs")],
        [("o", "Compare with"), *typed("factory"), ("Enter", "factory settings")],
    ),
    Task(
        "put the motor current into a scanner slot",
        [("4", "Scanner"), ("Enter", "Map NMA1 to"), ("Down", ""), ("Enter!", "1 staged"), ARM,
         ("w", "Write 1"), ("y!", "all verified")],
        [("4", "Scanner"), ("Enter", "stands for"), *typed("LCR"), ("Enter", "proposed"),
         ("w", "Write 1"), ("y", "Written and read back")],
    ),
    Task("who commands it", [("6", "Commanded by")], [("2", "State"), ("c", "Control source")]),
    Task("the frames on the line", [("7", "Frames")], [("2", "State"), ("l", "Frames")]),
    Task(
        "tick and sign a step of the start-up",
        [("B", "Preparation done"), ("Enter", "yes"), ("Enter", "Name"), *typed("Ada"),
         ("Enter!", "Ada"), ("Enter", "1 done")],
        [],
    ),
    Task(
        "check the direction in the start-up",
        [("Enter", "press a to arm"), ARM, ("r", "RUN FORWARD"), *typed("5"),
         ("Enter!", "at reference"), ("Space", "STOPPED"), ("B", "Run the motor"),
         ("Enter", "5.0 Hz"), ("Enter", "● The motor turned"), ("Enter", "2 done")],
        [],
    ),
    Task("leave", [("q", "Leave|$"), ("y!", "")], [("q", "Leave|$"), ("y", "")]),
)  # fmt: skip


def press(terminal: Terminal, step: Step) -> None:
    """One key, and the wait for what follows; `!` behind a key is the answer to a question."""
    key, words = step
    if key.endswith("!") and len(key) > 1:
        time.sleep(SETTLED)
        key = key[:-1]
    terminal.press(key)
    time.sleep(SLACK)
    if not words:
        return
    end = time.monotonic() + 30
    wanted = words.split("|")
    while not any(word in _text(terminal) or word == "$" for word in wanted):
        if time.monotonic() > end:
            raise SystemExit(f"after {key!r} not seen: {words}\n{terminal.text()}")
        time.sleep(0.02)


def _text(terminal: Terminal) -> str:
    """Text of the terminal; "not armed" does not match "armed"."""
    return terminal.text().replace("NOT ARMED", "not armed")


def main() -> None:
    """Do every task, and print a table and a JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--panel", type=Path, default=Path.cwd(), metavar="FOLDER")
    parser.add_argument("--before", action="store_true")
    arguments = parser.parse_args()
    found: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder, Simulation([DriveSpec("atv71", 1)]) as simulation:
        os.environ |= {
            "DRIVEPANEL_STATE": folder,
            "DRIVEPANEL_CONFIG": folder,
            "PYTHONPATH": str(arguments.panel.resolve()),
        }
        own = Path(folder) / "profiles" / "startup" / "atv71.toml"
        own.parent.mkdir(parents=True)
        own.write_text(STEPS, "utf-8")
        line = f"serial:{simulation.serve_pty()},19200,8N1"
        terminal = Terminal(("tmux", "-S", f"{folder}/tmux", "-f", os.devnull))
        command = f"cd {folder} && exec {sys.executable} -m tui {line}"
        terminal.run("new-session", "-d", "-x", "80", "-y", "24", command)
        panel = terminal.client()
        try:
            # with its row; version 0.1 had its cursor elsewhere until the search had ended
            terminal.wait_for("addresses answered" if arguments.before else "version")
            time.sleep(1.0)
            for task in TASKS:
                steps = task.before if arguments.before else task.now
                if not steps:
                    continue  # version 0.1 had no such function
                task.prepare(simulation.drive(1))
                time.sleep(1.2)
                begun = time.monotonic()
                for step in steps:
                    press(terminal, step)
                found[task.name] = {"keys": len(steps), "seconds": time.monotonic() - begun}
        finally:
            # a failed task leaves the panel open; it and the keeper write into the folder
            with suppress(subprocess.CalledProcessError):
                terminal.run("kill-server")
            wait_until(lambda: not is_running(panel), "the end of the panel")
            kill_keepers(Path(folder) / "lines")
    table = Table("task", "keys", "s")
    for name, figures in found.items():
        table.add_row(name, f"{figures['keys']:.0f}", f"{figures['seconds']:.1f}")
    Console().print(table)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
