"""Packages: complete, described correctly, and readable on a package page."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
from email.message import Message
from email.parser import Parser
from pathlib import Path

import click
import pytest

from hatch_build import addresses, as_on_a_package_page
from tui.cli.derived import _paragraphs, _text, man_page
from tui.cli.main import main

from .programs import PATIENCE

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text("utf-8")
ADDRESS = "https://code.example/drives/panel"
PAGE = ROOT / "docs" / "drivepanel.1"


def build(what: str, where: Path, root: Path = ROOT) -> Path:
    """Build with the project's own backend; return the package."""
    call = f"import sys; from hatchling.build import {what} as b; print(b(sys.argv[1]))"
    done = subprocess.run(
        [sys.executable, "-c", call, str(where)],
        cwd=root, capture_output=True, text=True, timeout=PATIENCE * 5, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return where / done.stdout.split()[-1]


def metadata(folder: Path, address: str = "") -> Message:
    """Return the metadata of a package, with this address in its configuration."""
    root = folder / "root"
    root.mkdir()
    (root / "tui").mkdir()
    for name in ("README.md", "LICENSE", "hatch_build.py", "tui/__init__.py"):
        shutil.copy(ROOT / name, root / name)
    settings = (ROOT / "pyproject.toml").read_text("utf-8")
    assert settings.count('\naddress = ""\n') == 1
    settings = settings.replace('\naddress = ""\n', f'\naddress = "{address}"\n')
    (root / "pyproject.toml").write_text(settings, "utf-8")
    info = build("prepare_metadata_for_build_wheel", folder, root)
    return Parser().parsestr((info / "METADATA").read_text("utf-8"))


# The page of a package


def test_package_page_has_no_broken_picture_or_link(tmp_path: Path) -> None:
    reported = metadata(tmp_path)
    page = reported.get_payload()
    assert isinstance(page, str)
    assert "# Drive Panel" in page
    assert re.findall(r"\]\((?!https://)[^)]*\)", page) == []
    assert "![" not in page
    assert reported.get_all("Project-URL") is None


def test_pictures_and_links_point_to_their_version(tmp_path: Path) -> None:
    reported = metadata(tmp_path, ADDRESS)
    page = reported.get_payload()
    assert isinstance(page, str)
    version = reported["Version"]
    assert f"]({ADDRESS}/raw/v{version}/screenshots/monitor-80x24.svg)" in page
    assert f"]({ADDRESS}/blob/v{version}/docs/lines.md)" in page
    led = re.findall(r"\]\(([^)]*)\)", page)
    assert len(led) == len(re.findall(r"\]\(([^)]*)\)", README))
    assert all(target.startswith("https://") for target in led)
    paths = [target.partition(f"/v{version}/")[2] for target in led if target.startswith(ADDRESS)]
    assert paths
    assert [path for path in paths if not (ROOT / path.partition("#")[0]).exists()] == []
    urls = dict(text.split(", ") for text in reported.get_all("Project-URL") or [])
    assert urls == addresses(ADDRESS)
    assert {"Homepage", "Documentation", "Changelog", "Issues", "Source"} <= urls.keys()


def test_existing_link_is_unchanged() -> None:
    text = "[a](https://code.example/x) [b](#keys) [c](mailto:a@b.example) `[lines]`"
    for address in ("", ADDRESS):
        assert as_on_a_package_page(text, address, "1") == text


def test_only_tested_platforms_are_named_as_supported() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    systems = [item for item in project["classifiers"] if item.startswith("Operating System")]
    assert systems == ["Operating System :: POSIX :: Linux"]
    assert "Tested on Linux only" in README


# The source package


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the unpacked source package of the project."""
    folder = tmp_path_factory.mktemp("source")
    with tarfile.open(build("build_sdist", folder)) as packed:
        packed.extractall(folder, filter="data")
    (found,) = (path for path in folder.iterdir() if path.is_dir())
    return found


@pytest.mark.sweep
def test_source_package_contains_the_whole_repository(unpacked: Path) -> None:
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    names = [name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]
    assert len(names) > 500
    assert [name for name in names if not (unpacked / name).is_file()] == []


@pytest.mark.sweep  # the gate does it, too
def test_source_package_passes_its_own_tests(unpacked: Path) -> None:
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider"]
    part = ["tests/wire", "tests/drive/test_library.py", "tests/drive/test_values.py"]
    done = subprocess.run(
        [*command, *part],
        cwd=unpacked, capture_output=True, text=True, timeout=PATIENCE * 5, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    where = "import tui, pathlib; print(pathlib.Path(tui.__file__).resolve().parents[1])"
    found = subprocess.run(
        [sys.executable, "-c", where], cwd=unpacked, capture_output=True, text=True, check=True
    )
    assert Path(found.stdout.strip()) == unpacked.resolve()


# The manual page


def test_manual_page_matches_the_commands() -> None:
    assert PAGE.read_text("utf-8") == man_page(), "python -m tui.cli.derived"


def test_manual_page_has_every_command_and_option() -> None:
    page = man_page()
    top = click.Context(main)
    for name in main.list_commands(top):
        section = page.partition(f".SS {_text(name)}\n")[2].partition("\n.SS ")[0]
        command = main.get_command(top, name)
        assert command is not None
        assert section
        for param in command.params:
            if isinstance(param, click.Option) and not param.hidden:
                assert all(_text(opt) in section for opt in param.opts), (name, param.opts)


@pytest.mark.parametrize(
    ("text", "roff"),
    [
        (".TH x", "\\&.TH x"),
        ("'so x", "\\&'so x"),
        ("a-b \\n", "a\\-b \\en"),
        ("plain", "plain"),
    ],
)
def test_no_text_is_a_roff_command(text: str, roff: str) -> None:
    assert _text(text) == roff


def test_table_is_kept_as_it_is() -> None:
    assert list(_paragraphs("one\ntwo\n\n\b\na  b\n.c\n")) == [
        "one two", ".PP", ".nf", "a  b", "\\&.c", ".fi",
    ]  # fmt: skip


def test_roff_accepts_the_manual_page() -> None:
    groff = shutil.which("groff")
    if groff is None:
        pytest.skip("groff is not here")
    done = subprocess.run(
        [groff, "-ww", "-man", "-Tutf8", str(PAGE)], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    assert "read" in done.stdout
