"""Other people's Modbus masters on our simulated drives: mbpoll and modbus-serial."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.programs import PATIENCE, drivepanel, port_of, simulated

from .conftest import HERE, Peer

STATUS, FREQUENCY, ACCELERATION = 3201, 3202, 9001
SETS = ("--set", "2:ETA=0x0637", "--set", "2:RFR=425", "--set", "2:ACC=57")


@dataclass(frozen=True, slots=True)
class Mbpoll:
    """mbpoll on the drive at address 2."""

    program: str
    place: tuple[str, ...]

    def run(self, address: int, *values: str, count: int = 1) -> subprocess.CompletedProcess[str]:
        """Read this many words, or write the values."""
        options = ["-a", "2", "-0", "-1", "-t", "4", "-r", str(address), "-c", str(count)]
        if values:
            options = options[:-2]
        return subprocess.run(
            [self.program, *options, *self.place, *values],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )

    def words(self, address: int, count: int = 1) -> dict[int, int]:
        """Words that mbpoll read, by address."""
        done = self.run(address, count=count)
        assert done.returncode == 0, done.stdout + done.stderr
        found = re.findall(r"^\[(\d+)\]:\s+(-?\d+)", done.stdout, re.MULTILINE)
        return {int(place): int(word) & 0xFFFF for place, word in found}


@dataclass(frozen=True, slots=True)
class Reached:
    """One simulated drive: as a LINE of ours, and by mbpoll."""

    line: str
    mbpoll: Mbpoll


@pytest.fixture(params=["pty", "tcp"])
def reached(request: pytest.FixtureRequest, peer: Peer, tmp_path: Path) -> Iterator[Reached]:
    """A simulated Altivar 71 at address 2, over a pseudo-terminal and over Modbus TCP."""
    program = peer("mbpoll", "mbpoll")
    if request.param == "pty":
        link = str(tmp_path / "line")
        with simulated("atv71@2", "--pty", link, *SETS):
            serial = Mbpoll(program, ("-m", "rtu", "-b", "19200", "-P", "none", link))
            yield Reached(f"serial:{link}", serial)
    else:
        with simulated("atv71@2", "--tcp", "127.0.0.1:0", *SETS) as simulation:
            port = port_of(simulation.ready)
            network = Mbpoll(program, ("-m", "tcp", "-p", str(port), "127.0.0.1"))
            yield Reached(f"tcp:127.0.0.1:{port}", network)


def ours(line: str, *codes: str) -> dict[str, int | None]:
    """Raw values that `drivepanel read` finds on the same line."""
    done = drivepanel("read", line, *codes, "-d", "2", "--json")
    assert done.returncode == 0, done.stderr
    return {code: value["raw"] for code, value in json.loads(done.stdout)["values"].items()}


def test_mbpoll_reads_values_of_the_drive(reached: Reached) -> None:
    assert reached.mbpoll.words(STATUS, 2) == {STATUS: 0x0637, FREQUENCY: 425}
    assert reached.mbpoll.words(ACCELERATION) == {ACCELERATION: 57}


def test_write_by_mbpoll_is_read_by_both(reached: Reached) -> None:
    assert reached.mbpoll.run(ACCELERATION, "61").returncode == 0
    assert reached.mbpoll.words(ACCELERATION) == {ACCELERATION: 61}
    assert ours(reached.line, "ACC", "ETA", "RFR") == {"ACC": 61, "ETA": 0x0637, "RFR": 425}


def test_mbpoll_writes_two_neighbors_in_one_request(reached: Reached) -> None:
    assert reached.mbpoll.run(ACCELERATION, "62", "63").returncode == 0
    assert ours(reached.line, "ACC", "DEC") == {"ACC": 62, "DEC": 63}


def test_mbpoll_read_of_an_unknown_address_is_refused(reached: Reached) -> None:
    done = reached.mbpoll.run(1)
    assert done.returncode != 0
    assert "Illegal data address" in done.stdout + done.stderr


def test_mbpoll_cannot_write_read_only_parameters(reached: Reached) -> None:
    done = reached.mbpoll.run(STATUS, "5")
    assert done.returncode != 0
    assert "failed" in done.stdout + done.stderr
    assert reached.mbpoll.words(STATUS) == {STATUS: 0x0637}


def test_modbus_serial_writes_and_reads(node: str) -> None:
    with simulated("atv71@2", "--tcp", "127.0.0.1:0", *SETS) as simulation:
        port = port_of(simulation.ready)
        done = subprocess.run(
            [node, str(HERE / "serial_client.js"), str(port), "2", str(ACCELERATION), "64"],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout) == [64, 0x0637, 425]
        assert ours(f"tcp:127.0.0.1:{port}", "ACC") == {"ACC": 64}
