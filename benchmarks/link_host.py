"""A private SSH server on loopback behind a link, and the command that runs a program there.

The server has its own host key and user key in its own folder, and accepts no other. Programs run
in a login of the user of the benchmark.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from benchmarks.link_proxy import Link, Proxy
from benchmarks.wire import ROOT

LOGGED_IN = "logged-in"
"""The word that a login prints before the program starts."""
PATIENCE = 20.0
"""Seconds for the server to listen, and for a program to leave."""
CONFIGURATION = """Port {port}
ListenAddress 127.0.0.1
HostKey {folder}/host
PidFile none
AuthorizedKeysFile {folder}/user.pub
PasswordAuthentication no
KbdInteractiveAuthentication no
PermitRootLogin prohibit-password
StrictModes no
UsePAM no
PrintMotd no
PrintLastLog no
"""


def missing() -> str | None:
    """Name the programs that a private SSH server needs and that are missing; None if all exist."""
    for name, package in (
        ("sshd", "openssh-server"),
        ("ssh", "openssh-client"),
        ("ssh-keygen", "openssh-client"),
    ):
        if _program(name) is None:
            return f"{name} is missing; it comes with the package {package}."
    if os.geteuid() == 0 and not Path("/run/sshd").is_dir():
        return "An SSH server started by root needs the folder /run/sshd; make it first."
    return None


class Host:
    """A login over a link: the commands for it, and how programs there are ended."""

    def __init__(self, folder: Path, proxy: Proxy, environment: Mapping[str, str]) -> None:
        self.proxy = proxy
        self._folder = folder
        self._environment = environment

    def command(self, program: Sequence[str], *, compressed: bool = False) -> list[str]:
        """Log in on a terminal, print LOGGED_IN, and become the program."""
        settings = " ".join(f"{k}={shlex.quote(v)}" for k, v in self._environment.items())
        remote = (
            f"cd {shlex.quote(str(ROOT))} && echo $$ > {shlex.quote(str(self._pid))} && "
            f"echo {LOGGED_IN} && exec env {settings} {shlex.join(program)}"
        )
        known = self._folder / "known_hosts"
        return [
            *("ssh", "-tt", "-F", "none", "-p", str(self.proxy.port)),
            *("-i", str(self._folder / "user"), *(("-C",) if compressed else ())),
            *("-o", f"UserKnownHostsFile={known}", "-o", "HostKeyAlias=benchmark"),
            *("-o", "IdentitiesOnly=yes", "-o", "BatchMode=yes", "-o", "LogLevel=ERROR"),
            *("127.0.0.1", f"sh -c {shlex.quote(remote)}"),
        ]

    def end(self) -> None:
        """Cut the link, and wait for the program behind it to leave; in the end kill it."""
        self.proxy.cut()
        try:
            pid = int(self._pid.read_text())
        except (OSError, ValueError):
            return
        self._pid.unlink()
        end = time.monotonic() + PATIENCE
        while _runs(pid):
            if time.monotonic() > end:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            time.sleep(0.05)

    @property
    def _pid(self) -> Path:
        return self._folder / "pid"


@contextmanager
def ssh_host(folder: Path, environment: Mapping[str, str]) -> Iterator[Host]:
    """A private SSH server behind a link without a limit; `missing()` names missing programs.

    `environment` is that of the programs behind it. Raises RuntimeError if it does not start.
    """
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port: int = probe.getsockname()[1]
    for name in ("host", "user"):
        subprocess.run(
            [_program("ssh-keygen") or "", "-q", "-t", "ed25519", "-N", "", "-f", folder / name],
            check=True,
        )
    (folder / "sshd_config").write_text(CONFIGURATION.format(port=port, folder=folder))
    (folder / "known_hosts").write_text(f"benchmark {(folder / 'host.pub').read_text()}")
    with (folder / "sshd.log").open("w") as log:
        server = subprocess.Popen(
            [_program("sshd") or "", "-D", "-e", "-f", folder / "sshd_config"],
            stdin=subprocess.DEVNULL,
            stderr=log,
        )
    try:
        _wait_for(server, port, folder / "sshd.log")
        with Proxy(port, Link()).at_work() as proxy:
            yield Host(folder, proxy, environment)
    finally:
        server.terminate()
        server.wait(PATIENCE)


def _wait_for(server: subprocess.Popen[bytes], port: int, log: Path) -> None:
    end = time.monotonic() + PATIENCE
    while server.poll() is None and time.monotonic() < end:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1):
            return
        time.sleep(0.05)
    raise RuntimeError(f"the SSH server did not start: {log.read_text()}")


def _program(name: str) -> str | None:
    return shutil.which(name) or shutil.which(name, path="/usr/sbin:/usr/local/sbin")


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
