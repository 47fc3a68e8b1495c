"""Every command of docs/cli.md, run as it is printed there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.programs import DRIVEPANEL, drivepanel, served
from tui.cli.main import COMMANDS

from .commands import ended

PAGE = Path(__file__).resolve().parents[2] / "docs" / "cli.md"
BLOCK = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
STATUS = re.compile(r"(\d+):")
PANEL = ("demo", "sim:atv71")


def printed() -> list[tuple[str, int]]:
    """Each command with the status that it ends with."""
    blocks = BLOCK.findall(PAGE.read_text("utf-8"))
    found = []
    for line in (line for block in blocks for line in block.splitlines()):
        typed, _, remark = line.partition("  # ")
        status = STATUS.match(remark)
        found.append((typed, int(status[1]) if status else 0))
    return found


def test_the_commands_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = []
    for line, status in printed():
        name, *words = shlex.split(line)
        assert name == "drivepanel"
        if words[:1] == ["run"]:
            assert drivepanel(*words).returncode == status, line
        elif words[:1] == ["hold"]:
            with served([*DRIVEPANEL, *words], ready="Device 1"):
                pass
        elif words[:1] == ["simulate"]:
            with served([*DRIVEPANEL, *words], ready="Ready"):
                pass
        elif not words or words[0] in PANEL:
            assert "needs a terminal" in ended(2, *words).stderr
        else:
            with monkeypatch.context() as there:
                there.chdir(tmp_path)  # programs of their own are run where the checkout is
                assert ended(status, *words).exit_code == status, line
        run += words[:1]
    assert set(COMMANDS) <= set(run)


def test_every_command_has_a_section() -> None:
    heads = re.findall(r"^## (.+)$", PAGE.read_text("utf-8"), re.MULTILINE)
    named = {name for head in heads for name in head.split(", ")}
    assert set(COMMANDS) - {"demo"} <= named


def test_every_option_is_in_the_help_of_its_command() -> None:
    for line, _ in printed():
        words = shlex.split(line)[1:]
        if words and words[0] in COMMANDS:
            told = ended(0, words[0], "--help").stdout
            for word in words:
                if word.startswith("--"):
                    assert word in told, line
