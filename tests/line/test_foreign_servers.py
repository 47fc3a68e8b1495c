"""`drivepanel read` on other people's Modbus servers: libmodbus, modbus-tk, modbus-serial.

Each holds the same words of an Altivar 71 at address 2. None of them knows function 43,
so the profile is named.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.programs import drivepanel, free_port, port_of, pty_pair, served

from .conftest import HERE

TK_SERVER = (sys.executable, "-W", "ignore", str(HERE / "tk_server.py"))


@pytest.fixture(params=["tcp", "rtu"])
def libmodbus_line(request: pytest.FixtureRequest, libmodbus_server: Path) -> Iterator[str]:
    """A LINE with the libmodbus server at its end."""
    if request.param == "tcp":
        with served([str(libmodbus_server), "tcp"], ready="ready") as server:
            yield f"tcp:127.0.0.1:{port_of(server.ready)}"
    else:
        with pty_pair() as (near, far), served([str(libmodbus_server), "rtu", far], ready="ready"):
            yield f"serial:{near},19200,8N1"


@pytest.fixture(params=["tcp", "rtu"])
def tk_line(request: pytest.FixtureRequest) -> Iterator[str]:
    """A LINE with the modbus-tk server at its end."""
    if request.param == "tcp":
        with served([*TK_SERVER, "tcp"], ready="ready") as server:
            yield f"tcp:127.0.0.1:{port_of(server.ready)}"
    else:
        with pty_pair() as (near, far), served([*TK_SERVER, "rtu", far], ready="ready"):
            yield f"serial:{near},19200,8N1"


def expect_the_three_words(line: str) -> None:
    done = drivepanel("read", line, "ETA", "RFR", "ACC", "-d", "2", "-p", "atv71", "--json")
    assert done.returncode == 0, done.stderr
    read = json.loads(done.stdout)
    assert (read["line"], read["device"], read["profile"]) == (line, 2, "atv71")
    shown = {code: (item["raw"], item["value"]) for code, item in read["values"].items()}
    assert shown == {"ETA": (0x0637, 0x0637), "RFR": (425, 42.5), "ACC": (57, 5.7)}
    assert {item["quality"] for item in read["values"].values()} == {"good"}


def test_libmodbus_server_is_read(libmodbus_line: str) -> None:
    expect_the_three_words(libmodbus_line)


def test_modbus_tk_server_is_read(tk_line: str) -> None:
    expect_the_three_words(tk_line)


def test_modbus_serial_server_is_read(node: str) -> None:
    command = [node, str(HERE / "serial_server.js"), str(free_port())]
    with served(command, ready="ready") as server:
        expect_the_three_words(f"tcp:127.0.0.1:{port_of(server.ready)}")


def test_server_without_function_43_gets_advice_on_what_to_type(libmodbus_line: str) -> None:
    done = drivepanel("read", libmodbus_line, "ETA", "-d", "2", "--json")
    assert (done.returncode, json.loads(done.stdout)["status"]) == (2, 2)
    assert "-p" in done.stderr


def test_unused_address_is_reported(tk_line: str) -> None:
    done = drivepanel("read", tk_line, "ETA", "-d", "9", "-p", "atv71", "--json")
    assert done.returncode in (3, 4), done.stderr  # over TCP a gateway may refuse in its name
    assert done.stderr.startswith("drivepanel: ")
