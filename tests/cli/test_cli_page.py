"""Every command of docs/cli.md and docs/tour.md, run as it is printed there."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from tests.programs import DRIVEPANEL, drivepanel, served
from tests.sweeps import kept
from tui.cli.command_index import COMMANDS
from tui.cli.plant.metrics import METRICS

from .commands import ended

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "cli.md"
BLOCK = re.compile(r"^```sh\n(.*?)^```$", re.MULTILINE | re.DOTALL)
STATUS = re.compile(r"(\d+):")
PANEL = ("demo", "sim:atv71")


def sections(page: Path = PAGE) -> dict[str, str]:
    """The text of each section of a page, by its head."""
    parts = re.split(r"^## (.+)$", page.read_text("utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def printed(text: str) -> list[tuple[str, int]]:
    """Each command of a text with the status that it ends with."""
    found = []
    for line in (line for block in BLOCK.findall(text) for line in block.splitlines()):
        typed, _, remark = line.partition("  # ")
        status = STATUS.match(remark)
        found.append((typed, int(status[1]) if status else 0))
    return found


def commands_of(text: str) -> list[str]:
    """The names of the commands of a text."""
    return [word for line, _ in printed(text) for word in shlex.split(line)[1:2]]


EXAMPLES = {
    f"{page.stem}: {head}": text
    for page in (PAGE, DOCS / "tour.md")
    for head, text in sections(page).items()
    if printed(text)
}


LONG = {
    "run", "hold", "simulate", "serve", "prove", "listen", "scan", "backup", "bundle", "restore",
    "why", "publish", "counters", "status", "watch",
}  # fmt: skip
"""Slow commands with their own tests: their examples are for the sweeps."""
SHORT = [text for text in EXAMPLES.values() if not LONG & {*commands_of(text)}]


@pytest.mark.parametrize("text", kept(EXAMPLES.values(), *SHORT), ids=EXAMPLES.keys())
@pytest.mark.sweep
def test_commands_of_a_section_run_as_printed(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for line, status in printed(text):
        name, *words = shlex.split(line)
        assert name == "drivepanel"
        if words[:1] == ["run"]:
            assert drivepanel(*words).returncode == status, line
        elif words[:1] == ["hold"]:
            with served([*DRIVEPANEL, *words], ready="Device 1"):
                pass
        elif words[:1] in (["simulate"], ["serve"], ["publish"]):
            with served([*DRIVEPANEL, *words], ready="Ready"):
                pass
        elif not words or words[0] in PANEL:
            assert "needs a terminal" in ended(2, *words).stderr
        else:
            shutil.copy(DOCS / "acceptance" / "atv312.toml", tmp_path)
            shutil.copy(DOCS / "plan" / "hall-2.toml", tmp_path)
            (tmp_path / "profiles").mkdir(exist_ok=True)
            shutil.copy(DOCS.parent / "profiles" / "atv312.toml", tmp_path / "profiles")
            with monkeypatch.context() as there:
                there.chdir(tmp_path)  # separate programs run in the checkout
                assert ended(status, *words).exit_code == status, line


def test_every_command_is_printed_in_its_own_section() -> None:
    for head, text in sections().items():
        named = set(head.split(", ")) & set(COMMANDS)
        assert named <= set(commands_of(text)), head


def test_every_command_has_a_section() -> None:
    named = {name for head in sections() for name in head.split(", ")}
    assert set(COMMANDS) - {"demo"} <= named
    assert set(COMMANDS) <= set(commands_of(PAGE.read_text("utf-8")))


def test_every_option_is_in_the_help_of_its_command() -> None:
    for line, _ in printed(PAGE.read_text("utf-8")):
        words = shlex.split(line)[1:]
        if words and words[0] in COMMANDS:
            reported = ended(0, words[0], "--help").stdout
            for word in words:
                if word.startswith("--"):
                    assert word in reported, line


def test_every_metric_is_on_the_plant_page() -> None:
    page = (DOCS / "plant.md").read_text("utf-8")
    for name in METRICS:
        assert f"`drivepanel_{name}`" in page, name
