"""A running Altivar 71 in its own process, which trips and runs again on command.

python -m benchmarks.link_drive LINK     serves on a pseudo-terminal; `trip`, `restart` on stdin
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.wire import ROOT
from tui.simulator import DriveSpec, LineTiming, Simulation

BAUD = 19200
FORMAT = "8N1"
RUN_HZ = 50.0


class Drive:
    """The far end of the pipe to the drive; `line` is its LINE for the panel."""

    def __init__(self, process: subprocess.Popen[str], line: str) -> None:
        self._process = process
        self.line = line

    def tell(self, word: str) -> float:
        """Have something happen to the drive; when it had happened, of the monotonic clock."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{word}\n")
        self._process.stdin.flush()
        self._process.stdout.readline()
        return time.monotonic()


@contextmanager
def telling_drive(folder: Path) -> Iterator[Drive]:
    """The drive on a line that keeps its time, until the block ends."""
    link = folder / "line"
    process = subprocess.Popen(
        (sys.executable, "-m", "benchmarks.link_drive", str(link)),
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        process.stdout.readline()
        yield Drive(process, f"serial:{link},{BAUD},{FORMAT}")
    finally:
        process.stdin.close()
        process.wait(10)


def main() -> None:
    """Serve until the input ends."""
    # it runs on without polling between two programs
    spec = DriveSpec("atv71", 1, sets={"SLL": 0}, run_hz=RUN_HZ, wander=True)
    with Simulation([spec], timing=LineTiming(BAUD, FORMAT, True)) as simulation:
        simulation.serve_pty(sys.argv[1])
        print("ready", flush=True)
        drive = simulation.line.drives[0]
        for word in sys.stdin:
            if word.strip() == "trip":
                drive.provoke("ObF")
            else:
                drive.power_cycle()  # the fault is over, and the motor runs again
            print("done", flush=True)


if __name__ == "__main__":
    main()
