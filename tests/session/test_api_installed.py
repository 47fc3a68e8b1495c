"""The scripts of docs/api.md with the installed package: checked by mypy, and run."""

from __future__ import annotations

import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path
from sysconfig import get_path

import pytest

from tests.programs import PATIENCE
from tests.sources import ROOT
from tests.sweeps import kept
from tests.test_packages import build

PAGE = ROOT / "docs" / "api.md"
EXAMPLES = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
WRONG = """
from tui.session.api import open_drives

with open_drives("sim:atv71") as line:
    line.drive("1")
    print(line.drive().read("HSP")["HSP"].numbr)
    for sample in line.drive().watch("RFR"):
        sample.state.total_seconds()
"""


@pytest.fixture(scope="module")
def user(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user folder with the wheel in its own environment, and the scripts of the page."""
    folder = tmp_path_factory.mktemp("user")
    venv.create(folder / "venv")
    site = Path(get_path("purelib", vars={"base": str(folder / "venv")}))
    with zipfile.ZipFile(build("build_wheel", folder)) as packed:
        packed.extractall(site)
    # what the wheel needs is installed beside these tests; the project itself is not taken there
    (site / "dependencies.pth").write_text(get_path("purelib"), "utf-8")
    for number, example in enumerate(EXAMPLES):
        (folder / f"script_{number}.py").write_text(example, "utf-8")
    (folder / "wrong.py").write_text(WRONG, "utf-8")
    return folder


def run(user: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, cwd=user, capture_output=True, text=True, timeout=PATIENCE * 2, check=False
    )


def python(user: Path) -> str:
    return str(user / "venv" / "bin" / "python")


def checked(user: Path, *scripts: str) -> subprocess.CompletedProcess[str]:
    strict = (sys.executable, "-m", "mypy", "--strict", "--python-executable", python(user))
    return run(user, *strict, "--cache-dir", str(user / "cache"), *scripts)


@pytest.mark.sweep
def test_scripts_of_the_page_pass_strict_mypy(user: Path) -> None:
    done = checked(user, *(f"script_{number}.py" for number in range(len(EXAMPLES))))
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"no issues found in {len(EXAMPLES)} source files" in done.stdout


@pytest.mark.sweep
def test_mypy_finds_wrong_uses_of_the_api(user: Path) -> None:
    done = checked(user, "wrong.py")
    assert re.findall(r"^wrong\.py:(\d+): error: .*\[(.+)\]$", done.stdout, re.M) == [
        ("5", "arg-type"),
        ("6", "attr-defined"),
        ("8", "attr-defined"),
    ], done.stdout


@pytest.mark.parametrize("number", kept(range(len(EXAMPLES)), 0, 4))
@pytest.mark.sweep
def test_script_of_the_page_runs_with_the_installed_package(user: Path, number: int) -> None:
    done = run(user, python(user), f"script_{number}.py")
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert not done.stderr


def test_installed_package_is_the_one_checked(user: Path) -> None:
    done = run(user, python(user), "-c", "import tui; print(tui.__file__)")
    assert Path(done.stdout.strip()).is_relative_to(user), done.stderr
