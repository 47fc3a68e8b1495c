"""Peers for the tests of a whole line: programs that the project did not write."""

from __future__ import annotations

import os
import shlex
import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.conftest import need_peer
from tests.programs import PATIENCE
from tui.bus.share.keeping import NO_KEEPER

from .pty_panel import PtyPanel, panel_on_a_pty
from .terminal import Terminal

HERE = Path(__file__).parent
Peer = Callable[[str, str], str]


def _built(source: str, folder: Path) -> Path | str:
    """A compiled server on libmodbus, or the reason why it is missing."""
    target = folder / Path(source).stem
    try:
        flags = subprocess.run(
            ["pkg-config", "--cflags", "--libs", "libmodbus"],
            capture_output=True,
            text=True,
            check=True,
            timeout=PATIENCE,
        ).stdout.split()
    except (OSError, subprocess.CalledProcessError):
        return "libmodbus is not here; it comes with the packages libmodbus-dev and pkg-config."
    command = ["gcc", "-Wall", "-Wextra", "-Werror", "-o", str(target), str(HERE / source), *flags]
    try:
        built = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    except FileNotFoundError:
        return "gcc is not here; it comes with the package gcc."
    assert built.returncode == 0, built.stderr
    return target


@pytest.fixture(params=["keeper", "inside"])
def holder(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """A keeper holds the line, or the program that opens it first."""
    if request.param == "inside":
        monkeypatch.setenv(NO_KEEPER, "1")
    return str(request.param)


@pytest.fixture
def held_inside(monkeypatch: pytest.MonkeyPatch) -> None:
    """The program that opens a line first holds it, as if no keeper can be started."""
    monkeypatch.setenv(NO_KEEPER, "1")


@pytest.fixture
def with_keepers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines that the test itself opens have keepers, too."""
    monkeypatch.setattr("tui.bus.share.keeping.can_start", lambda: True)


@pytest.fixture(scope="session")
def built_server(tmp_path_factory: pytest.TempPathFactory) -> Path | str:
    """The server on libmodbus, or why it is missing."""
    return _built("modbus_server.c", tmp_path_factory.mktemp("libmodbus"))


@pytest.fixture(scope="session")
def built_drive(tmp_path_factory: pytest.TempPathFactory) -> Path | str:
    """The drive with unusual behavior, or why it is missing."""
    return _built("awkward_drive.c", tmp_path_factory.mktemp("libmodbus"))


@pytest.fixture
def libmodbus_server(built_server: Path | str) -> Path:
    """The server on libmodbus; skips if it cannot be built."""
    if isinstance(built_server, str):
        need_peer(built_server)
    return Path(built_server)


@pytest.fixture
def awkward_drive(built_drive: Path | str) -> Path:
    """The drive with unusual behavior; skips if it cannot be built."""
    if isinstance(built_drive, str):
        need_peer(built_drive)
    return Path(built_drive)


@pytest.fixture
def node(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> str:
    """Node.js with modbus-serial from `DRIVEPANEL_NODE_MODULES`."""
    program = peer("node", "nodejs")
    modules = os.environ.get("DRIVEPANEL_NODE_MODULES", "")
    if not modules or not Path(modules, "modbus-serial").is_dir():
        need_peer(
            "modbus-serial is not here; install it with npm and name its node_modules folder "
            "in DRIVEPANEL_NODE_MODULES."
        )
    monkeypatch.setenv("NODE_PATH", modules)
    return program


@pytest.fixture(scope="module")
def panel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PtyPanel]:
    """A panel on Monitor for several tests; each leaves it on Monitor, its motor at rest."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("HOME", "DRIVEPANEL_CONFIG", "DRIVEPANEL_STATE"):
            patch.setenv(name, str(tmp_path_factory.mktemp(name.lower())))
        with panel_on_a_pty() as made:
            yield made


@pytest.fixture
def fresh_panel() -> Iterator[PtyPanel]:
    """A panel on Monitor, for one test."""
    with panel_on_a_pty() as made:
        yield made


@pytest.fixture
def terminal_with(peer: Peer, tmp_path: Path) -> Iterator[Callable[[list[str]], Terminal]]:
    """Opens a terminal in which a command runs."""
    yield from _terminals(peer("tmux", "tmux"), tmp_path / "tmux")


@pytest.fixture
def second_terminal(peer: Peer, tmp_path: Path) -> Iterator[Callable[[list[str]], Terminal]]:
    """A second terminal."""
    yield from _terminals(peer("tmux", "tmux"), tmp_path / "tmux2")


def _terminals(program: str, socket: Path) -> Iterator[Callable[[list[str]], Terminal]]:
    tmux = (program, "-S", str(socket), "-f", os.devnull)
    started: list[Terminal] = []

    def start(command: list[str]) -> Terminal:
        terminal = Terminal(tmux)
        started.append(terminal)
        # the output stays readable if the program ends immediately
        terminal.run(
            *("new-session", "-d", "-x", "80", "-y", "24", f"exec {shlex.join(command)}"),
            *(";", "set-option", "-g", "remain-on-exit", "on"),
        )
        return terminal

    yield start
    for terminal in started:
        with suppress(subprocess.CalledProcessError):
            terminal.run("kill-server")
