"""Nothing old is shown as current: a screen that draws a value without its age has a wrong type."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.programs import PATIENCE
from tests.sources import ROOT

SCREEN = """
from rich.text import Text

from tui.screens.monitor.view import View
from tui.session.console import DriveConsole
from tui.session.settings.editor import Editor
from tui.session.shown import Shown


def drawn(view: View, console: DriveConsole, editor: Editor, values: dict[str, Shown]) -> Text:
    value = view.reading("RFR") or values["RFR"]
    latest = console.monitor.latest
    held = editor.values.held("ACC")
    assert latest is not None and held is not None
    return Text({expression})


async def read(console: DriveConsole) -> Text:
    return Text((await console.read(["RFR"]))["RFR"].text)
"""
WITH_AGE = (
    'value.drawn(view.now, current=lambda held: held.text, old=lambda held, age: f"{age}", '
    'missing="")'
)
BARE = (
    "held.text",
    "held.value.text",
    "editor.values.held('ACC').text",
    "held.drawn(view.now, current=lambda value: value.text, missing='')",
    "value.text",
    "value.value.text",
    "str(value.number)",
    "value.unit",
    "latest.readings['RFR'].text",
    "console.latest.readings['RFR'].value.text",
    "value.drawn(view.now, current=lambda held: held.text, missing='')",
    "value.drawn(view.now, current=lambda held: held.text, old=lambda held: held.text, missing='')",
)


@pytest.fixture(scope="module")
def errors(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Errors that strict mypy finds in a screen, by the expression that it draws."""
    folder: Path = tmp_path_factory.mktemp("screens")
    files = {}
    for at, expression in enumerate((WITH_AGE, *BARE)):
        files[expression] = folder / f"screen{at}.py"
        files[expression].write_text(SCREEN.format(expression=expression), "utf-8")
    done = subprocess.run(
        (sys.executable, "-m", "mypy", "--config-file", "pyproject.toml", *files.values()),
        cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE * 5, check=False,
    )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if ": error:" in line]
    return {
        expression: "\n".join(line for line in lines if path.name in line)
        for expression, path in files.items()
    }


def test_value_drawn_with_its_age_type_checks(errors: dict[str, str]) -> None:
    found = errors[WITH_AGE].splitlines()
    assert len(found) == 1
    assert '"Shown" has no attribute "text"' in found[0]  # that of `read`, in every screen


@pytest.mark.parametrize("expression", BARE)
def test_value_drawn_without_its_age_does_not_type_check(
    expression: str, errors: dict[str, str]
) -> None:
    assert len(errors[expression].splitlines()) > 1
