"""Cost of the keeper of a line, and duration of the effects of its loss.

    python -m benchmarks.keeper [--rounds N] [--seconds S]

Five simulated drives at 19200 baud, in a process of their own. Compared in one run:

- `drivepanel read` with a new keeper, with one that waits from the command before, and without one:
  seconds from the start of the command to its end;
- `drivepanel watch` of the five drives at 2 Hz, and the panel with its Monitor: memory of the
  keeper, and processor time of keeper and program together against that of a program which holds
  the line itself;
- the keeper killed under that `watch`: seconds without a good value;
- the same, but for the panel, with a tenth of a processor for all programs together (needs root).
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from statistics import median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.quota import slow_group
from benchmarks.terminal import Terminal
from tests.sources import ROOT
from tui.bus.share.keeping import NO_KEEPER
from tui.bus.share.place import DEATHS_WITHIN, MOST_DEATHS, has_ended, owner_of_lock

PROGRAM = (sys.executable, "-m", "tui")
DRIVES = ("atv71@1", "atv31@2", "atv312@3", "atv71@4", "atv31@5")
TICKS = os.sysconf("SC_CLK_TCK")
WARM_UP = 3.0
APART = DEATHS_WITHIN / (MOST_DEATHS - 1) + 1.0
"""Seconds between two kills of a keeper: no program starts one that dies more often."""
SIZE = 80, 24


def keeper_of(state: Path) -> int | None:
    """Process id of the only keeper whose lock is in a state folder."""
    for lock in (state / "lines").glob("*.lock"):
        owner = owner_of_lock(lock)
        if owner is not None and owner.socket and not has_ended(owner.program):
            return owner.program.pid
    return None


def end_keeper(state: Path) -> None:
    """End it, if there is one."""
    if (pid := keeper_of(state)) is not None:
        os.kill(pid, signal.SIGTERM)
        while keeper_of(state) is not None:
            time.sleep(0.01)


def processor_seconds(pid: int) -> float:
    """Processor time that a process has used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def memory(pid: int) -> tuple[float, float]:
    """Private and resident memory of a process in MB."""
    found: dict[str, int] = {}
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]:
        name, size, *_ = line.split()
        found[name] = int(size)
    private = found["Private_Clean:"] + found["Private_Dirty:"]
    return private / 1000, found["Rss:"] / 1000


class Bench:
    """The line, and where its programs run."""

    def __init__(self, folder: Path, line: str, group: Path | None = None) -> None:
        self.folder = folder
        self.line = line
        self._group = group

    @property
    def state(self) -> Path:
        """The state folder of all programs."""
        return self.folder / "state"

    def command(self, *words: str) -> list[str]:
        """A command of Drive Panel; it enters the control group first, if there is one."""
        if self._group is None:
            return [*PROGRAM, *words]
        enter = 'echo 0 > "$0"; exec "$@"'
        return ["sh", "-c", enter, str(self._group / "cgroup.procs"), *PROGRAM, *words]


def seconds_to_read(bench: Bench) -> float:
    """Seconds that `drivepanel read` of one value takes."""
    begun = time.monotonic()
    command = bench.command("read", bench.line, "ETA", "-d", "1", "-p", "atv71")
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    return time.monotonic() - begun


@contextmanager
def watching(bench: Bench) -> Iterator[subprocess.Popen[str]]:
    """`drivepanel watch` of all drives at 2 Hz; begun once it printed a line."""
    every = ("--every", "0.5", "--json")
    command = bench.command("watch", f"{bench.line}@1-{len(DRIVES)}", *every)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=60)


def load(bench: Bench, seconds: float) -> dict[str, float]:
    """Share of a core that a watch takes with its keeper, and the memory of that."""
    with watching(bench) as process:

        def run(seconds: float) -> None:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                read_line(process)

        return load_of(bench, process.pid, run, seconds)


def panel_load(bench: Bench, seconds: float) -> dict[str, float]:
    """Share of a core that the panel on Monitor takes with its keeper."""
    environment = {"TERM": "xterm-256color", "TEXTUAL_ANIMATIONS": "none"}
    command = bench.command("panel", bench.line, "-d", "1")
    with closing(Terminal(command, SIZE, ROOT, environment)) as terminal:
        terminal.press("2")
        terminal.see("Monitor", "A ")
        return load_of(bench, terminal.process, terminal.run, seconds)


def load_of(
    bench: Bench, pid: int, run: Callable[[float], None], seconds: float
) -> dict[str, float]:
    """Share of a core that a program takes with its keeper, and the memory of the holder."""
    run(WARM_UP)
    pids = list(
        dict.fromkeys(number for number in (pid, keeper_of(bench.state)) if number is not None)
    )
    before, begun = [processor_seconds(number) for number in pids], time.monotonic()
    run(seconds)
    taken = time.monotonic() - begun
    used = [(processor_seconds(number) - b) / taken for number, b in zip(pids, before, strict=True)]
    private, resident = memory(pids[-1])
    return {"together": sum(used), "holder": used[-1], "private": private, "rss": resident}


def read_line(process: subprocess.Popen[str]) -> bool:
    """Take one line of a watch; True if it has only good values."""
    assert process.stdout is not None
    reported = json.loads(process.stdout.readline())
    return reported["error"] is None and "stale" not in json.dumps(reported)


def gap(bench: Bench) -> float:
    """Seconds between two good values of a watch whose keeper is killed."""
    with watching(bench) as process:
        end = time.monotonic() + WARM_UP
        while time.monotonic() < end:
            read_line(process)
        pid = keeper_of(bench.state)
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        longest, last = 0.0, time.monotonic()
        end = last + 2 * WARM_UP
        while (now := time.monotonic()) < end:
            if read_line(process):
                now = time.monotonic()
                longest, last = max(longest, now - last), now
        return max(longest, now - last)


@contextmanager
def no_keeper(bench: Bench) -> Iterator[None]:
    """Programs hold the line themselves."""
    end_keeper(bench.state)
    os.environ[NO_KEEPER] = "1"
    try:
        yield
    finally:
        del os.environ[NO_KEEPER]


def measure(rounds: int, seconds: float) -> dict[str, Any]:
    """All figures of one run, without and with a quota of the processor."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for text in ("state", "config"):
            os.environ[f"DRIVEPANEL_{text.upper()}"] = str(folder / text)
        os.environ.pop(NO_KEEPER, None)
        line = f"serial:{name}/line,19200,8N1"
        served = [*PROGRAM, "simulate", *DRIVES, "--pty", f"{name}/line", "--real-time"]
        with subprocess.Popen(served, stdout=subprocess.PIPE, text=True) as drives:
            assert drives.stdout is not None
            drives.stdout.readline()
            try:
                found = _measured(Bench(folder, line), rounds, seconds)
                found["panel"] = _panels(Bench(folder, line), seconds)
                with slow_group("-keeper") as group:
                    if group is not None:
                        found["quota"] = _measured(Bench(folder, line, group), rounds, seconds)
                        end_keeper(folder / "state")
                return {"benchmark": "keeper", **found}
            finally:
                end_keeper(folder / "state")
                drives.terminate()


def _measured(bench: Bench, rounds: int, seconds: float) -> dict[str, Any]:
    times: dict[str, list[float]] = {"new": [], "kept": [], "none": []}
    seconds_to_read(bench)  # compiles what is imported
    for _ in range(rounds):
        end_keeper(bench.state)
        times["new"].append(seconds_to_read(bench))
        times["kept"].append(seconds_to_read(bench))
        with no_keeper(bench):
            times["none"].append(seconds_to_read(bench))
    with_keeper = load(bench, seconds)
    gaps = []
    for _ in range(rounds):
        next_kill = time.monotonic() + APART
        gaps.append(gap(bench))
        time.sleep(max(0.0, next_kill - time.monotonic()))
    with no_keeper(bench):
        alone = load(bench, seconds)
    return {
        "read": {name: median(found) for name, found in times.items()},
        "with_keeper": with_keeper,
        "alone": alone,
        "ratio": with_keeper["together"] / alone["together"],
        "gaps": gaps,
    }


def _panels(bench: Bench, seconds: float) -> dict[str, float]:
    found = panel_load(bench, seconds)["together"]
    with no_keeper(bench):
        alone = panel_load(bench, seconds)["together"]
    return {"together": found, "alone": alone, "ratio": found / alone}


def table_of(found: dict[str, Any], title: str) -> Table:
    """The figures without or with a quota."""
    table = Table(title=title)
    table.add_column("what")
    table.add_column("measured", justify="right")
    read, held = found["read"], found["with_keeper"]
    for name, text in {
        "read, new keeper - none": f"{read['new'] - read['none']:.2f} s",
        "read, kept keeper - none": f"{read['kept'] - read['none']:.2f} s",
        "private memory": f"{held['private']:.1f} MB",
        "resident memory": f"{held['rss']:.1f} MB",
        "five drives at 2 Hz, keeper": f"{held['holder']:.1%} of a core",
        "keeper and watch / watch that holds the line": f"{found['ratio']:.2f}",
        "killed: without a good value, median": f"{median(found['gaps']):.1f} s",
        "killed: without a good value, worst": f"{max(found['gaps']):.1f} s",
    }.items():
        table.add_row(name, text)
    if panel := found.get("panel"):
        table.add_row("panel and keeper", f"{panel['together']:.1%} of a core")
        table.add_row("panel and keeper / panel that holds the line", f"{panel['ratio']:.2f}")
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    found = measure(options.rounds, options.seconds)
    Console().print(table_of(found, "The keeper of a line"))
    if quota := found.get("quota"):
        Console().print(table_of(quota, "With 10 % of a processor"))
    print(json.dumps(found))


if __name__ == "__main__":
    main()
