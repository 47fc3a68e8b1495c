"""A screen is added with one package and one line, as CONTRIBUTING.md describes."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.programs import PATIENCE
from tests.sources import ROOT

MODULES = ("registration", "view", "screen")
"""The code blocks of the section, in their order."""
LAST_PACKAGE = '    "wiring",\n'

LOOK = """
import asyncio, json, time
from tui.app import DrivePanelApp
from tui.screens.keys.finding import find
from tui.screens.keys.help import help_lines
from tui.widgets.lines import Lines


def text(app, part):
    found = app.screen.query(f"#{part}").results(Lines)
    return chr(10).join(line.plain for lines in found for line in lines.lines)


async def until(pilot, holds):
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end, text(pilot.app, "current")
        await pilot.pause(0.05)


async def main():
    app = DrivePanelApp(start="sim:atv71@1", device=1)
    async with app.run_test(size=(120, 40)) as pilot:
        await until(pilot, lambda: app.chosen is not None and app.chosen.latest is not None)
        await pilot.press("0")
        await until(pilot, lambda: app.place == "load")
        await until(pilot, lambda: text(app, "current").strip().endswith(" A"))
        seen = {"current": text(app, "current"), "tabs": text(app, "tabs")}
        seen["keys"] = text(app, "keys")
        app.chosen.monitor.stop()
        await until(pilot, lambda: "old" in text(app, "current"))
        seen["old"] = text(app, "current")
        await pilot.press("escape")
        await until(pilot, lambda: app.place == "monitor")
    seen["help"] = chr(10).join(line.plain for line in help_lines("load", 80))
    seen["palette"] = [found.action.id for found in find("load", "monitor")]
    print(json.dumps(seen))


asyncio.run(main())
"""


def section() -> str:
    """The section of CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    return text.partition("## Add a screen\n")[2].partition("\n## ")[0]


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project with the screen of the section."""
    copy: Path = tmp_path_factory.mktemp("project")
    skipped = shutil.ignore_patterns("__pycache__")
    for part in ("tui", "profiles", "docs/screens"):
        shutil.copytree(ROOT / part, copy / part, ignore=skipped)
    package = copy / "tui" / "screens" / "load"
    package.mkdir()
    (package / "__init__.py").touch()
    blocks = re.findall(r"^```python\n(.*?)^```$", section(), re.M | re.S)
    for name, block in zip(MODULES, blocks, strict=True):
        (package / f"{name}.py").write_text(block, "utf-8")
    screens = copy / "tui" / "screens" / "keys" / "table.py"
    listed = screens.read_text("utf-8")
    assert listed.count(LAST_PACKAGE) == 1
    screens.write_text(listed.replace(LAST_PACKAGE, f'{LAST_PACKAGE}    "load",\n'), "utf-8")
    page = copy / "docs" / "screens" / "load.md"
    page.write_text("# Load\n\n<!-- keys of load -->\n<!-- end of keys -->\n", "utf-8")
    return copy


def run(copy: Path, *arguments: str) -> str:
    """Run Python on the copy, and return its output."""
    state = {"DRIVEPANEL_STATE": str(copy / "state"), "DRIVEPANEL_CONFIG": str(copy / "config")}
    done = subprocess.run(
        (sys.executable, *arguments),
        cwd=copy, env={**os.environ, **state, "PYTHONPATH": str(copy)},
        capture_output=True, text=True, timeout=PATIENCE * 5, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.sweep
def test_added_screen_opens_by_its_digit_and_is_listed(copy: Path) -> None:
    import json

    seen = json.loads(run(copy, "-c", LOOK).splitlines()[-1])
    assert re.fullmatch(r" +\d+\.\d+ A", seen["current"])
    assert re.fullmatch(r" +\d+\.\d+ A, \d+s old", seen["old"])
    assert " 0 Load" in seen["tabs"]
    assert "Esc back" in seen["keys"]
    assert "Keys on Load" in seen["help"]
    assert "Go back to Monitor." in seen["help"]
    assert "Go to Load." in seen["help"]
    assert seen["palette"][0] == "goto('load')"


def test_added_screen_is_in_the_tables_of_the_docs(copy: Path) -> None:
    run(copy, "-m", "tui.screens.keys.pages", "docs/screens")
    index = (copy / "docs" / "screens" / "README.md").read_text("utf-8")
    assert "| 0 | [Load](load.md) | the motor current |" in index
    assert "| 0 or à | Go to Load. |" in index
    assert "| Esc | Go back to Monitor. |" in (copy / "docs/screens/load.md").read_text("utf-8")


@pytest.mark.sweep
def test_added_screen_has_the_right_types(copy: Path) -> None:
    """The copied package alone is checked: the rest is the project of this folder."""
    files = [str(path) for path in (copy / "tui" / "screens" / "load").glob("*.py")]
    settings = "[mypy]\nstrict = True\npython_version = 3.11\nfollow_imports = silent\n"
    (copy / "mypy.ini").write_text(settings, "utf-8")
    assert "Success" in run(copy, "-m", "mypy", "--config-file", "mypy.ini", *files)
