"""The panel over SSH on a slow link: start, keys, bytes, and delay of the screen.

    python -m benchmarks.link [--rounds N] [--presses N] [--seconds S] [--link NAME] [--only NAME]

Each program runs behind a private SSH server on loopback; between it and the client is a link with
a rate and a round trip (link_proxy). Times of a start count from the word that the login prints
before it becomes the program, so that the time of the login is separate; times of a key count from
its byte. The targets are printed with the figures, not asserted.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from rich.console import Console

from benchmarks.link_drive import Drive, telling_drive
from benchmarks.link_host import LOGGED_IN, Host, missing, ssh_host
from benchmarks.link_programs import RUNNING, Press, Program, programs, saying_all
from benchmarks.link_proxy import Link
from benchmarks.link_tables import show_keys, show_rest, show_starts
from benchmarks.terminal import Figures, NotShown, Terminal
from benchmarks.wire import ROOT

SIZE = (80, 24)
LINKS = {
    "2 kB/s, 300 ms": Link(2_000, 0.3),
    "20 kB/s, 100 ms": Link(20_000, 0.1),
    "no limit": Link(),
}
LONGEST = 40.0
"""Seconds after which a picture or the answer to a key counts as lost."""
QUIET = 2.0
"""Seconds without another change after which an answer is taken to be whole."""
SETTLED = 3.0
"""Seconds from a complete picture to the first key."""
GAPS = (0.5, 1.5)
"""Shortest and longest time in s from an answered key to the next one."""
BUDGET = 90.0
"""Seconds after which no further round of keys begins; earlier counts are kept."""
TRIPS = 3
TRIPPED = saying_all(r"\A.*(FAULT|TRIP|Overbraking)")
"""The strip says that the drive has tripped."""


@dataclass(frozen=True, slots=True)
class Setup:
    """Inputs of every measurement."""

    host: Host
    drive: Drive
    programs: dict[str, Program]
    options: argparse.Namespace


@contextmanager
def login(setup: Setup, program: Program) -> Iterator[tuple[Terminal, float]]:
    """Log in and start a program; its terminal, and when the login's word had come."""
    command = setup.host.command(program.command, compressed=program.compressed)
    terminal = Terminal(command, SIZE, ROOT, {"TERM": "xterm-256color"})
    try:
        yield terminal, terminal.wait(lambda text: LOGGED_IN in text, LONGEST)
    finally:
        setup.host.end()
        terminal.close()


# What is measured


def start(setup: Setup, program: Program, terminal: Terminal, logged_in: float) -> Figures:
    """Seconds and bytes from the login's word to each step of the start."""
    host, steps = setup.host, {"first": program.first}
    if program.state is not None and program.complete is not None:
        steps |= {"state": program.state, "complete": program.complete}
    written, carried = terminal.written, host.proxy.down
    found: Figures = {"login_s": logged_in - terminal.started, "login_link_bytes": carried}
    come, waiting = logged_in, dict(steps)
    end = logged_in + LONGEST
    while True:
        text = terminal.picture.text()
        for name in [name for name, shown in waiting.items() if shown(text)]:
            if not program.settles:
                del waiting[name]
            found[f"{name}_s"] = come - logged_in
            found[f"{name}_bytes"] = terminal.written - written
            found[f"{name}_link_bytes"] = host.proxy.down - carried
        if not waiting or time.monotonic() > end:
            return found
        next_come = terminal.look(QUIET if program.settles else LONGEST)
        if next_come is None and "first_s" in found:
            return found
        come = next_come or come


def press(terminal: Terminal, item: Press) -> tuple[float | None, float | None]:
    """Seconds from a key to the first changed cell of its answer, and to all of it."""
    before = terminal.picture.text()
    sign, first, last = item.sign(before), None, None
    pressed = terminal.press(item.key)
    while (now := time.monotonic()) < pressed + LONGEST:
        if last is not None and item.complete is None and now > pressed + last + QUIET:
            return first, last
        come = terminal.look(QUIET)
        if come is None:
            continue
        text = terminal.picture.text()
        if item.sign(text) != sign:
            sign, last = item.sign(text), come - pressed
            first = last if first is None else first
        if item.complete is not None and item.complete(before, text):
            return first, come - pressed
    return first, None


def press_all(terminal: Terminal, presses: Sequence[Press], rounds: int) -> Figures:
    """Times of every key of a walk, so many rounds of it, at irregular moments."""
    chance, end = random.Random(0), time.monotonic() + BUDGET
    found: dict[str, list[tuple[float | None, float | None]]] = {item.name: [] for item in presses}
    for _ in range(rounds):
        if time.monotonic() > end:
            break
        for item in presses:
            terminal.run(chance.uniform(*GAPS))
            found[item.name].append(press(terminal, item))
    return {name: _times(times) for name, times in found.items()}


def _times(times: Sequence[tuple[float | None, float | None]]) -> Figures:
    found: Figures = {"presses": len(times)}
    for name, ones in zip(("first", "complete"), zip(*times, strict=True), strict=True):
        come = [item for item in ones if item is not None]
        found[name] = {
            "median_s": median(come) if come else None,
            "worst_s": max(come, default=None),
            "lost": len(ones) - len(come),
        }
    return found


def at_rest(setup: Setup, program: Program, terminal: Terminal) -> Figures:
    """Bytes per second without any input; delay of a clock on the screen."""
    lags: list[float] = []
    shown: list[float] = []

    def look_at_clock(text: str) -> None:
        behind = program.clock(text) if program.clock is not None else None
        if behind is None:
            return
        now = round(time.monotonic() - behind)
        if shown and now not in shown:  # a lag counts when the clock has just moved on
            lags.append(behind)
        shown[:] = [now]

    written, carried, began = terminal.written, setup.host.proxy.down, time.monotonic()
    terminal.run(setup.options.seconds, look_at_clock)
    took = time.monotonic() - began
    return {
        "bytes_a_second": (terminal.written - written) / took,
        "link_bytes_a_second": (setup.host.proxy.down - carried) / took,
        "clock_behind_s": {"median": median(lags), "worst": max(lags)} if lags else None,
    }


def trips(setup: Setup, terminal: Terminal) -> Figures:
    """Seconds from a fault in the drive to its word on the strip, and back to running."""
    tripped, runs, lost = [], [], 0
    chance = random.Random(0)
    for _ in range(TRIPS):
        terminal.run(chance.uniform(*GAPS) + SETTLED)
        try:
            at = setup.drive.tell("trip")
            tripped.append(terminal.wait(TRIPPED, LONGEST) - at)
            terminal.run(SETTLED)
            at = setup.drive.tell("restart")
            runs.append(terminal.wait(saying_all(RUNNING.pattern), LONGEST) - at)
        except NotShown:
            lost += 1
            setup.drive.tell("restart")
    return {
        "fault": {"median_s": median(tripped), "worst_s": max(tripped)} if tripped else None,
        "running": {"median_s": median(runs), "worst_s": max(runs)} if runs else None,
        "lost": lost,
    }


def measure(setup: Setup, program: Program) -> Figures:
    """All figures of a program on the present link; keys, rest and trips in the last round."""
    starts: list[Figures] = []
    found: Figures = {}
    for number in range(setup.options.rounds):
        setup.host.proxy.down = 0
        with login(setup, program) as (terminal, logged_in):
            starts.append(start(setup, program, terminal, logged_in))
            if number + 1 < setup.options.rounds:
                continue
            terminal.run(SETTLED)
            found["rest"] = at_rest(setup, program, terminal)
            found["keys"] = press_all(terminal, program.keys, setup.options.presses)
            found["trips"] = trips(setup, terminal) if program.state is not None else None
            found["link_bytes"] = setup.host.proxy.down
    names = sorted({name for row in starts for name in row})
    found["start"] = {
        name: {"median": median(times), "worst": max(times), "rounds": len(times)}
        for name in names
        if (times := [row[name] for row in starts if name in row])
    }
    return found


def measure_all(setup: Setup, console: Console) -> dict[str, dict[str, Figures]]:
    """Every program on every selected link."""
    options = setup.options
    chosen = {n: p for n, p in setup.programs.items() if not options.only or n in options.only}
    for program in chosen.values():  # the first start fills the caches
        with login(setup, program) as (terminal, _):
            terminal.wait(program.complete or program.first, LONGEST)
    found: dict[str, dict[str, Figures]] = {}
    for name in options.link or LINKS:
        setup.host.proxy.link = LINKS[name]
        found[name] = {}
        for title, program in chosen.items():
            console.print(f"{name}: {title} ...", style="dim")
            try:
                found[name][title] = measure(setup, program)
            except NotShown as failure:
                console.print(f"{name}: {title} is left out: {failure}")
    return found


def environment(folder: Path) -> dict[str, str]:
    """Settings that programs behind the link see."""
    return {
        "LC_ALL": "C.UTF-8",
        "COLORTERM": "truecolor",
        "TEXTUAL_ANIMATIONS": "none",
        "PYTHONPATH": str(ROOT),
        # as installed: what the first start compiles is kept, whatever is set outside
        "PYTHONDONTWRITEBYTECODE": "",
        "PYTHONPYCACHEPREFIX": str(folder / "compiled"),
        "DRIVEPANEL_STATE": str(folder),
        "DRIVEPANEL_CONFIG": str(folder / "config"),
        "HTOPRC": str(folder / "htoprc"),
    }


def parse() -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="starts of each program")
    parser.add_argument("--presses", type=int, default=10, help="presses of each key, at most")
    parser.add_argument("--seconds", type=float, default=10.0, help="time of a count of bytes")
    parser.add_argument("--link", action="append", choices=LINKS, help="only this link")
    parser.add_argument("--only", action="append", metavar="NAME", help="only this program")
    return parser.parse_args()


def main() -> None:
    """Measure and print."""
    options, console = parse(), Console()
    load = os.getloadavg()[0]
    if gone := missing():
        console.print(f"Not measured: {gone}")
        print(json.dumps({"load_before": load, "missing": gone, "links": {}}))
        return
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name,
        telling_drive(Path(name)) as drive,
    ):
        folder = Path(name)
        with ssh_host(folder, environment(folder)) as host:
            setup = Setup(host, drive, programs(drive.line), options)
            found = measure_all(setup, console)
    if "htop, 2 Hz" not in setup.programs:
        console.print("htop is missing; it is not measured.")
    for link, figures in found.items():
        show_starts(console, link, figures)
        show_keys(console, link, LINKS[link].round_trip, figures)
        show_rest(console, link, figures)
    after = os.getloadavg()[0]
    console.print(f"Load of this machine: {load:.2f} before, {after:.2f} after.")
    print(json.dumps({"load_before": load, "load_after": after, "links": found}))


if __name__ == "__main__":
    main()
