"""Monitoring a third-party master, and the system calls on its port."""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.programs import DRIVEPANEL, PATIENCE, Served, served, wait_until
from tui.simulator import DriveSpec, PlcOnLine, Simulation

from .conftest import Peer

STATUS, ACCELERATION = 3201, 9001
ATV71 = "atv71"


@contextmanager
def tapped_cable(drives: str) -> Iterator[tuple[str, str]]:
    """A cable from a master to drives, and a tap: paths of the master's end and of the tap's."""
    pairs = [os.openpty(), os.openpty()]
    for _, slave in pairs:
        tty.setraw(slave)
    (master, _), (tap, _) = pairs
    os.set_blocking(tap, False)
    far = os.open(drives, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(far)
    bell, rope = os.pipe()

    def carry() -> None:
        to = {master: far, far: master}
        while True:
            ready = select.select([master, far, bell], [], [])[0]
            if bell in ready:
                return
            for number in ready:
                data = os.read(number, 4096)
                with suppress(BlockingIOError):
                    os.write(tap, data)
                os.write(to[number], data)

    cable = threading.Thread(target=carry, name="cable", daemon=True)
    cable.start()
    try:
        yield os.ttyname(pairs[0][1]), os.ttyname(pairs[1][1])
    finally:
        os.write(rope, b"x")
        cable.join()
        for handle in (bell, rope, far, *(number for pair in pairs for number in pair)):
            os.close(handle)


def test_mbpoll_traffic_is_monitored(peer: Peer, tmp_path: Path) -> None:
    """Reads and writes of mbpoll are reported, and are in the file as tshark reads it."""
    mbpoll, tshark = peer("mbpoll", "mbpoll"), peer("tshark", "tshark")
    file = tmp_path / "frames.pcapng"

    def ask(place: str, *options: str) -> None:
        common = ["-m", "rtu", "-b", "19200", "-P", "none", "-0", "-1", "-t", "4"]
        subprocess.run(
            [mbpoll, *common, *options[:4], place, *options[4:]],
            capture_output=True,
            timeout=PATIENCE,
            check=False,
        )

    with (
        Simulation([DriveSpec(ATV71, 2, sets={"ETA": 0x0637, "ACC": 57})]) as simulation,
        tapped_cable(simulation.serve_pty()) as (place, tap),
        served(
            [*DRIVEPANEL, "listen", tap, "--pcap", str(file), "-p", ATV71], ready="Listening"
        ) as listening,
    ):
        ask(place, "-a", "2", "-r", str(STATUS))
        ask(place, "-a", "2", "-r", str(ACCELERATION), "61")
        ask(place, "-a", "2", "-r", "1")
        ask(place, "-a", "7", "-r", str(STATUS))
        listening.process.send_signal(signal.SIGINT)
        out, err = listening.process.communicate(timeout=PATIENCE)
    assert listening.process.returncode == 130
    assert "  2 read   ETA 16#0637" in out
    assert re.search(r"  2 write  ACC ← 61 raw", out)
    assert "  2 read   1: exception 2" in out
    assert "Device 7: family unknown" in out or "Device 7: Altivar 71 (set by -p)" in out
    assert "no answer to " in out
    assert "packets written" in err
    done = subprocess.run(
        [tshark, "-r", str(file), "-T", "fields", "-e", "mbtcp.unit_id", "-e", "modbus.func_code"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
    )
    assert {tuple(line.split()) for line in done.stdout.splitlines()} >= {
        ("2", "3"), ("2", "6"), ("7", "3"),
    }  # fmt: skip


def test_monitoring_sends_nothing_to_the_port(peer: Peer, tmp_path: Path) -> None:
    """By strace: the port is opened for reading, configured, locked and read; nothing else."""
    strace = peer("strace", "strace")
    log = tmp_path / "calls"
    requests = [bytes.fromhex("02030c810001"), bytes.fromhex("020621360000")]
    with Simulation([DriveSpec(ATV71, 2)]) as simulation:
        master = PlcOnLine(simulation, requests)
        try:
            command = [strace, "-f", "-y", "-o", str(log), *DRIVEPANEL]
            with served([*command, "listen", master.path], ready="Listening at") as listening:
                master.start()
                wait_until(lambda: _reads(log, master.path) > 5, "readings of the port")
                _end_traced(listening)
        finally:
            master.stop()
    calls = _calls(log, master.path)
    opened = [line for line in _lines(log) if f'"{master.path}"' in line and "open" in line]
    assert len([line for line in opened if "O_RDONLY" in line and "O_NOCTTY" in line]) == 1
    assert not [line for line in opened if "O_RDWR" in line or "O_WRONLY" in line]
    assert calls >= {"read", "flock", "ioctl TCSETS"}
    allowed = {
        "openat", "read", "flock", "fcntl", "close", "fstat", "newfstatat", "select", "pselect6",
        "ioctl TCGETS", "ioctl TCSETS", "ioctl TIOCGSERIAL", "ioctl TIOCSSERIAL",
    }  # fmt: skip
    assert calls <= allowed


def _end_traced(listening: Served) -> None:
    """Ctrl-C for the traced program, not for strace."""
    children = Path(f"/proc/{listening.process.pid}/task/{listening.process.pid}/children")
    (child,) = children.read_text().split()
    os.kill(int(child), signal.SIGINT)
    listening.process.communicate(timeout=PATIENCE)
    assert listening.process.returncode == 130


def _lines(log: Path) -> list[str]:
    return log.read_text("utf-8", "replace").splitlines()


def _reads(log: Path, path: str) -> int:
    """Readings of the port that brought bytes."""
    pattern = re.compile(rf"read\(\d+<{re.escape(path)}.*= [1-9]\d*$")
    return sum(1 for line in _lines(log) if pattern.search(line))


def _calls(log: Path, path: str) -> set[str]:
    """Calls that name a descriptor of the port; an ioctl with its request."""
    found = set()
    for line in _lines(log):
        match = re.match(r"\d+\s+(\w+)\((.*)", line)
        if match is None or f"<{path}" not in line:
            continue
        name, rest = match.groups()
        # strace may know two names of a number: SNDCTL_TMR_START or TCSETS
        requested = re.match(r"[^,]*, (?:\w+ or )?(\w+)", rest) if name == "ioctl" else None
        found.add(f"ioctl {requested[1]}" if requested else name)
    return found
