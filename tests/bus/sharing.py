"""Several programs on one line, as lines of one process with a common meeting place."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tui.bus.line import Line, Timing
from tui.bus.link import Link
from tui.bus.program import Program
from tui.bus.share.place import SharePlace

from .conftest import WIDE
from .peer import eventually

ROOT = Path(__file__).parent.parent.parent
QUICK = Timing(
    first_timeout=1.5, min_timeout=1.5, late_reply=0.2, reconnect_first=0.05, probes=False
)
"""Timing that waits long for answers and takes a line over quickly."""


def place_in(folder: Path, key: str = "serial:line") -> SharePlace:
    """The meeting place of a test's programs."""
    return SharePlace(key, folder / "lines", (folder / "run",))


@dataclass(slots=True)
class SharedLines:
    """Open programs on one line, the first of which owns it, and close them."""

    folder: Path
    link: Link
    opened: list[Line] = field(default_factory=list)

    def open(
        self,
        name: str,
        *,
        timing: Timing = QUICK,
        place: SharePlace | None = None,
        wait: float | None = 5.0,
        pid: int = 0,
        space: str = "",
        gated: bool = False,
    ) -> Line:
        """Open a program of this name on the line."""
        program = Program(name, name, pid or os.getpid(), space=space)
        place = place or place_in(self.folder)
        line = Line(self.link, timing=timing, place=place, program=program, gated=gated)
        for device in range(1, 10):
            line.describe(device, WIDE)
        self.opened.append(line)
        line.open(wait=wait)
        if wait is not None and len(self.opened) > 1:
            everybody = [item for item in self.opened if item.state.status.value != "closed"]
            eventually(lambda: all(knows(item, name) for item in everybody))
        return line

    @property
    def left_behind(self) -> list[str]:
        """Files in the folders of the meeting place, except the lock."""
        return [path.name for path in self.folder.rglob("*.s*")]

    def close(self) -> None:
        """Close all."""
        for line in self.opened:
            line.close()


def knows(line: Line, name: str) -> bool:
    """True if a program was notified that another one is on the line."""
    return line.facts.program(name) is not None


@contextmanager
def frozen(line: Line) -> Iterator[None]:
    """Block the line's thread for the block, as SIGSTOP does."""
    thaw, stands = threading.Event(), threading.Event()

    def stand() -> None:
        stands.set()
        thaw.wait(60)

    in_loop(line, stand)
    assert stands.wait(10)
    try:
        yield
    finally:
        thaw.set()


def in_loop(line: Line, call: Callable[[], object]) -> None:
    """Run a function in the thread of a line."""
    loop = line._engine._loop
    assert loop is not None
    loop.call_soon_threadsafe(call)


@contextmanager
def other_program(path: str, folder: Path, name: str, late: float = 0.2) -> Iterator[OtherProgram]:
    """Start a separate process on the line; it is killed at the end at the latest."""
    command = [sys.executable, "-m", "tests.bus.share_program", path, str(folder), name, str(late)]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT
    )
    program = OtherProgram(process)
    try:
        program.hear("ready")
        yield program
    finally:
        program.kill()


@dataclass(slots=True)
class OtherProgram:
    """A process on the line that takes commands."""

    process: subprocess.Popen[str]

    def hear(self, wanted: str) -> None:
        """Wait for a line that it prints."""
        assert self.process.stdout is not None
        output = self.process.stdout.readline()
        assert output.startswith(wanted), output

    def tell(self, text: str) -> None:
        """Send a command and wait until it is done, or until its write begins."""
        assert self.process.stdin is not None
        print(text, file=self.process.stdin, flush=True)
        self.hear("did")

    def kill(self) -> float:
        """Kill it; return the time."""
        self.process.kill()
        killed = time.monotonic()
        self.process.communicate()
        return killed
