"""Running `drivepanel` and other programs as processes of their own, ended by their own id."""

from __future__ import annotations

import os
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from tui.simulator import Simulation

PATIENCE = 60.0
"""Seconds after which a program that hangs ends its test; never a measure of anything."""

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
    """A program that runs, and the line with which it said that it is ready."""

    process: subprocess.Popen[str]
    ready: str

    def end(self, number: signal.Signals = signal.SIGTERM) -> tuple[int, str]:
        """Send it a signal; its exit status and what it still had to say on standard error."""
        self.process.send_signal(number)
        _, said = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, said


@contextmanager
def served(
    command: Sequence[str], *, ready: str = "", stdin: int = subprocess.DEVNULL
) -> Iterator[Served]:
    """A program that serves until the block ends; begins once it printed a line with `ready`."""
    process = subprocess.Popen(
        command,
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=_own_interrupts,
    )
    try:
        yield Served(process, _ready_line(process, ready))
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate(timeout=PATIENCE)


@contextmanager
def simulated(*arguments: str, stdin: int = subprocess.DEVNULL) -> Iterator[Served]:
    """`drivepanel simulate` at work."""
    command = [*DRIVEPANEL, "simulate", *arguments]
    with served(command, ready="Ready:", stdin=stdin) as program:
        yield program


def _own_interrupts() -> None:
    """Let signals work in the program even where the test run itself ignores them, as by nohup."""
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
    """Wait for something that will come; fails with `what` where it does not."""
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
    """A TCP port of loopback that nobody uses, for programs that cannot choose one themselves."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port: int = probe.getsockname()[1]
    return port


def rtu_tcp(simulation: Simulation) -> str:
    """The LINE to simulated drives of this process: RTU frames, and no pseudo-terminal to time."""
    host, port = simulation.serve_rtu_tcp()
    return f"rtu-tcp:{host}:{port}"


@contextmanager
def pty_pair() -> Iterator[tuple[str, str]]:
    """Two pseudo-terminals joined by a cable: paths of the two ends."""
    pairs = [os.openpty(), os.openpty()]
    for _, slave in pairs:
        tty.setraw(slave)
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
        yield os.ttyname(pairs[0][1]), os.ttyname(pairs[1][1])
    finally:
        os.write(rope, b"x")
        cable.join()
        for handle in (bell, rope, *(one for pair in pairs for one in pair)):
            os.close(handle)
