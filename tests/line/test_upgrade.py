"""Programs and keepers whose package is removed, or replaced by another version, while they run."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.programs import drivepanel, keepers, wait_until
from tests.sources import ROOT
from tui.bus.share.beside import GIVEN
from tui.cli.shared.errors import LINE_TROUBLE
from tui.session.connect.share_place import owners

from .test_commands import bench, turns
from .test_keeper import keeper, read
from .test_shared_programs import motor_run, stopped_by_commands


@pytest.fixture
def programs() -> Iterator[ExitStack]:
    """Programs that end with the test."""
    with ExitStack() as stack:
        yield stack


class Package:
    """The package from which programs are started, in a folder of the test."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.install()

    def install(self, more: int = 0) -> None:
        """Put it there; `more` is added to the version of its messages."""
        shutil.rmtree(self._folder, ignore_errors=True)
        for name in ("tui", "profiles"):
            shutil.copytree(ROOT / name, self._folder / name)
        file = self._folder / "tui/bus/share/messages.py"
        text, count = re.subn(
            r"(?m)^VERSION = (\d+)$",
            lambda found: f"VERSION = {int(found[1]) + more}",
            file.read_text("utf-8"),
        )
        assert count == 1
        file.write_text(text, "utf-8")

    def remove(self) -> None:
        """Leave nothing that can be used, and no other package in its place."""
        shutil.rmtree(self._folder)
        (self._folder / "tui").mkdir(parents=True)
        (self._folder / "tui/__init__.py").touch()


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Package:
    """The package of all programs that are started from here on."""
    monkeypatch.setenv("PYTHONSAFEPATH", "1")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "package"))
    return Package(tmp_path / "package")


def holders() -> set[str]:
    """The names of the programs that hold lines."""
    return {owner.program.name for owner in owners()}


@pytest.mark.parametrize("more", [None, 1])
def test_motor_runs_on_when_keeper_dies_after_its_package_changed(
    programs: ExitStack, package: Package, more: int | None
) -> None:
    with motor_run(programs, "run") as (simulation, _, runner, _):
        package.remove()
        if more is not None:
            package.install(more)
        os.kill(keeper(), signal.SIGKILL)
        inside = {"run", "watch"}
        wait_until(lambda: bool(holders() & inside), "a program holds the line itself", 20.0)
        assert turns(simulation)
        assert simulation.drive(1).fault is None
        status, errors = runner.end(signal.SIGINT)
        assert status == 0, errors
        assert stopped_by_commands(simulation)


@pytest.fixture
def next_version(package: Package, monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Programs have another version until this is called, and that of the checkout after it."""
    package.install(1)

    def upgrade() -> None:
        monkeypatch.delenv("PYTHONPATH")
        monkeypatch.delenv("PYTHONSAFEPATH")

    return upgrade


def test_stop_reaches_keeper_of_another_version(
    programs: ExitStack, next_version: Callable[[], None]
) -> None:
    with motor_run(programs, "run") as (simulation, line, _, _):
        next_version()
        done = drivepanel("stop", line, "-d", "1", "-p", "atv71")
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
        assert "in another version of Drive Panel" in done.stderr


def test_keeper_of_another_version_is_named_while_it_serves(
    programs: ExitStack, next_version: Callable[[], None]
) -> None:
    with motor_run(programs, "run") as (simulation, line, _, _):
        pid = keeper()
        next_version()
        done = read(line)
        assert done.returncode == LINE_TROUBLE
        assert f"keeper (pid {pid}) owns the line, in another version" in done.stderr
        assert keepers() == [pid]
        assert turns(simulation)


def test_idle_keeper_of_another_version_is_replaced(
    next_version: Callable[[], None],
) -> None:
    with bench() as (_, line):
        assert read(line).returncode == 0
        pid = keeper()
        next_version()
        assert read(line).returncode == 0
        assert keeper() != pid


def test_keeper_without_its_package_stops_the_motor_of_a_killed_program(
    programs: ExitStack, package: Package
) -> None:
    with motor_run(programs, "run") as (simulation, _, runner, _):
        package.remove()
        runner.process.kill()
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")


def test_keeper_without_its_package_carries_out_a_plain_stop(
    programs: ExitStack, package: Package
) -> None:
    with motor_run(programs, "run") as (simulation, _, _, _):
        package.remove()
        (holder,) = owners()
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(holder.socket)
            connection.sendall(b"STOP 1\n")
            assert connection.recv(100) == GIVEN
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops")
