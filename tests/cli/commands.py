"""Commands run in this process, and simulated lines that several of them in turn can reach."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

import click
from click.testing import CliRunner, Result

from tests.programs import drivepanel
from tui.cli.command_index import COMMANDS
from tui.cli.commands.simulate import simulate, simulation_of
from tui.cli.main import main
from tui.cli.shared.errors import OWN_ERROR
from tui.cli.shared.registration import RegisteredCommand

from .printed import forms_of


@contextmanager
def tcp_line(*arguments: str) -> Iterator[str]:
    """Serve simulated drives as `drivepanel simulate` does, in this process; return the LINE."""
    # a command keeps the names of its help from its first context
    names = main.context_settings["help_option_names"]
    made = simulate.make_context("simulate", [*arguments], help_option_names=names)
    with made as context:
        places = (
            "pty",
            "serial",
            "tcp",
            "rtu_tcp",
            "script",
            "control",
            "sources",
            "once",
            "about",
            "as_json",
        )
        options = {name: given for name, given in context.params.items() if name not in places}
        with simulation_of(**options) as simulation:
            host, port = simulation.serve_tcp()
            yield f"tcp:{host}:{port}"


def invoked(*arguments: str | Path, typed: str | None = None) -> Result:
    """Run a command in this process, as the program itself would; `typed` is its input."""
    words = [str(argument) for argument in arguments]
    return CliRunner().invoke(main, words, typed, prog_name="drivepanel")


def ended(status: int, *arguments: str | Path) -> Result:
    """Run a command to this exit status, without a traceback.

    Its JSON must fit the schema, and the status must be registered.
    """
    done = invoked(*arguments)
    assert done.exit_code == status, done.output
    if (name := next((str(word) for word in arguments if word in COMMANDS), None)) is not None:
        assert status in statuses_of(name) or status >= OWN_ERROR, f"register {status} of {name}"
    assert "Traceback" not in done.stderr
    if "--json" in arguments and "--help" not in arguments:
        forms_of(done.stdout)
    return done


@lru_cache
def statuses_of(name: str) -> list[int]:
    """The registered exit statuses of a command."""
    command = main.get_command(click.Context(main), name)
    assert isinstance(command, RegisteredCommand)
    return command.all_statuses


def run(status: int, *arguments: str | Path) -> str:
    """Run a command and expect this exit status; return standard output."""
    return ended(status, *arguments).stdout


def refused(status: int, *arguments: str | Path) -> str:
    """Run a command and expect this exit status; return standard error from its first word."""
    output = ended(status, *arguments).stderr
    assert output.startswith("drivepanel: ")
    return output


def put(line: str, address: int, word: int) -> None:
    """Write a word as another source, such as the keypad."""
    pdu = struct.pack(">BHH", 6, address, word)
    assert requested(line, pdu) == pdu


def held(line: str, address: int) -> int:
    """A word as it is on the wire."""
    return int.from_bytes(requested(line, struct.pack(">BHH", 3, address, 1))[2:], "big")


def requested(line: str, pdu: bytes) -> bytes:
    """One Modbus TCP exchange of another master."""
    _, host, port = line.split(":")
    with socket.create_connection((host, int(port)), timeout=30) as other:
        other.sendall(struct.pack(">HHHB", 1, 0, len(pdu) + 1, 1) + pdu)
        return other.recv(300)[7:]


def motor(status: int, *arguments: str) -> str:
    """Run `drivepanel run`; return standard error after a failure, else standard output."""
    done = drivepanel("run", *arguments)
    assert done.returncode == status, done.stderr
    return done.stderr if status else done.stdout
