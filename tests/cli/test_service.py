"""Messages to systemd, over a datagram socket like its own; and the unit in the repository."""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
from collections.abc import Callable, Iterator
from configparser import ConfigParser
from contextlib import suppress
from pathlib import Path

import pytest

from tests.programs import PATIENCE
from tui.cli.running.serving import Service

UNITS = Path(__file__).resolve().parents[2] / "systemd"


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[socket.socket]:
    """The end of systemd."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(str(tmp_path / "notify"))
        end.settimeout(30)
        yield end


def service(systemd: socket.socket, **more: str) -> Service:
    return Service({"NOTIFY_SOCKET": systemd.getsockname(), **more})


def test_service_reports_ready_and_stopping(systemd: socket.socket) -> None:
    item = service(systemd)
    item.ready("sim:atv71\nMAINPID=1")
    assert systemd.recv(500) == b"READY=1\nSTATUS=sim:atv71 MAINPID=1"
    item.stopping()
    assert systemd.recv(500).startswith(b"STOPPING=1\n")


def test_abstract_socket_address_works() -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        name = f"drivepanel-test-{os.getpid()}"
        end.bind(f"\0{name}")
        end.settimeout(30)
        Service({"NOTIFY_SOCKET": f"@{name}"}).ready("here")
        assert end.recv(500) == b"READY=1\nSTATUS=here"


def test_service_without_a_socket_reports_nothing(tmp_path: Path) -> None:
    Service({}).ready("here")
    Service({"NOTIFY_SOCKET": str(tmp_path / "gone")}).ready("here")
    assert Service({}).watchdog is None
    assert Service({"WATCHDOG_USEC": "soon"}).watchdog is None
    assert Service({"WATCHDOG_USEC": "1000000", "WATCHDOG_PID": "1"}).watchdog is None
    mine = str(os.getpid())
    assert Service({"WATCHDOG_USEC": "3000000", "WATCHDOG_PID": mine}).watchdog == 3.0


async def test_watchdog_messages_end_if_the_line_hangs(systemd: socket.socket) -> None:
    alive = True
    item = service(systemd, WATCHDOG_USEC="60000")
    task = asyncio.create_task(item.watch(lambda: alive))
    for _ in range(3):
        assert await asyncio.to_thread(systemd.recv, 500) == b"WATCHDOG=1"
    alive = False
    systemd.setblocking(False)
    await asyncio.sleep(0.1)
    with suppress(BlockingIOError):
        while True:
            systemd.recv(500)
    await asyncio.sleep(0.2)
    with pytest.raises(BlockingIOError):
        systemd.recv(500)
    task.cancel()


def test_unit_matches_the_program() -> None:
    unit = ConfigParser(strict=False, interpolation=None, delimiters=("=",))
    unit.optionxform = str  # type: ignore[assignment, method-assign]
    unit.read(UNITS / "drivepanel.service", "utf-8")
    served = unit["Service"]
    assert served["Type"] == "notify"
    assert served["WatchdogSec"] == "30"
    assert f"--share-group {served['Group']}" in served["ExecStart"]
    assert " serve " in served["ExecStart"]
    assert served["RuntimeDirectory"] == "drivepanel"
    assert served["RuntimeDirectoryMode"] == "2770"
    assert served["RuntimeDirectoryPreserve"] == "yes"


def test_unit_allows_the_socket_to_belong_to_its_group() -> None:
    """A call that systemd forbids killed the program before it was ready."""
    lines = (UNITS / "drivepanel.service").read_text("utf-8").splitlines()
    filters = [line.partition("=")[2] for line in lines if line.startswith("SystemCallFilter=")]
    # @chown is one of @privileged; what comes later counts
    assert filters.index("@chown") > filters.index("~@privileged @resources")
    assert "SystemCallErrorNumber=EPERM" in lines


def test_systemd_accepts_the_unit(peer: Callable[[str, str], str], tmp_path: Path) -> None:
    """With a program that is there, and without the manual page, which is not."""
    text = (UNITS / "drivepanel.service").read_text("utf-8")
    text = text.replace("/usr/bin/drivepanel", "/bin/true").replace("Documentation=man", "#")
    (tmp_path / "drivepanel.service").write_text(text, "utf-8")
    done = subprocess.run(
        [peer("systemd-analyze", "systemd"), "verify", str(tmp_path / "drivepanel.service")],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_systemd_rates_the_unit_as_secure(peer: Callable[[str, str], str]) -> None:
    analyze = peer("systemd-analyze", "systemd")
    unit = str(UNITS / "drivepanel.service")
    done = subprocess.run(
        [analyze, "security", "--offline=yes", "--threshold=30", unit],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "Unknown" not in done.stderr
