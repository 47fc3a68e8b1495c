"""Ends of a panel with a running motor: signals, resizes, early keys, internal errors.

Part of `python -m benchmarks.hands`. Each case starts a panel on a pseudo-terminal, runs the motor
by keys, and counts what passes the relay on its line.
"""

from __future__ import annotations

import fcntl
import os
import random
import signal
import socket
import struct
import sys
import tempfile
import termios
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from tests.line.pty_panel import COMMAND, PtyPanel, Write, WriteLog, panel_on_a_pty, start_panel
from tests.programs import PATIENCE
from tui.simulator import DriveSpec, Simulation

STOP_WORDS = {7, 2, 0, 0x010F}
"""Command words of an Altivar 71 that a program may write unasked: only words that stop."""
UNCAUGHT = {signal.SIGKILL, signal.SIGSTOP}
HARMLESS = {signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH, signal.SIGPIPE}
"""Signals that end no program by default, and the one of a closed pipe, which Python ignores."""
OF_ERRORS = {signal.SIGILL, signal.SIGTRAP, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE,
             signal.SIGSEGV, signal.SIGSYS}  # fmt: skip
"""Signals by which the system reports that a program is broken."""
SUSPENDING = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)
FIRST_REAL_TIME = 34
ENDING = tuple(
    number
    for number in sorted(signal.valid_signals())
    if number not in UNCAUGHT | HARMLESS | OF_ERRORS | {signal.SIGINT, *SUSPENDING}
    and number <= FIRST_REAL_TIME
)
"""Signals that end a process by default. Real-time signals are alike: the first one is enough."""
SCREENS: dict[str, tuple[bytes, ...]] = {
    "Line": (b"1",),
    "Monitor": (b"2",),
    "Parameters": (b"3",),
    "Scanner": (b"4",),
    "Faults": (b"5",),
    "Control": (b"6",),
    "Frames": (b"7",),
    "Trend": (b"8",),
    "Start-up": (b"B",),
    "Messages": (b"m",),
    "Help": (b"?",),
    "palette": (b"\x10",),
    "run line": (b"f",),
    "question of leaving": (b"q",),
}
"""Keys that lead from Monitor to a screen or a dialog while the motor runs."""
SIZES = ((5, 300), (3, 100))
"""Fewest and most columns and rows of a resize."""


@dataclass(slots=True)
class Endings:
    """One kind of end, or of attack, over all its cases."""

    cases: int = 0
    moved: int = 0
    """Writes that are not stops."""
    no_stop: int = 0
    """Cases without a stop where there must be one."""
    ended_wrongly: int = 0
    """Panels that ended and should not have, or the other way."""
    tracebacks: int = 0
    worst: float = 0.0
    """Longest time from the cause to the stop on the wire, in s."""


def _is_stop(write: Write) -> bool:
    return write.register == COMMAND and write.words[0] in STOP_WORDS


def _has_ended(panel: PtyPanel) -> bool:
    with suppress(ChildProcessError):
        return os.waitpid(panel.pid, os.WNOHANG)[0] != 0
    return True


def _await_end(panel: PtyPanel, seconds: float = PATIENCE) -> bool:
    """Read what the panel still writes until it has ended; True once it has."""
    end = time.monotonic() + seconds
    while not _has_ended(panel):
        panel.look(0.02)
        if time.monotonic() > end:
            return False
    panel.look(0.02)
    return True


def _count(panel: PtyPanel, begun: float, counted: Endings, *, stops: bool = True) -> None:
    """Count what passed the line since a cause at `begun`."""
    sent = [
        (at, write)
        for at, write in zip(panel.log.times, panel.log.writes, strict=False)
        if at >= begun
    ]
    stop = next((at for at, write in sent if _is_stop(write)), None)
    counted.moved += sum(not _is_stop(write) for _, write in sent)
    counted.no_stop += stops and stop is None
    if stop is not None and stops:
        counted.worst = max(counted.worst, stop - begun)
    counted.tracebacks += b"Traceback" in panel.sent


def by_signals(counted: Endings, most: int) -> None:
    """Every signal that ends a process by default: a stop first, then the end."""
    for number in ENDING[:most]:
        with panel_on_a_pty() as panel:
            panel.run()
            begun = time.monotonic()
            os.kill(panel.pid, number)
            counted.ended_wrongly += not _await_end(panel)
            counted.cases += 1
            _count(panel, begun, counted)


def by_suspending(counted: Endings, most: int) -> None:
    """Ctrl-Z and its like: the panel goes on, and its stop key works."""
    for number in SUSPENDING[:most]:
        with panel_on_a_pty() as panel:
            panel.run()
            os.kill(panel.pid, number)
            panel.settle(1.0)
            counted.cases += 1
            counted.ended_wrongly += _has_ended(panel)
            begun = time.monotonic()
            panel.type(b" ")
            panel.settle(1.0)
            _count(panel, begun, counted)


def by_errors(counted: Endings, most: int) -> None:
    """An error in the drawing of each screen, and of the frame over it."""
    for name, keys in list(SCREENS.items())[:most]:
        for method in ("put", "draw_frame"):
            if method == "put" and name in ("palette", "question of leaving", "run line"):
                continue  # they draw no lines of their own
            with tempfile.TemporaryDirectory() as folder:
                switch = Path(folder) / "fails"
                environment = {"BROKEN_PANEL": str(switch)}
                with panel_on_a_pty(
                    environment=environment, program=("benchmarks.broken_panel",)
                ) as panel:
                    panel.run()
                    for key in keys:
                        panel.type(key)
                        panel.settle(0.4)
                    switch.with_suffix(".new").write_text(method, "utf-8")
                    switch.with_suffix(".new").rename(switch)
                    if not _await_end(panel):
                        counted.ended_wrongly += 1
                        print(f"an error in {name}, {method}: goes on", file=sys.stderr)
                    counted.cases += 1
                    raised = float(switch.with_suffix(".raised").read_text("utf-8"))
                    _count(panel, raised, counted)


def resize(panel: PtyPanel, columns: int, rows: int) -> None:
    """Give the terminal another size, as a window manager does."""
    fcntl.ioctl(panel.terminal, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))


def by_resizes(counted: Endings, most: int, chance: random.Random, times: int) -> None:
    """Random sizes on every screen while the motor runs; then Space."""
    for keys in list(SCREENS.values())[:most]:
        with panel_on_a_pty() as panel:
            panel.run()
            for key in keys:
                panel.type(key)
                panel.settle(0.2)
            begun = time.monotonic()
            for _ in range(max(1, times // len(SCREENS))):
                resize(panel, *(chance.randint(*limits) for limits in SIZES))
                if chance.random() < 0.3:
                    panel.look(0.05)
            panel.settle(0.5)
            counted.cases += 1
            counted.ended_wrongly += _has_ended(panel)
            counted.moved += sum(at >= begun for at in panel.log.times)
            resize(panel, 80, 24)
            panel.settle(0.5)
            begun = time.monotonic()
            panel.type(b"\x1b[24~")
            panel.settle(1.0)
            _count(panel, begun, counted)


@contextmanager
def _slow_door(target: int) -> Iterator[tuple[int, threading.Event]]:
    """A TCP port that answers only once an event is set; then it leads to the target."""
    opened = threading.Event()
    listener = socket.create_server(("127.0.0.1", 0))
    ends: list[socket.socket] = [listener]

    def carry(source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(4096):
                sink.sendall(data)

    def serve() -> None:
        with suppress(OSError):
            while True:
                client, _ = listener.accept()
                ends.append(client)
                opened.wait()
                server = socket.create_connection(("127.0.0.1", target))
                ends.append(server)
                for pair in ((client, server), (server, client)):
                    threading.Thread(target=carry, args=pair, daemon=True).start()

    threading.Thread(target=serve, daemon=True).start()
    try:
        yield listener.getsockname()[1], opened
    finally:
        opened.set()
        for end in ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()


EARLY_KEYS = (b"\x1b[B", b"\x1b[A", b"\r", b"1", b"2", b"r", b"a", b"s", b"y", b"n", b"]", b"x")
"""Keys that are typed while a line opens; Down and Enter most of all."""


def by_early_keys(counted: Endings, chance: random.Random, rounds: int) -> None:
    """Keys while a line opens: no other line is opened, nothing is written."""
    for number in range(rounds):
        with (
            Simulation([DriveSpec("atv71", 1)]) as simulation,
            Simulation([DriveSpec("atv71", 1)]) as other,
            WriteLog(simulation.serve_tcp()).at_work() as log,
            WriteLog(other.serve_tcp()).at_work() as other_log,
            _slow_door(log.port) as (port, opened),
            tempfile.TemporaryDirectory() as folder,
        ):
            place = Path(folder) / "drivepanel"
            place.mkdir()
            text = f'[lines]\nother = "tcp:127.0.0.1:{other_log.port}"\n'
            (place / "settings.toml").write_text(text, "utf-8")
            environment = {"XDG_CONFIG_HOME": folder, "XDG_STATE_HOME": folder}
            options = [f"tcp:127.0.0.1:{port}", *(("-d", "1") if number % 2 else ())]
            process, terminal = start_panel(options, (80, 24), environment)
            panel = PtyPanel(process, terminal, simulation, log)
            try:
                panel.shows("Line")
                tour = [b"\x1b[B"] * 3 + [b"\r"]
                for key in tour if number < 2 else chance.choices(EARLY_KEYS, k=12):
                    panel.type(key)
                    panel.settle(0.08)
                opened.set()
                panel.settle(2.0)
                counted.cases += 1
                counted.ended_wrongly += _has_ended(panel) or bool(other_log.connections)
                counted.moved += len(log.writes) + len(other_log.writes)
                counted.tracebacks += b"Traceback" in panel.sent
            finally:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
                with suppress(ChildProcessError):
                    os.waitpid(process, 0)
                os.close(terminal)


def count_ends(chance: random.Random, most: int, resizes: int) -> dict[str, Endings]:
    """All of it, by kind; `most` cases of each."""
    found: dict[str, Endings] = defaultdict(Endings)
    by_signals(found["signals that end"], most)
    by_suspending(found["signals that suspend"], most)
    by_errors(found["errors in drawing"], most)
    by_resizes(found["resizes"], most, chance, resizes)
    by_early_keys(found["keys while opening"], chance, most)
    return dict(found)
