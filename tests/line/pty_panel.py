"""The panel on a pseudo-terminal of the test, byte by byte, and every write on its line."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import signal
import socket
import struct
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import MappingProxyType

from tests.answering import read_answering
from tests.bus.peer import tcp_request_length
from tests.limits import BURST_GAP
from tests.programs import PATIENCE, wait_until
from tui.simulator import DriveSpec, Simulation

ROWS, COLUMNS = 24, 80
CONTROL = re.compile(r"\x1b\[(?P<arguments>[0-9;?<>=]*)[$]?(?P<final>[A-Za-z])|\x1b\][^\x07]*\x07")
STEPS = {"A": (-1, 0), "B": (1, 0), "C": (0, 1), "D": (0, -1)}
"""Rows and columns of one step of the cursor, by the final byte of its sequence."""
WRITES = {5, 6, 15, 16, 22, 23}
"""Functions of Modbus that write."""
SPLIT = 0.02
"""Seconds between two writes that must be read separately, as a network splits them."""


@dataclass(frozen=True, slots=True)
class Write:
    """A write on the line: register and words."""

    device: int
    register: int
    words: tuple[int, ...]


COMMAND = 8501
"""Register of the Altivar 71's command word, CMD."""

REFERENCE = 8502
"""Register of its reference, LFR, in 0.1 Hz."""

RUN = Write(1, COMMAND, (15,))
"""Word that runs its first drive forward."""

STOP = Write(1, COMMAND, (7,))
"""Word that stops its first drive in the Drivecom chart, at rest too."""

LINE_SETTLED = 0.4
"""Seconds, longer than a question or the run line ignores Enter."""


class WriteLog:
    """A TCP relay before a Modbus server that keeps every write passing through."""

    def __init__(self, target: tuple[str, int]) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._ends: list[socket.socket] = []
        self.port: int = self._listener.getsockname()[1]
        self.writes: list[Write] = []
        self.times: list[float] = []
        """Time of each write, in seconds of the monotonic clock."""
        self.connections = 0
        """Connections so far."""

    @contextmanager
    def at_work(self) -> Iterator[WriteLog]:
        threading.Thread(target=self._serve, name="write log", daemon=True).start()
        try:
            yield self
        finally:
            for end in (self._listener, *self._ends):
                with suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
                end.close()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                self.connections += 1
                server = socket.create_connection(self._target)
                self._ends += [client, server]
                for source, sink, seen in ((client, server, True), (server, client, False)):
                    threading.Thread(
                        target=self._carry, args=(source, sink, seen), daemon=True
                    ).start()

    def _carry(self, source: socket.socket, sink: socket.socket, seen: bool) -> None:
        kept = b""
        with suppress(OSError):
            while data := source.recv(4096):
                if seen:
                    kept = self._note(kept + data)
                sink.sendall(data)

    def _note(self, data: bytes) -> bytes:
        """Keep the writes among the complete requests; return the rest."""
        while (length := tcp_request_length(data)) and len(data) >= length:
            request, data = data[:length], data[length:]
            if request[7] in WRITES:
                self.times.append(time.monotonic())
                self.writes.append(_write_of(request))
        return data


def _write_of(request: bytes) -> Write:
    device, function, body = request[6], request[7], request[8:]
    if function == 23:
        register, rest = int.from_bytes(body[4:6], "big"), body[9:]
    else:
        register, rest = int.from_bytes(body[:2], "big"), body[2 if function == 6 else 5 :]
    words = tuple(int.from_bytes(rest[i : i + 2], "big") for i in range(0, len(rest) - 1, 2))
    return Write(device, register, words)


@dataclass
class PtyPanel:
    """A running panel, its terminal, and its line."""

    pid: int
    terminal: int
    simulation: Simulation
    log: WriteLog
    sent: bytes = b""
    """All output of the panel on its terminal."""
    cells: dict[tuple[int, int], str] = field(default_factory=dict)
    _at: tuple[int, int] = (0, 0)
    _rest: str = ""

    def type(self, *pieces: bytes | str, apart: float = SPLIT) -> None:
        """Write to the terminal, each piece separately, later than a burst after what was seen.

        A fast computer shows the effect of a key within a burst. Nobody answers so fast.
        """
        time.sleep(BURST_GAP)
        for index, piece in enumerate(pieces):
            if index:
                time.sleep(apart)
            os.write(self.terminal, piece.encode() if isinstance(piece, str) else piece)

    def open_search(self) -> None:
        """Go to the search field of Parameters, and wait until it takes text."""
        self.type("/")
        self.shows("/ search", "Enter list")

    def look(self, seconds: float = 0.05) -> bool:
        """Read the panel's output; False once it has ended."""
        while select.select([self.terminal], [], [], seconds)[0]:
            try:
                data = read_answering(self.terminal)
            except OSError:
                return False
            self.sent += data
            self._draw(data.decode(errors="replace"))
            seconds = 0.0
        return True

    def _draw(self, text: str) -> None:
        text, at = self._rest + text, 0
        for control in CONTROL.finditer(text):
            self._put(text[at : control.start()])
            at = control.end()
            if control["final"] == "H":
                row, _, column = control["arguments"].partition(";")
                self._at = (int(row or 1) - 1, int(column or 1) - 1)
            elif control["final"] in STEPS:
                steps = int(control["arguments"] or 1)
                row_step, column_step = STEPS[control["final"]]
                self._at = (self._at[0] + row_step * steps, self._at[1] + column_step * steps)
            elif control["final"] in ("X", "K"):
                row_at, column_at = self._at
                rest = COLUMNS - column_at if control["final"] == "K" else 1
                for erased in range(int(control["arguments"] or rest)):
                    self.cells[row_at, column_at + erased] = " "
        end = text.find("\x1b", at)
        self._put(text[at : end if end >= 0 else len(text)])
        self._rest = text[end:] if end >= 0 else ""

    def _put(self, text: str) -> None:
        row, column = self._at
        for character in text:
            if character == "\r":
                column = 0
            elif character == "\n":
                row += 1
            elif character == "\b":
                column -= 1
            else:
                self.cells[row, column] = character
                column += 1
        self._at = (row, column)

    def text(self) -> str:
        """Text on the terminal."""
        rows = range(ROWS)
        return "\n".join(
            "".join(self.cells.get((row, column), " ") for column in range(COLUMNS)) for row in rows
        )

    def shows(self, *words: str) -> None:
        """Wait until all these words are on the terminal."""

        def there() -> bool:
            self.look()
            return all(word in self.text() for word in words)

        try:
            wait_until(there, f"{words} on the terminal")
        except AssertionError as late:
            raise AssertionError(f"{late}:\n{self.text()}") from None

    def settle(self, seconds: float = 0.6) -> None:
        """Wait for the effect of typed keys; nothing marks its end.

        On a busy computer the panel may not even have read it yet.
        """
        end = time.monotonic() + PATIENCE
        while self.unread() and self.look() and time.monotonic() < end:
            pass
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.look()

    def unread(self) -> int:
        """Typed bytes that the panel has not read yet; 0 once it has ended."""
        try:
            side = os.open(f"/proc/{self.pid}/fd/0", os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:
            return 0
        try:
            reported = fcntl.ioctl(side, termios.FIONREAD, bytes(4))
        finally:
            os.close(side)
        return int.from_bytes(reported, sys.byteorder)

    @property
    def armed(self) -> bool:
        """True if the terminal shows the drive as armed."""
        self.look()
        return " ARMED" in self.text().replace("NOT ARMED", "")

    def arm(self) -> None:
        """Arm the drive on Monitor, by its key."""
        if not self.armed:
            self.type("a")
            wait_until(lambda: self.armed, "armed")

    def open_line(self, key: str = "r") -> None:
        """Arm the drive, and open the line of its reference."""
        self.arm()
        self.type(key)
        self.shows({"r": "RUN FORWARD at", "v": "RUN REVERSE at", "f": "REFERENCE at"}[key])
        self.settle(LINE_SETTLED)

    def run(self, hertz: int = 30) -> None:
        """Run the first motor forward, by keys."""
        self.open_line()
        before = len(self.log.writes)
        self.type(str(hertz))
        self.settle(0.2)
        self.type("\r")
        wait_until(lambda: self.look() and RUN in self.log.writes[before:], "the run")
        self.shows("FORWARD")

    def stopped(self, since: int, seconds: float = 0.6) -> None:
        """Check that only stops were sent since this many writes, and the drive is not armed."""
        wait_until(lambda: self.look() and self.stops(since) > 0, "the stop")
        self.settle(seconds)
        self.stops(since)
        wait_until(lambda: not self.armed, "not armed")

    def stops(self, since: int) -> int:
        """Count the stops sent after this many writes; fail if other frames were sent."""
        later = self.log.writes[since:]
        assert later == [STOP] * len(later), self.text()
        return len(later)


@contextmanager
def panel_on_a_pty(
    *options: str,
    drives: int = 1,
    size: tuple[int, int] = (COLUMNS, ROWS),
    environment: Mapping[str, str] | None = None,
    named: Callable[[str], Sequence[str]] = lambda line: (line, "-d", "1"),
    program: Sequence[str] = ("tui",),
) -> Iterator[PtyPanel]:
    """The panel on simulated drives over TCP, the first on Monitor.

    `named` gives the words by which a LINE and its first drive are called on the command line,
    `program` the module that opens the panel, with its first arguments.
    """
    specs = [DriveSpec("atv71", address) for address in range(1, drives + 1)]
    with Simulation(specs) as simulation, WriteLog(simulation.serve_tcp()).at_work() as log:
        line = named(f"tcp:127.0.0.1:{log.port}")
        started = start_panel([*line, *options], size, environment or {}, program)
        panel = PtyPanel(*started, simulation, log)
        with _until_the_end(panel):
            yield panel


@contextmanager
def panel_beside(panel: PtyPanel, device: int = 1) -> Iterator[PtyPanel]:
    """Another panel on the same line, with one drive on Monitor."""
    started = start_panel([f"tcp:127.0.0.1:{panel.log.port}", "-d", str(device)])
    with _until_the_end(PtyPanel(*started, panel.simulation, panel.log)) as other:
        yield other


@contextmanager
def _until_the_end(panel: PtyPanel) -> Iterator[PtyPanel]:
    """Start a panel, wait until its drive is shown, and kill it at the end."""
    try:
        panel.shows("STANDBY")
        yield panel
    finally:
        with suppress(ProcessLookupError):
            os.kill(panel.pid, signal.SIGKILL)
        with suppress(ChildProcessError):  # its end may have been waited for already
            os.waitpid(panel.pid, 0)
        os.close(panel.terminal)


def start_panel(
    arguments: list[str],
    size: tuple[int, int] = (COLUMNS, ROWS),
    more: Mapping[str, str] = MappingProxyType({}),
    program: Sequence[str] = ("tui",),
) -> tuple[int, int]:
    """Start the panel on a new pseudo-terminal: its process and the terminal's other end."""
    pid, terminal = pty.fork()
    if pid == 0:
        try:
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", *size[::-1], 0, 0))
            environment = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES")}
            environment |= {"TERM": "xterm-256color", "LC_ALL": "C.UTF-8", **more}
            command = [sys.executable, "-m", *program, *arguments]
            os.execvpe(command[0], command, environment)
        finally:
            os._exit(127)  # never back into the test
    return pid, terminal
