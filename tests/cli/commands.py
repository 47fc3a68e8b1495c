"""Commands run in this process, and simulated lines that several of them in turn can reach."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from click.testing import CliRunner, Result

from tests.programs import port_of, simulated
from tui.cli.main import main


@contextmanager
def tcp_line(*arguments: str) -> Iterator[str]:
    """`drivepanel simulate` at work with these arguments; the LINE to its drives."""
    with simulated(*arguments, "--tcp", "127.0.0.1:0") as simulation:
        yield f"tcp:127.0.0.1:{port_of(simulation.ready)}"


def invoked(*arguments: str | Path) -> Result:
    """A command run in this process, as the program itself would run it."""
    return CliRunner().invoke(main, [str(a) for a in arguments], prog_name="drivepanel")


def ended(status: int, *arguments: str | Path) -> Result:
    """Run a command to this exit status, without a traceback."""
    done = invoked(*arguments)
    assert done.exit_code == status, done.output
    assert "Traceback" not in done.stderr
    return done


def run(status: int, *arguments: str | Path) -> str:
    """Run a command to this exit status; what it prints on standard output."""
    return ended(status, *arguments).stdout


def refused(status: int, *arguments: str | Path) -> str:
    """What a command says on standard error, from its first word, when it ends with this status."""
    said = ended(status, *arguments).stderr
    assert said.startswith("drivepanel: ")
    return said
