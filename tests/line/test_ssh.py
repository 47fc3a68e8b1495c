"""The panel over a real SSH session in a real terminal, also when that terminal is frozen.

A private SSH server on loopback, with keys of its own, serves a client inside a private tmux.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.conftest import need_peer
from tests.programs import PATIENCE, free_port, is_running, port_of, simulated, wait_until

from .conftest import Peer
from .terminal import Terminal

ROOT = Path(__file__).resolve().parents[2]
STALL = 10.0
"""Seconds for which the terminal is frozen."""
DRIVE_ROW = re.compile(r" +\d+ (\S+)")
"""A drive on Line: its address and its reference."""
MORE_REQUESTS = 20
"""Requests that must still arrive in this time."""


@dataclass(frozen=True, slots=True)
class SshHost:
    """A private SSH server and the command that logs in."""

    login: tuple[str, ...]


@pytest.fixture
def ssh_host(peer: Peer, tmp_path: Path) -> Iterator[SshHost]:
    """An SSH server on loopback that accepts only the key made for it."""
    server = shutil.which("sshd") or shutil.which("sshd", path="/usr/sbin:/usr/local/sbin")
    if server is None:
        need_peer("sshd is not here; it comes with the package openssh-server.")
        raise AssertionError
    if os.geteuid() == 0 and not Path("/run/sshd").is_dir():
        need_peer("an SSH server started by root needs the folder /run/sshd; make it first.")
    ssh, keygen = peer("ssh", "openssh-client"), peer("ssh-keygen", "openssh-client")
    port = free_port()
    for name in ("host", "user"):
        make_key = [keygen, "-q", "-t", "ed25519", "-N", "", "-f", str(tmp_path / name)]
        subprocess.run(make_key, check=True, timeout=PATIENCE)
    configuration = tmp_path / "sshd_config"
    configuration.write_text(
        f"Port {port}\nListenAddress 127.0.0.1\nHostKey {tmp_path / 'host'}\nPidFile none\n"
        f"AuthorizedKeysFile {tmp_path / 'user.pub'}\nPasswordAuthentication no\n"
        "KbdInteractiveAuthentication no\nPermitRootLogin prohibit-password\n"
        "StrictModes no\nUsePAM no\nPrintMotd no\nPrintLastLog no\n"
    )
    host_key = (tmp_path / "host.pub").read_text()
    known = tmp_path / "known_hosts"
    known.write_text(f"[127.0.0.1]:{port} {host_key}")
    log = (tmp_path / "sshd.log").open("w")
    daemon = subprocess.Popen(
        [server, "-D", "-e", "-f", str(configuration)], stdin=subprocess.DEVNULL, stderr=log
    )
    login = (
        *(ssh, "-tt", "-F", "none", "-p", str(port), "-i", str(tmp_path / "user")),
        *("-o", f"UserKnownHostsFile={known}", "-o", "IdentitiesOnly=yes", "-o", "BatchMode=yes"),
        "127.0.0.1",
    )
    try:
        wait_until(lambda: _listens(port) or daemon.poll() is not None, "the SSH server")
        assert daemon.poll() is None, (tmp_path / "sshd.log").read_text()
        yield SshHost(login)
    finally:
        daemon.terminate()
        daemon.wait(timeout=PATIENCE)
        log.close()


def panel_over(host: SshHost, tmp_path: Path, *arguments: str) -> list[str]:
    """The command that logs in and starts the panel there, and leaves its process id."""
    environment = {
        name: os.environ[name]
        for name in ("HOME", "DRIVEPANEL_CONFIG", "DRIVEPANEL_STATE", "LC_ALL", "TZ")
    }
    panel = shlex.join([sys.executable, "-m", "tui", *arguments])
    settings = " ".join(f"{name}={shlex.quote(value)}" for name, value in environment.items())
    remote = (
        f"cd {shlex.quote(str(ROOT))} && echo $$ > {shlex.quote(str(tmp_path / 'pid'))} && "
        f"exec env {settings} {panel}"
    )
    return [*host.login, f"sh -c {shlex.quote(remote)}"]


def test_demo_runs_over_ssh(
    ssh_host: SshHost, terminal_with: Callable[[list[str]], Terminal], tmp_path: Path
) -> None:
    terminal = terminal_with(panel_over(ssh_host, tmp_path, "demo"))
    terminal.wait_for("Drive Panel", "5 of 5")
    choose(terminal, "MACHINE")
    terminal.wait_for("4 · MACHINE")
    terminal.press("Enter")
    terminal.wait_for("Output", "FORWARD", "Hz")
    terminal.press("q")
    terminal.wait_for("Quit the panel?", "Device 1, Altivar 21: on loss of communication")
    terminal.answer("y")
    pid = int((tmp_path / "pid").read_text())
    wait_until(lambda: not is_running(pid), "the panel left on its key")


SETTLED = 0.5
"""Seconds that a question must be open before its answer counts, and a little more."""


def test_blocked_terminal_does_not_stop_polling(
    ssh_host: SshHost, terminal_with: Callable[[list[str]], Terminal], tmp_path: Path
) -> None:
    with (
        simulated("atv71@2", "--tcp", "127.0.0.1:0", "--run", "50") as simulation,
        Counter(port_of(simulation.ready)).at_work() as counter,
    ):
        line = f"tcp:127.0.0.1:{counter.port}"
        terminal = terminal_with(panel_over(ssh_host, tmp_path, line, "-d", "2"))
        terminal.wait_for("FORWARD", "Hz")
        panel = int((tmp_path / "pid").read_text())
        assert not _is_frozen(panel)
        with stopped(terminal.client(), _parent(panel)):
            # neither end of the session reads now; the panel sends so little that it would take
            # a minute until it could write no more, so the terminal is filled beforehand
            began = time.monotonic()
            _fill_terminal_of(panel)
            wait_until(lambda: _is_frozen(panel), "the panel cannot write any more")
            time.sleep(max(0.0, STALL - (time.monotonic() - began)))
            before = counter.requests
            wait_until(
                lambda: counter.requests >= before + MORE_REQUESTS,
                f"{MORE_REQUESTS} more requests while the terminal stands still",
            )
            assert _is_frozen(panel)
        terminal.wait_for("FORWARD", "Hz")
        stale = terminal.text()
        wait_until(lambda: terminal.text() != stale, "the screen goes on after the stall")
        terminal.press("q")
        terminal.wait_for("Quit the panel?")  # its drive acts on the timeout
        time.sleep(SETTLED)
        terminal.press("y")
        wait_until(lambda: not is_running(panel), "the panel left on its keys")


class Counter:
    """A TCP relay before a Modbus server that counts the requests passing through."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._open: list[socket.socket] = []
        self.port: int = self._listener.getsockname()[1]
        self.requests = 0
        """Chunks that the client sent: one Modbus TCP request each, as it waits for replies."""

    @contextmanager
    def at_work(self) -> Iterator[Counter]:
        """Relay until the block ends."""
        threads = [threading.Thread(target=self._accept, daemon=True)]
        threads[0].start()
        try:
            yield self
        finally:
            for item in (self._listener, *self._open):
                with suppress(OSError):
                    item.shutdown(socket.SHUT_RDWR)
                item.close()
            threads[0].join()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            server = socket.create_connection(("127.0.0.1", self._target))
            self._open += [client, server]
            for source, sink, count in ((client, server, 1), (server, client, 0)):
                threading.Thread(
                    target=self._relay, args=(source, sink, count), daemon=True
                ).start()

    def _relay(self, source: socket.socket, sink: socket.socket, count: int) -> None:
        with suppress(OSError):
            while data := source.recv(4096):
                self.requests += count
                sink.sendall(data)


def choose(terminal: Terminal, name: str) -> None:
    """Move the cursor of Line to the drive whose name or reference begins like this."""
    lines = terminal.text().splitlines()
    title = next(i for i, line in enumerate(lines) if "Dev " in line)
    column = lines[title].index("Dev ")
    rows = [match[1] for line in lines[title + 1 :] if (match := DRIVE_ROW.match(line[column:]))]
    place = next(i for i, reference in enumerate(rows) if reference.startswith(name))
    terminal.press("Home", *["Down"] * place)


@contextmanager
def stopped(*pids: int) -> Iterator[None]:
    """Freeze processes during the block."""
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)


def _fill_terminal_of(pid: int) -> None:
    """Fill the output buffer of a process's terminal, with bytes that no terminal shows."""
    terminal = os.open(f"/proc/{pid}/fd/1", os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
    try:
        with suppress(BlockingIOError):
            while True:
                os.write(terminal, bytes(256))
    finally:
        os.close(terminal)


def _is_frozen(pid: int) -> bool:
    """True if a process wrote nothing to files and terminals for two seconds."""
    before = _written(pid)
    time.sleep(2)
    return _written(pid) == before


def _written(pid: int) -> int:
    fields = Path(f"/proc/{pid}/io").read_text().split()
    return int(fields[fields.index("wchar:") + 1])


def _parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def _listens(port: int) -> bool:
    with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1):
        return True
    return False
