"""What the keeper of a line costs, and how long its loss is felt.

    python -m benchmarks.keeper [--rounds N] [--seconds S]

Five simulated drives at 19200 baud, in a process of their own. Compared in one run:

- `drivepanel read` with a new keeper, with one that waits from the command before, and without
  one: seconds from the start of the command to its end;
- `drivepanel watch` of the five drives at 2 Hz: memory of the keeper, and processor time of keeper
  and command together against that of a command which holds the line itself;
- the keeper killed under that `watch`: seconds without a good value.
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
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any

from rich.console import Console
from rich.table import Table

from tui.bus.share.place import has_ended, owner_of_lock
from tui.bus.share.starting import NO_KEEPER

PROGRAM = (sys.executable, "-m", "tui")
DRIVES = ("atv71@1", "atv31@2", "atv312@3", "atv71@4", "atv31@5")
TICKS = os.sysconf("SC_CLK_TCK")
WARM_UP = 3.0


def keeper_of(state: Path) -> int | None:
    """The process id of the one keeper whose lock lies in a state folder."""
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


def seconds_to_read(line: str) -> float:
    """Seconds that `drivepanel read` of one value takes."""
    begun = time.monotonic()
    command = [*PROGRAM, "read", line, "ETA", "-d", "1", "-p", "atv71"]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    return time.monotonic() - begun


@contextmanager
def watching(line: str) -> Iterator[subprocess.Popen[str]]:
    """`drivepanel watch` of all drives at 2 Hz; begun once it printed a line."""
    command = [*PROGRAM, "watch", f"{line}@1-{len(DRIVES)}", "--every", "0.5", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=30)


def load(state: Path, line: str, seconds: float) -> dict[str, float]:
    """Share of a core that a watch takes with its keeper, and the memory of that."""
    with watching(line) as process:
        end = time.monotonic() + WARM_UP
        while time.monotonic() < end:
            read_line(process)
        pids = [pid for pid in (process.pid, keeper_of(state)) if pid is not None]
        pids = list(dict.fromkeys(pids))
        before, begun = [processor_seconds(pid) for pid in pids], time.monotonic()
        while time.monotonic() < begun + seconds:
            read_line(process)
        taken = time.monotonic() - begun
        used = [
            (processor_seconds(pid) - one) / taken for pid, one in zip(pids, before, strict=True)
        ]
        private, resident = memory(pids[-1])
        return {"together": sum(used), "holder": used[-1], "private": private, "rss": resident}


def read_line(process: subprocess.Popen[str]) -> bool:
    """Take one line of a watch; True if it has only good values."""
    assert process.stdout is not None
    told = json.loads(process.stdout.readline())
    return told["error"] is None and "stale" not in json.dumps(told)


def gap(state: Path, line: str) -> float:
    """Seconds between two good values of a watch whose keeper is killed."""
    with watching(line) as process:
        end = time.monotonic() + WARM_UP
        while time.monotonic() < end:
            read_line(process)
        pid = keeper_of(state)
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        longest, last = 0.0, time.monotonic()
        end = last + 2 * WARM_UP
        while (now := time.monotonic()) < end:
            if read_line(process):
                now = time.monotonic()
                longest, last = max(longest, now - last), now
        return max(longest, now - last)


def measure(rounds: int, seconds: float) -> dict[str, Any]:
    """All figures of one run."""
    with tempfile.TemporaryDirectory() as name:
        state = Path(name, "state")
        os.environ.update(DRIVEPANEL_STATE=str(state), DRIVEPANEL_CONFIG=str(Path(name, "config")))
        os.environ.pop(NO_KEEPER, None)
        line = f"serial:{name}/line,19200,8N1"
        served = [*PROGRAM, "simulate", *DRIVES, "--pty", f"{name}/line", "--real-time"]
        with subprocess.Popen(served, stdout=subprocess.PIPE, text=True) as drives:
            assert drives.stdout is not None
            drives.stdout.readline()
            try:
                return _measured(state, line, rounds, seconds)
            finally:
                end_keeper(state)
                drives.terminate()


def _measured(state: Path, line: str, rounds: int, seconds: float) -> dict[str, Any]:
    times: dict[str, list[float]] = {"new": [], "kept": [], "none": []}
    seconds_to_read(line)  # compiles what is imported
    for _ in range(rounds):
        end_keeper(state)
        times["new"].append(seconds_to_read(line))
        times["kept"].append(seconds_to_read(line))
        end_keeper(state)
        os.environ[NO_KEEPER] = "1"
        times["none"].append(seconds_to_read(line))
        del os.environ[NO_KEEPER]
    with_keeper = load(state, line, seconds)
    gaps = [gap(state, line) for _ in range(rounds)]
    end_keeper(state)
    os.environ[NO_KEEPER] = "1"
    alone = load(state, line, seconds)
    return {
        "benchmark": "keeper",
        "read": {name: median(found) for name, found in times.items()},
        "with_keeper": with_keeper,
        "alone": alone,
        "ratio": with_keeper["together"] / alone["together"],
        "gaps": gaps,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    found = measure(options.rounds, options.seconds)
    table = Table(title="The keeper of a line")
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
    Console().print(table)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
