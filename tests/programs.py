"""Run `drivepanel` and other programs as processes, and end them by their id."""

from __future__ import annotations

import os
import re
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from tui.bus.program import KEEPER
from tui.bus.share.place import has_ended, owner_of_lock
from tui.session.connect.share_place import group_folder
from tui.simulator import Simulation

PATIENCE = 60.0
"""Seconds after which a program that hangs ends its test; not a measurement."""

DRIVEPANEL = (sys.executable, "-m", "tui")


def drivepanel(*arguments: str, timeout: float = PATIENCE) -> subprocess.CompletedProcess[str]:
    """Run a command of the panel to its end, without a terminal."""
    return subprocess.run(
        [*DRIVEPANEL, *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


@dataclass(frozen=True, slots=True)
class Served:
    """A running program, and the line with which it reported that it is ready."""

    process: subprocess.Popen[str]
    ready: str

    def end(self, number: signal.Signals = signal.SIGTERM) -> tuple[int, str]:
        """Send it a signal; return its exit status and the rest of standard error."""
        self.process.send_signal(number)
        _, output = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, output


@contextmanager
def served(
    command: Sequence[str], *, ready: str = "", stdin: int = subprocess.DEVNULL
) -> Iterator[Served]:
    """Run a program until the block ends; enter once it printed a line with `ready`."""
    process = subprocess.Popen(
        command,
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=own_interrupts,
    )
    try:
        yield Served(process, _ready_line(process, ready))
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate(timeout=PATIENCE)


@contextmanager
def simulated(*arguments: str, stdin: int = subprocess.DEVNULL) -> Iterator[Served]:
    """Run `drivepanel simulate` for the block.

    The link to a pseudo-terminal is removed before that is closed: see `pty_pair`.
    """
    command = [*DRIVEPANEL, "simulate", *arguments]
    with served(command, ready="Ready:", stdin=stdin) as program:
        try:
            yield program
        finally:
            if "--pty" in arguments:
                Path(arguments[arguments.index("--pty") + 1]).unlink(missing_ok=True)


def keepers(*folders: Path) -> list[int]:
    """Return process ids of the keepers with locks in these folders, or in those of the test."""
    places = folders or (Path(os.environ["DRIVEPANEL_STATE"], "lines"), group_folder())
    found = []
    for lock in chain.from_iterable(place.glob("*.lock") for place in places):
        owner = owner_of_lock(lock)
        if owner is not None and owner.program.name == KEEPER and not has_ended(owner.program):
            found.append(owner.program.pid)
    return found


def end_keepers(*folders: Path) -> None:
    """End the keepers, each of which would wait some seconds for the next program."""
    for pid in (ended := keepers(*folders)):
        os.kill(pid, signal.SIGTERM)
    wait_until(lambda: not any(map(is_running, ended)), "the keepers end")


def kill_keepers(*folders: Path) -> None:
    """End all keepers: their drives no longer exist, and some would wait for them."""
    for pid in keepers(*folders):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def is_running(pid: int) -> bool:
    """True if a process has not ended; a zombie counts as ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (OSError, IndexError):
        return False


def own_interrupts() -> None:
    """Let signals work in the program even if the test run ignores them, as with nohup."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def _ready_line(process: subprocess.Popen[str], wanted: str) -> str:
    assert process.stdout is not None
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if select.select([process.stdout], [], [], 0.1)[0]:
            line = process.stdout.readline()
            if line and wanted in line:
                return line.rstrip("\n")
            if line:
                continue
        if process.poll() is not None:
            assert process.stderr is not None
            raise AssertionError(f"{process.args!r} ended at once: {process.stderr.read()}")
    raise AssertionError(f"{process.args!r} was not ready after {PATIENCE:.0f} s")


def wait_until(condition: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
    """Wait for a result; fail with `what` if there is none."""
    deadline = time.monotonic() + patience
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"waited {patience:.0f} s in vain: {what}")
        time.sleep(0.05)


def port_of(ready: str) -> int:
    """The TCP port in a line such as `Ready: atv71@2 on tcp:127.0.0.1:5020. Ctrl-C ends it.`"""
    match = re.search(r"tcp:127\.0\.0\.1:(\d+)", ready)
    assert match is not None, ready
    return int(match[1])


def free_port() -> int:
    """Return a free TCP port of loopback, for programs that cannot choose one themselves."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port: int = probe.getsockname()[1]
    return port


def rtu_tcp(simulation: Simulation) -> str:
    """Return the LINE to simulated drives of this process: RTU over TCP, without baud timing."""
    host, port = simulation.serve_rtu_tcp()
    return f"rtu-tcp:{host}:{port}"


@contextmanager
def pty_pair() -> Iterator[tuple[str, str]]:
    """Two pseudo-terminals joined by a cable: paths of links to the two ends.

    The number of a pseudo-terminal is reused as soon as that is closed. A keeper that looks for its
    lost line by number would read the keys of another test's terminal, and write on its screen.
    """
    pairs = [os.openpty(), os.openpty()]
    folder = tempfile.mkdtemp(prefix="cable-")
    links = [Path(folder, end) for end in ("near", "far")]
    for link, (_, slave) in zip(links, pairs, strict=True):
        tty.setraw(slave)
        link.symlink_to(os.ttyname(slave))
    bell, rope = os.pipe()
    masters = [master for master, _ in pairs]

    def carry() -> None:
        while True:
            ready = select.select([*masters, bell], [], [])[0]
            if bell in ready:
                return
            for index, master in enumerate(masters):
                if master in ready:
                    os.write(masters[1 - index], os.read(master, 4096))

    cable = threading.Thread(target=carry, name="cable", daemon=True)
    cable.start()
    try:
        yield str(links[0]), str(links[1])
    finally:
        shutil.rmtree(folder)
        os.write(rope, b"x")
        cable.join()
        for handle in (bell, rope, *(number for pair in pairs for number in pair)):
            os.close(handle)
