"""From a typed `drivepanel stop` to the holder of the line, and to the wire.

    python -m benchmarks.shell [--rounds N]

Each round runs, one after the other:

- `python -c pass`, to its end: what a program in Python takes at least;
- `drivepanel stop` on a line that a process holds, until its message arrives there; once with the
  LINE written out, and once by its name in the settings file;
- `drivepanel stop` on a line that no process holds, until its first write is on the wire;
- the same on a line whose keeper holds it for a `drivepanel run` with a motor running.

As root, the first three once more at a CPU quota of 10 %, in a control group of their own. The
simulated line is a process of its own and outside of that.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from benchmarks.keeper import end_keeper
from benchmarks.quota import slow_group
from benchmarks.wire import WireLine
from tui.bus.program import KEEPER, Program
from tui.bus.share.messages import VERSION
from tui.bus.share.place import Owner, OwnerLock
from tui.session.connect.share_place import share_place
from tui.simulator import LineTiming

COMMAND = (str(Path(sys.executable).with_name("drivepanel")), "stop")
WRITES = (6, 16)
WITHIN = 60.0
"""Seconds after which a program that hangs ends the run."""
HELD, NAME = "serial:/dev/null,19200,8N1", "pump"

Start = Callable[[Sequence[str]], "subprocess.Popen[bytes]"]


def start(command: Sequence[str], group: Path | None = None) -> subprocess.Popen[bytes]:
    """A program without output, in a control group if one is given."""
    enter = None if group is None else (lambda: move(group))
    nothing = subprocess.DEVNULL
    return subprocess.Popen(
        command, stdin=nothing, stdout=nothing, stderr=nothing, preexec_fn=enter
    )


def move(group: Path) -> None:
    """Put this process into a control group."""
    (group / "cgroup.procs").write_text("0")


def seconds_of_nothing(started: Start) -> float:
    """Seconds that `python -c pass` takes."""
    begun = time.monotonic()
    started([sys.executable, "-c", "pass"]).wait(WITHIN)
    return time.monotonic() - begun


def seconds_to_holder(started: Start, line: str) -> float:
    """Seconds until the message of a stop arrives at the process that holds the line."""
    place = share_place(HELD)
    assert place is not None
    lock = OwnerLock(place)
    assert lock.take()
    path = str(place.lock_folder / "benchmark.sock")
    with closing(socket.socket(socket.AF_UNIX)) as listening:
        listening.bind(path)
        listening.listen()
        listening.settimeout(WITHIN)
        me = Program("benchmark", KEEPER, os.getpid())
        lock.tell(Owner(VERSION, me, path, line=HELD))
        begun = time.monotonic()
        process = started([*COMMAND, line])
        try:
            connection, _ = listening.accept()
            with closing(connection):
                assert connection.recv(100) == b"STOP 1\n"
            return time.monotonic() - begun
        finally:
            process.kill()
            process.wait()
            os.unlink(path)
            lock.give_back()


def seconds_to_wire(started: Start, wire: WireLine) -> float:
    """Seconds until the first write of a stop is on the wire."""
    wire.take()
    begun = time.monotonic()
    process = started([*COMMAND, wire.text])
    try:
        while time.monotonic() < begun + WITHIN:
            for exchange in wire.take():
                if exchange.request[1] in WRITES:
                    return exchange.began - begun
            time.sleep(0.02)
        raise TimeoutError("no stop on the wire")
    finally:
        process.wait(WITHIN)


def seconds_from_keeper(wire: WireLine, state: Path) -> float:
    """The same with a keeper, which holds the line for a program with a motor running."""
    motor = ["run", wire.text, "--reference", "20Hz", "--arm", "-p", "atv71"]
    command = [COMMAND[0], *motor]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as program:
        assert program.stdout is not None
        while "running forward" not in program.stdout.readline():
            pass
        found = seconds_to_wire(start, wire)
        program.communicate(timeout=WITHIN)
    end_keeper(state)
    return found


def measure(rounds: int, folder: Path) -> dict[str, dict[str, list[float]]]:
    """The seconds of each round, by the quota and by what was measured."""
    state = folder / "state"
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed program is compiled
    for name in ("state", "config"):
        os.environ[f"DRIVEPANEL_{name.upper()}"] = str(folder / name)
    (folder / "config").mkdir()
    (folder / "config" / "settings.toml").write_text(f'[lines]\n{NAME} = "{HELD}"\n')
    wire = WireLine()
    wire.set_up({1: "atv71"}, LineTiming(19200, "8N1"))
    found: dict[str, dict[str, list[float]]] = {}

    def note(quota: str, what: str, seconds: float) -> None:
        found.setdefault(quota, {}).setdefault(what, []).append(seconds)

    with closing(wire), slow_group() as group:
        kinds: dict[str, Start] = {"none": start}
        if group is not None:
            kinds["10 %"] = lambda command: start(command, group)
        for text in (wire.text, NAME):  # compiles what is imported
            start([*COMMAND, text]).wait(WITHIN)
        for _ in range(rounds):
            for quota, started in kinds.items():
                note(quota, "pass", seconds_of_nothing(started))
                note(quota, "holder", seconds_to_holder(started, HELD))
                note(quota, "holder by name", seconds_to_holder(started, NAME))
                note(quota, "wire, no holder", seconds_to_wire(started, wire))
            note("none", "wire, keeper", seconds_from_keeper(wire, state))
    return found


def table_of(found: dict[str, dict[str, list[float]]]) -> Table:
    """All figures, each also less the time of `python -c pass`."""
    table = Table(title="From the shell; s, median and worst")
    for name in ("CPU quota", "to", "median", "worst", "median - pass", "worst - pass"):
        table.add_column(name, justify="left" if name in ("CPU quota", "to") else "right")
    for quota, of_quota in found.items():
        least = median(of_quota["pass"])
        for what, seconds in of_quota.items():
            middle, worst = median(seconds), max(seconds)
            figures = (middle, worst, middle - least, worst - least)
            table.add_row(quota, what, *(f"{figure:.3f}" for figure in figures))
    return table


def main() -> None:
    """Measure, print the table and one line of JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=10, metavar="N")
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        found = measure(options.rounds, Path(folder))
    Console(width=110).print(table_of(found))
    if len(found) == 1:
        print("CPU quota: not measured; this user can make no control group here.")
    print(json.dumps({"benchmark": "shell", "seconds": found}))


if __name__ == "__main__":
    main()
