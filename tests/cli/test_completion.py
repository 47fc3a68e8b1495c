"""Shell completion: commands, options, lines, profiles, codes."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from tui.bus.transport.ports import PortInfo
from tui.cli.command_index import COMMANDS
from tui.cli.main import main
from tui.cli.shared.completion import BashByLine
from tui.drive.profile import library

PORTS = [PortInfo("/dev/ttyUSB0", "FTDI"), PortInfo("/dev/ttyUSB1", "CH340")]


@pytest.fixture(autouse=True)
def _ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.bus.transport.ports.list_ports", lambda: PORTS)


def completed(typed: str) -> list[str]:
    """The values for a line that was typed so far, its last word begun."""
    *words, incomplete = typed.split(" ")
    found = ShellComplete(main, {}, "drivepanel", "_X").get_completions(words, incomplete)
    return [item.value for item in found]


def test_commands_are_completed() -> None:
    assert completed("st") == ["status", "stop"]
    assert set(COMMANDS) <= set(completed(""))
    found = ["read", "record", "reference", "replay", "report", "reset", "restore"]
    assert completed("-v re") == found


def test_completion_imports_no_command() -> None:
    # in a program of its own: modules taken out here would be other ones for the tests after it
    program = (
        "import sys; from click.shell_completion import ShellComplete as S;"
        "from tui.cli.main import main;"
        "print([one.value for one in S(main, {}, 'drivepanel', '_X').get_completions([], 'sta')]);"
        "print([one for one in sys.modules if one.startswith('tui.cli.commands.s')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.splitlines() == ["['status']", "[]"]


def test_profiles_are_completed_with_their_names() -> None:
    found = ShellComplete(main, {}, "drivepanel", "_X").get_completions(["status", "-p"], "atv7")
    assert [(item.value, item.help) for item in found] == [("atv71", library.load("atv71").name)]


def test_options_are_completed() -> None:
    assert {"--device", "--profile", "--every", "--csv", "--json"} <= set(completed("watch --"))
    assert {"--read-only", "--low-bandwidth", "--verbose"} <= set(completed("--"))
    assert "--on-hangup" in completed("/dev/ttyUSB0 --")
    assert completed("compare a b --format m") == ["markdown"]


@pytest.mark.parametrize("command", ["", "read ", "status ", "block ", "backup "])
def test_lines_are_completed(command: str) -> None:
    assert completed(f"{command}/dev/") == ["/dev/ttyUSB0", "/dev/ttyUSB1"]
    assert completed(f"{command}tc") == ["tcp:"]
    assert completed(f"{command}sim:atv3") == ["sim:atv31", "sim:atv312", "sim:atv320"]
    assert completed(f"{command}sim:atv71@2,atv31") == ["sim:atv71@2,atv31", "sim:atv71@2,atv312"]


def test_profiles_are_completed() -> None:
    packaged = {item.id for item in (*library.listings(), *library.public_listings())}
    assert set(completed("read /dev/ttyUSB0 -p ")) == packaged
    assert completed("profiles pow") == ["powerdrive"]
    assert completed("simulate pow") == ["powerdrive"]


def test_codes_are_completed() -> None:
    assert completed("read /dev/ttyUSB0 -p atv312 AC") == ["ACC", "AC2"]
    assert completed("watch sim:atv71@2,atv312 -d 1 ac") == ["ACC", "AC2"]
    assert completed("read sim:atv71@2,atv312 -d 2 RFRD") == ["RFRD"]
    assert completed("write sim:atv312 AC") == ["ACC=", "AC2="]
    assert "rFr=" not in completed("write sim:atv312 rF")
    assert completed("read /dev/ttyUSB0 AC") == []  # no drive is identified
    assert completed("read sim:nosuch AC") == []


def test_wrong_word_completes_to_nothing() -> None:
    assert completed("sttaus x") == []
    assert completed("block /dev/ttyUSB0 ver") == ["verify"]
    assert completed("compare fac") == ["factory"]


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize(
    ("typed", "replies"),
    [
        ("drivepanel stat", "status"),
        ("drivepanel read sim:atv3", "atv31 atv312 atv320"),  # bash's word begins behind the colon
        ("drivepanel read sim:atv71@2,pow", "@2,powerdrive"),  # and with the @
        ("drivepanel read sim:atv71@2,atv312 -d 1 AC", "ACC AC2"),
        ("drivepanel write sim:atv312 ACC", "ACC="),
    ],
)
@pytest.mark.sweep
def test_bash_completes_commands_and_lines(typed: str, replies: str, tmp_path: Path) -> None:
    program = tmp_path / "drivepanel"
    program.write_text(f'#!/bin/bash\nexec {shlex.quote(sys.executable)} -m tui "$@"\n')
    program.chmod(0o755)
    script = f"""
        compopt() {{ :; }}
        eval "$(_DRIVEPANEL_COMPLETE=bash_source drivepanel)"
        COMP_LINE={shlex.quote(typed)}; COMP_POINT=${{#COMP_LINE}}
        _drivepanel_completion drivepanel
        echo "${{COMPREPLY[*]}}"
    """
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, env=environment, check=False
    )
    assert (done.stdout.strip(), done.stderr) == (replies, "")


def test_bash_without_a_cursor_position_completes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COMP_LINE", "drivepanel st")
    monkeypatch.setenv("COMP_POINT", "")
    assert BashByLine(main, {}, "drivepanel", "_X").get_completion_args() == ([], "st")
