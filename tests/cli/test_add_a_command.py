"""CONTRIBUTING, "Add a command", done in a copy of the project with the example printed there."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SECTION = "\n## clock\n\n```sh\ndrivepanel clock\n```\n"


def example() -> str:
    """The module that CONTRIBUTING shows."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    chapter = text.partition("## Add a command\n")[2].partition("\n## ")[0]
    (found,) = EXAMPLE.findall(chapter)
    return str(found)


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project with one more module, after the command that CONTRIBUTING names."""
    there = tmp_path_factory.mktemp("project")
    for folder in ("tui", "docs", "profiles"):
        shutil.copytree(
            ROOT / folder, there / folder, ignore=shutil.ignore_patterns("__pycache__", "*.svg")
        )
    (there / "tui" / "cli" / "commands" / "clock.py").write_text(example(), "utf-8")
    page = there / "docs" / "cli.md"
    page.write_text(page.read_text("utf-8") + SECTION, "utf-8")
    done = run(there, "-m", "tui.cli.derived")
    assert done.returncode == 0, done.stderr
    return there


def run(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run Python in a folder whose package overrides the installed one."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder, env={**os.environ, **variables}, capture_output=True, text=True,
        timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.sweep
def test_added_command_runs_and_prints_its_document(copy: Path) -> None:
    done = run(copy, "-m", "tui", "clock", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert list(json.loads(done.stdout)) == ["schema", "command", "time"]
    assert run(copy, "-m", "tui", "clock").stdout.startswith("20")
    refused = run(copy, "-m", "tui", "clock", "--nosuch")
    assert refused.returncode == 2
    assert "No such option" in refused.stderr


def test_added_command_is_in_help_completion_page_manual_and_schema(copy: Path) -> None:
    summary = "Show the time of this computer."
    assert re.search(rf"^  clock +{summary}$", run(copy, "-m", "tui", "--help").stdout, re.M)
    typed = {"_DRIVEPANEL_COMPLETE": "bash_complete", "COMP_LINE": "drivepanel cl"}
    assert "plain,clock" in run(copy, "-m", "tui", **typed, COMP_POINT="13").stdout
    page = (copy / "docs" / "cli.md").read_text("utf-8")
    assert f"| [clock](#clock) | {summary} | 0, 2 | `ClockDocument` |" in page
    assert ".SS clock\n" in (copy / "docs" / "drivepanel.1").read_text("utf-8")
    schema = json.loads((copy / "docs" / "cli.schema.json").read_text("utf-8"))
    assert schema["$defs"]["ClockDocument"]["required"] == ["schema", "command", "time"]


def test_nothing_else_changes(copy: Path) -> None:
    added = run(copy, "-c", "import tui; print(tui.__file__)").stdout.strip()
    assert Path(added).is_relative_to(copy), "the copy was tested, not the project"
    for name in ("docs/drivepanel.1", "docs/cli.md", "docs/cli.schema.json",
                 "tui/cli/command_index.py"):  # fmt: skip
        before = (ROOT / name).read_text("utf-8").splitlines()
        after = (copy / name).read_text("utf-8").splitlines()
        assert [line for line in before if line not in after] == [], name
