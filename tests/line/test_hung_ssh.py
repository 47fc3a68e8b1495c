"""Keys over a real SSH session whose link hangs and then delivers everything together."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

import pytest

from tests.programs import wait_until
from tui.simulator import DriveSpec, Simulation

from .conftest import Peer
from .pty_panel import COMMAND, RUN, WriteLog
from .terminal import Terminal
from .test_ssh import SshHost, panel_over, ssh_host

__all__ = ["ssh_host"]

Start = Callable[[list[str]], Terminal]
HUNG = 5.0
"""Seconds for which the link lets nothing through."""


class HangingLink:
    """A TCP relay before the SSH server that can hold all bytes, both ways, and lose none."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._ends: list[socket.socket] = []
        self._free = threading.Event()
        self._free.set()
        self.port: int = self._listener.getsockname()[1]

    @contextmanager
    def at_work(self) -> Iterator[HangingLink]:
        threading.Thread(target=self._serve, daemon=True).start()
        try:
            yield self
        finally:
            self._free.set()
            for end in (self._listener, *self._ends):
                with suppress(OSError):
                    end.shutdown(socket.SHUT_RDWR)
                end.close()

    @contextmanager
    def hung(self) -> Iterator[None]:
        """Nothing passes inside the block; everything passes after it."""
        self._free.clear()
        try:
            yield
        finally:
            self._free.set()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                server = socket.create_connection(("127.0.0.1", self._target))
                self._ends += [client, server]
                for source, sink in ((client, server), (server, client)):
                    threading.Thread(target=self._carry, args=(source, sink), daemon=True).start()

    def _carry(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                self._free.wait()
                sink.sendall(data)


class Far:
    """A panel on the far side of the link, its line, and the motor."""

    def __init__(
        self, terminal: Terminal, link: HangingLink, log: WriteLog, simulation: Simulation
    ) -> None:
        self.terminal, self.link, self.log, self.simulation = terminal, link, log, simulation

    @property
    def armed(self) -> bool:
        return " ARMED" in self.terminal.text().replace("NOT ARMED", "")

    def run(self) -> None:
        """Run the motor, by keys."""
        self.terminal.press("a")
        wait_until(lambda: self.armed, "armed")
        self.terminal.press("r")
        self.terminal.wait_for("RUN FORWARD at")
        self.terminal.press("3", "0")
        self.terminal.wait_for("30  Hz")
        self.terminal.answer("Enter")
        wait_until(lambda: RUN in self.log.writes, "a run")
        self.terminal.wait_for("FORWARD")

    def type_while_hung(self, *keys: tuple[float, str]) -> None:
        """Press keys at these seconds of a time in which the link hangs."""
        with self.link.hung():
            began = time.monotonic()
            for at, key in [*keys, (HUNG, "")]:
                time.sleep(max(0.0, began + at - time.monotonic()))
                if key:
                    self.terminal.press(key)

    def moved(self, since: int) -> list[object]:
        """Later writes that are not ramp stops."""
        later = self.log.writes[since:]
        return [write for write in later if (write.register, write.words) != (COMMAND, (7,))]


@pytest.fixture
def far(ssh_host: SshHost, terminal_with: Start, tmp_path: Path, peer: Peer) -> Iterator[Far]:
    """A panel over SSH behind a link that can hang, on Monitor."""
    place = ssh_host.login.index("-p") + 1
    with (
        Simulation([DriveSpec("atv71", 1)]) as simulation,
        WriteLog(simulation.serve_tcp()).at_work() as log,
        HangingLink(int(ssh_host.login[place])).at_work() as link,
    ):
        login = list(ssh_host.login)
        # the server is known by the name and the port that it has without the link
        alias = f"HostKeyAlias=[127.0.0.1]:{login[place]}"
        login[place] = str(link.port)
        host = replace(ssh_host, login=(*login[:-1], "-o", alias, login[-1]))
        arguments = (f"tcp:127.0.0.1:{log.port}", "-d", "1")
        terminal = terminal_with(panel_over(host, tmp_path, *arguments))
        terminal.wait_for("STANDBY")
        yield Far(terminal, link, log, simulation)
        with suppress(OSError, ValueError):
            os.kill(int((tmp_path / "pid").read_text()), 15)


@pytest.mark.parametrize("key", ["r", "Up", "Enter"])
def test_stop_after_earlier_keys_stops_a_running_motor(far: Far, key: str) -> None:
    far.run()
    before = len(far.log.writes)
    far.type_while_hung((1.0, key), (2.5, "Space"))
    wait_until(lambda: len(far.log.writes) > before, "the stop")
    wait_until(lambda: far.simulation.drive(1).motor.frequency == 0, "the motor stands")
    far.terminal.wait_for("press a, then r")
    time.sleep(1.0)
    assert far.moved(before) == []


def test_open_run_line_on_a_hung_link_runs_nothing_after_a_stop(far: Far) -> None:
    far.terminal.press("a")
    wait_until(lambda: far.armed, "armed")
    far.terminal.press("r")
    far.terminal.wait_for("RUN FORWARD at")
    far.type_while_hung((1.0, "3"), (1.3, "0"), (2.0, "Enter"), (4.0, "Space"))
    wait_until(lambda: bool(far.log.writes), "the stop")
    far.terminal.wait_for("press a, then r")
    time.sleep(1.0)
    assert far.moved(0) == []


def test_spaced_keys_delivered_together_are_ignored_and_reported(far: Far) -> None:
    far.type_while_hung((0.0, "a"), (1.5, "r"), (3.0, "r"), (4.5, "v"))
    far.terminal.wait_for("Ignored 4 keys that arrived")
    time.sleep(1.0)
    assert far.log.writes == []
    assert not far.armed
