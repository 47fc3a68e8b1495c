"""The panel on its terminal: start, keys, bytes, CPU and memory, compared with two peers.

    python -m benchmarks.panel [--rounds N] [--seconds S] [--presses N]

The panel watches one simulated, running Altivar 71 that a process of its own serves at 19200 baud
in real time. A bare Textual program and htop at 10 refreshes a second run on the same kind of
pseudo-terminal, one program at a time. The targets are printed with the figures, not asserted.
"""

from __future__ import annotations

import argparse
import inspect
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from itertools import takewhile
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.hello import TEXTS
from benchmarks.terminal import Figures, Key, Terminal, press_often, spread, steady
from benchmarks.wire import ROOT
from tui.cli.opening import open_panel

SIZES = ((80, 24), (120, 40))
SLOW = 20_000.0
"""Bytes a second of the slow terminal."""
PANEL = (sys.executable, "-m", "tui")
SIMULATED = ("--format", "8N1", "--real-time", "--run", "50", "--set", "SLL=0")
"""A drive that runs on without polling between two programs."""
HELLO = (sys.executable, "-m", "benchmarks.hello")
HTOP = ("htop", "-d", "1")
AS_MUCH = {(80, 24): (1, 6), (120, 40): (4, 17)}
"""Texts and lines that Tab changes on Monitor, by the size of the terminal."""
FIRST_WORDS = (
    "Drive Panel",
    "Lines",
    "Simulated",
    "No line ─",
    "hoose a line and press",
    "? help",
)
"""Texts of the first full picture of the panel, from its first row to its last."""
SETTLED = 1.0
CHOSEN = 0.5
"""Seconds after which Enter counts in the palette."""
"""Seconds after which a program that has shown itself is measured."""
LOW_SECONDS = 6.0
"""Least time in s for which the low-bandwidth mode is measured; it refreshes every 2 s."""


def word_sign(text: str) -> tuple[object, ...]:
    """The bit word that Monitor shows first: its title and bit names.

    If the curve or all values are shown instead, that.
    """
    rows = text.split("\n")
    for y, row in enumerate(rows):
        if title := re.match(r" ?([A-Z]\w+(?: .*)?) ─+ 16#", row):
            bits = takewhile(re.compile(r" +\d+ [●·] ").match, rows[y + 1 :])
            return title[1], *(row[5:13].strip() for row in bits)
    named = ("All values", "output")
    return next(((name,) for name in named if any(name in row for row in rows[7:11])), ())


def saying(*words: str) -> Callable[[str], tuple[object, ...]]:
    """A sign by words that are on the screen or not."""
    return lambda text: tuple(word in text for word in words)


SCREENS = {
    "2": "Monitor",
    "1": "Line",
    "3": "Parameters",
    "4": "Scanner",
    "5": "Faults",
    "6": "Control",
    "7": "Frames",
    "8": "Trend",
    "m": "Messages",
}
WORD = Key("\t", word_sign)
HELP = Key("?", saying("Keys on Monitor", "──╮", "──╯"))
HELLO_TEXT = Key("w", saying(*TEXTS))
HELLO_HELP = Key("?", saying("Line 0 of a help", "──╮", "──╯"))
HTOP_HELP = Key("?", saying("Released under the GNU", "F10Quit"))


class Bench:
    """The same place and settings for every program that is measured."""

    def __init__(self, folder: Path, line: str, options: argparse.Namespace) -> None:
        self.line = line
        self.options = options
        self._environment = {
            "TERM": "xterm-256color",
            "COLORTERM": "truecolor",
            "TEXTUAL_ANIMATIONS": "none",
            "PYTHONPATH": str(ROOT),
            # as installed: what the first start compiles is kept, whatever is set outside
            "PYTHONDONTWRITEBYTECODE": "",
            "PYTHONPYCACHEPREFIX": str(folder / "compiled"),
            "DRIVEPANEL_STATE": str(folder),
            "HTOPRC": str(folder / "htoprc"),
        }

    def open(
        self, command: Sequence[str], size: tuple[int, int], rate: float | None = None
    ) -> closing[Terminal]:
        """Start a program on a terminal."""
        return closing(Terminal(command, size, ROOT, self._environment, rate))

    def watch(
        self, size: tuple[int, int], *options: str, rate: float | None = None
    ) -> closing[Terminal]:
        """Start the panel on the simulated drive."""
        return self.open((*PANEL, "panel", self.line, "-d", "1", *options), size, rate)


# What is measured


# The programs


def starts(bench: Bench, size: tuple[int, int], rounds: int) -> Figures:
    """Start to the first full picture, program after program in each round; in s."""
    ready: dict[str, tuple[Sequence[str], Sequence[str]]] = {
        "panel": (PANEL, FIRST_WORDS),
        "hello": (HELLO, TEXTS[:1]),
    }
    if shutil.which("htop"):
        ready["htop"] = (HTOP, ("F10Quit",))
    times: dict[str, list[float]] = {name: [] for name in ready}
    for number in range(rounds + 1):
        for name, (command, words) in ready.items():
            with bench.open(command, size) as terminal:
                shown = terminal.see(*words)
            if number:  # the first round fills the caches
                times[name].append(shown - terminal.started)
    return {name: spread(found) for name, found in times.items()}


def panel(bench: Bench, size: tuple[int, int]) -> dict[str, Figures]:
    """The panel at its default rate, then at 10 Hz with keys."""
    with bench.watch(size) as terminal:
        values = terminal.see("FORWARD") - terminal.started
        terminal.run(SETTLED)
        default = steady(terminal, bench.options.seconds)
        faster(terminal)
        fast = steady(terminal, bench.options.seconds)
        fast["key"] = press_often(terminal, WORD, bench.options.presses)
        fast["help"] = press_often(terminal, HELP, bench.options.presses // 5)
    return {"2 Hz": default | {"start_to_values_s": values}, "10 Hz": fast}


def faster(terminal: Terminal) -> None:
    """Poll at 10 Hz instead of 2 Hz."""
    for rate in ("5.0", "10.0"):  # one after another: keys that arrive together are ignored
        terminal.press("\x10")
        terminal.see("Type a word")
        terminal.press("twice")
        terminal.see("Poll twice as often")
        terminal.run(CHOSEN)
        terminal.press("\r")
        terminal.see(f"{rate} times a second")
    terminal.run(SETTLED)


def low_bandwidth(bench: Bench, size: tuple[int, int]) -> Figures | None:
    """The panel in its low-bandwidth mode; None where it has no such mode."""
    if "low_bandwidth" not in inspect.signature(open_panel).parameters:
        return None
    with bench.watch(size, "--low-bandwidth") as terminal:
        terminal.see("FORWARD")
        terminal.run(SETTLED)
        return steady(terminal, max(LOW_SECONDS, bench.options.seconds))


def low_screens(bench: Bench, size: tuple[int, int]) -> Figures | None:
    """Bytes a second of every screen in the low-bandwidth mode; None where it has no such mode."""
    if "low_bandwidth" not in inspect.signature(open_panel).parameters:
        return None
    found: Figures = {}
    with bench.watch(size, "--low-bandwidth") as terminal:
        terminal.see("FORWARD")
        for key, name in SCREENS.items():
            terminal.press(key)
            terminal.run(3 * SETTLED)
            found[name] = steady(terminal, LOW_SECONDS)["bytes_a_second"]
    return found


def slow(bench: Bench, size: tuple[int, int]) -> Figures:
    """The panel at 10 Hz on a slow terminal."""
    with bench.watch(size, rate=SLOW) as terminal:
        terminal.see("FORWARD")
        faster(terminal)
        found = steady(terminal, bench.options.seconds)
        found["key"] = press_often(terminal, WORD, bench.options.presses // 8)
        found["help"] = press_often(terminal, HELP, bench.options.presses // 50)
    return found


def hello(bench: Bench, size: tuple[int, int]) -> Figures:
    """The bare Textual program."""
    with bench.open(HELLO, size) as terminal:
        terminal.see(TEXTS[0])
        terminal.run(SETTLED)
        found = steady(terminal, bench.options.seconds / 2)
        found["key"] = press_often(terminal, HELLO_TEXT, bench.options.presses // 2)
        found["help"] = press_often(terminal, HELLO_HELP, bench.options.presses // 5)
    return found


def hello_as_much(bench: Bench, size: tuple[int, int]) -> Figures:
    """The bare Textual program where its key changes as much as the panel's."""
    texts, lines = AS_MUCH[size]
    with bench.open((*HELLO, str(texts), str(lines)), size) as terminal:
        terminal.see(TEXTS[0])
        terminal.run(SETTLED)
        key = Key("w", lambda text: tuple(text.count(item) for item in TEXTS))
        return {"key": press_often(terminal, key, bench.options.presses // 2)}


def htop(bench: Bench, size: tuple[int, int]) -> Figures | None:
    """htop at 10 refreshes a second; None where it is not installed."""
    if shutil.which("htop") is None:
        return None
    with bench.open(HTOP, size) as terminal:
        terminal.see("F10Quit")
        terminal.run(SETTLED)
        found = steady(terminal, bench.options.seconds)
        found["help"] = press_often(terminal, HTOP_HELP, bench.options.presses // 5)
    return found


def measure(bench: Bench, size: tuple[int, int]) -> Figures:
    """All figures at one size of the terminal."""
    return {
        "start": starts(bench, size, bench.options.rounds),
        **panel(bench, size),
        "low": low_bandwidth(bench, size),
        "low_screens": low_screens(bench, size),
        "slow": slow(bench, size),
        "hello": hello(bench, size),
        "as much": hello_as_much(bench, size),
        "htop": htop(bench, size),
    }


# What is printed


def show_starts(console: Console, found: dict[str, Figures]) -> None:
    """Print the starts at both sizes."""
    table = Table(title="Process start to the first full picture, ms (median, worst)")
    columns = ("", "panel", "bare Textual", "htop", "panel over bare", "ratio", "drive's values")
    for column in columns:
        table.add_column(column, justify="right" if column else "left")
    for size, figures in found.items():
        start = figures["start"]
        ours, bare = start["panel"]["median_ms"], start["hello"]["median_ms"]
        times = [
            f"{start[n]['median_ms']:.0f}, {start[n]['worst_ms']:.0f}" if n in start else "missing"
            for n in ("panel", "hello", "htop")
        ]
        values = figures["2 Hz"]["start_to_values_s"]
        over = f"+{ours - bare:.0f} (aim 60)"
        table.add_row(size, *times, over, f"{ours / bare:.2f}", f"{values * 1e3:.0f}")
    console.print(table)


ROWS: dict[str, tuple[tuple[str, ...], str, float, str]] = {
    "bytes a second": (("bytes_a_second",), ".0f", 1.0, "4000 at 2 Hz, 500 low"),
    "CPU, % of a core": (("cpu_share",), ".1f", 100.0, "5"),
    "memory, MB": (("memory_bytes",), ".1f", 1e-6, ""),
    "key: median, ms": (("key", "median_ms"), ".1f", 1.0, "5"),
    "key: 95th, ms": (("key", "95_ms"), ".1f", 1.0, "30"),
    "key: 99th, ms": (("key", "99_ms"), ".1f", 1.0, ""),
    "key: worst, ms": (("key", "worst_ms"), ".1f", 1.0, ""),
    "key: lost": (("key", "lost"), ".0f", 1.0, "0"),
    "?: median, ms": (("help", "median_ms"), ".1f", 1.0, "5"),
    "?: 95th, ms": (("help", "95_ms"), ".1f", 1.0, "30"),
    "?: worst, ms": (("help", "worst_ms"), ".1f", 1.0, ""),
    "?: lost": (("help", "lost"), ".0f", 1.0, "0"),
    "?: bytes a press": (("help", "bytes_a_press"), ".0f", 1.0, ""),
}
"""Rows of the table: where the figure is, its form, its factor, the aim."""
COLUMNS = {
    "2 Hz": "panel 2 Hz",
    "10 Hz": "panel 10 Hz",
    "low": "low bandwidth",
    "slow": "10 Hz at 20 kB/s",
    "hello": "bare Textual",
    "htop": "htop 10 Hz",
}


def show(console: Console, size: str, figures: Figures) -> None:
    """Print the figures at one size."""
    table = Table(title=f"Terminal of {size}; key: changes a text, ?: opens and closes the help")
    table.add_column("")
    for name, title in COLUMNS.items():
        table.add_column(title if figures[name] else f"{title}: {_reason(name)}", justify="right")
    table.add_column("aim", justify="right")
    for title, (place, form, factor, aim) in ROWS.items():
        cells = [_cell(figures[name], place, form, factor) for name in COLUMNS]
        table.add_row(title, *cells, aim)
    console.print(table)
    if low := figures["low_screens"]:
        rates = ", ".join(f"{screen} {rate:.0f}" for screen, rate in low.items())
        console.print(f"Low bandwidth, bytes a second (aim 500): {rates}")


def show_ratios(console: Console, size: str, figures: Figures) -> None:
    """Print the figures of the panel as ratios to its peers in the same run."""
    ours, peer = figures["10 Hz"], figures["htop"]
    for bare, name, words in (
        ("as much", "key", "a text that changes"),
        ("hello", "key", "the same, where one line changes there"),
        ("hello", "help", "opening and closing help"),
    ):
        median, of_bare = ours[name]["median_ms"], figures[bare][name]["median_ms"]
        if median is None or of_bare is None:
            console.print(f"{size}: {words}: keys were lost")
            continue
        console.print(f"{size}: {words} / bare Textual's: {median / of_bare:.2f} (aim 2.5)")
    if peer and peer["cpu_share"]:
        ratio = ours["cpu_share"] / peer["cpu_share"]
        console.print(f"{size}: CPU at 10 Hz / htop's: {ratio:.1f} (aim 2)")


def _reason(name: str) -> str:
    return "not installed" if name == "htop" else "not there"


def _cell(figures: Any, place: tuple[str, ...], form: str, factor: float) -> str:
    for part in place:
        figures = figures.get(part) if figures is not None else None
    return "" if figures is None else format(figures * factor, form)


@contextmanager
def simulated(line: str, *arguments: str) -> Iterator[str]:
    """Drives that `simulate` serves with these arguments in another process; gives the LINE."""
    process = subprocess.Popen(
        (*PANEL, "simulate", *arguments),
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    try:
        process.stdout.readline()
        yield line
    finally:
        process.terminate()
        process.wait(10)


def simulated_drive(folder: Path) -> AbstractContextManager[str]:
    """A running drive on a line of its own; gives the LINE."""
    link = folder / "line"
    return simulated(f"serial:{link},19200,8N1", "atv71@1", "--pty", str(link), *SIMULATED)


def main() -> None:
    """Measure at both sizes and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="starts of each program")
    parser.add_argument("--seconds", type=float, default=3.0, help="time of each count of bytes")
    parser.add_argument("--presses", type=int, default=200, help="presses of one key")
    options = parser.parse_args()
    console = Console()
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder, simulated_drive(Path(folder)) as line:
        bench = Bench(Path(folder), line, options)
        found = {f"{columns} x {rows}": measure(bench, (columns, rows)) for columns, rows in SIZES}
    show_starts(console, found)
    for size, figures in found.items():
        show(console, size, figures)
        show_ratios(console, size, figures)
    console.print(f"Load of this machine before: {load:.2f} on {os.cpu_count()} cores.")
    print(json.dumps({"load_before": load, "sizes": found}))


if __name__ == "__main__":
    main()
