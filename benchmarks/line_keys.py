"""Cursor keys on Line with many drives, compared with a bare Textual program in the same run.

    python -m benchmarks.line_keys [--drives N] [--presses N] [--columns N] [--rows N]

A process of its own serves the simulated drives, some of them running. It prints the milliseconds
from Down or Up to the whole picture, and their ratio to a key of the bare program. Then it counts
the bytes a second without keys. The targets are printed with the figures, not asserted.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import socket
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from rich.console import Console

from benchmarks.hello import TEXTS
from benchmarks.panel import HELLO, HELLO_TEXT, PANEL, SETTLED, Bench, simulated
from benchmarks.terminal import Figures, Key, Terminal, press_often, steady
from tui.session.connect.line_key import line_key
from tui.session.paths import remember_addresses

FAMILIES = ("atv71", "atv312", "atv31", "atv21")
TARGET_MS = 20.0
UNDER_CURSOR = re.compile(r"^ (\d+) · ", re.MULTILINE)
"""Address of the drive whose details are shown below the list."""
SCAN_SECONDS = 180.0


def cursor_sign(text: str) -> tuple[object, ...]:
    """Sign of the cursor: the address of its drive in the details."""
    return tuple(UNDER_CURSOR.findall(text))


DOWN, UP = Key("\x1b[B", cursor_sign), Key("\x1b[A", cursor_sign)


@contextmanager
def simulated_drives(count: int) -> Iterator[str]:
    """Serve this many drives from another process; yield the LINE."""
    specs = [f"{FAMILIES[at % len(FAMILIES)]}@{at + 1}" for at in range(count)]
    with closing(socket.create_server(("127.0.0.1", 0))) as free:
        port = free.getsockname()[1]
    served = (*specs, "--tcp", f"127.0.0.1:{port}", "--run", "30")
    with simulated(f"tcp:127.0.0.1:{port}", *served) as line:
        yield line


def found_all(terminal: Terminal, count: int) -> None:
    """Wait until the scan has ended, and the drives have been checked once."""
    wanted = f"{count} of {count} addresses answered"
    terminal.wait(lambda text: wanted in text, SCAN_SECONDS)
    terminal.run(3 * SETTLED)


def with_cpu(terminal: Terminal, key: Key, presses: int) -> Figures:
    """Press a key often; also count the CPU time of the program for each press, in ms."""
    before = terminal.usage()
    found = press_often(terminal, key, presses)
    after = terminal.usage()
    if before is not None and after is not None:
        found["cpu_ms"] = (after.cpu - before.cpu) / presses * 1e3
    return found


def line_keys(bench: Bench, size: tuple[int, int], count: int) -> Figures:
    """Down through the whole list, then Up, and the bytes without keys."""
    with bench.open((*PANEL, "panel", bench.line), size) as terminal:
        found_all(terminal, count)
        presses = min(bench.options.presses, count - 1)
        down = with_cpu(terminal, DOWN, presses)
        up = with_cpu(terminal, UP, presses)
        still = steady(terminal, bench.options.seconds)
    return {"down": down, "up": up, "still": still}


def bare_key(bench: Bench, size: tuple[int, int]) -> Figures:
    """A key of the bare Textual program."""
    with bench.open(HELLO, size) as terminal:
        terminal.see(TEXTS[0])
        terminal.run(SETTLED)
        return with_cpu(terminal, HELLO_TEXT, bench.options.presses)


def rows_of_table(found: Figures, bare: Figures) -> Sequence[str]:
    """Return a line of text for each key, with its ratio to the bare program."""
    lines = []
    for name in ("down", "up"):
        times = found[name]
        ratio = times["median_ms"] / bare["median_ms"]
        lines.append(
            f"{name}: median {times['median_ms']:.1f} ms, 95 % {times['95_ms']:.1f} ms, worst"
            f" {times['worst_ms']:.1f} ms, {ratio:.1f} times bare Textual,"
            f" {times['lost']} lost, {times['bytes_a_press']:.0f} bytes,"
            f" {times['cpu_ms']:.1f} ms of CPU"
        )
    return lines


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drives", type=int, default=31)
    parser.add_argument("--presses", type=int, default=60)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--columns", type=int, default=80)
    parser.add_argument("--rows", type=int, default=24)
    options = parser.parse_args()
    size = options.columns, options.rows
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        with simulated_drives(options.drives) as line:
            os.environ["DRIVEPANEL_STATE"] = name
            remember_addresses(line_key(line), f"1-{options.drives}")
            bench = Bench(folder, line, options)
            bare = bare_key(bench, size)
            found = line_keys(bench, size, options.drives)
    console = Console()
    console.print(f"{options.drives} drives at {size[0]} x {size[1]}, target {TARGET_MS:.0f} ms:")
    for text in rows_of_table(found, bare):
        console.print(text)
    console.print(
        f"bare Textual: median {bare['median_ms']:.1f} ms, {bare['cpu_ms']:.1f} ms of CPU;"
        f" load of this machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )
    console.print(f"without keys: {found['still']['bytes_a_second']:.0f} bytes a second")
    print(json.dumps({"bare": bare, **found}))


if __name__ == "__main__":
    main()
