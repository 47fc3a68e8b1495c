"""`drivepanel plan`: exit statuses, files, and nothing overwritten."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.sources import ROOT

from .commands import ended, refused

EXAMPLE = ROOT / "docs" / "plan" / "hall-2.toml"
SCAN = '{"command": "scan", "event": "hit", "device": 2, "profile": "atv71"}\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the output of a scan, and a line with a tap link that is too long."""
    (tmp_path / "scan.json").write_text(SCAN, "utf-8")
    text = EXAMPLE.read_text("utf-8").replace("stub = 3", "stub = 21", 1)
    (tmp_path / "bad.toml").write_text(text, "utf-8")
    return tmp_path


def test_line_within_its_limits_ends_with_0_and_draws(folder: Path) -> None:
    done = ended(0, "plan", EXAMPLE, "--svg", folder / "p.svg")
    assert "The line keeps the limits of the manuals." in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 100
    assert (folder / "p.svg").read_text("utf-8").startswith("<svg ")


def test_broken_limit_ends_with_1_and_names_its_chapter(folder: Path) -> None:
    done = ended(1, "plan", folder / "bad.toml")
    text = " ".join(done.stdout.split())
    assert "ERROR The tap link of Pump 1 (1) has 21 m." in text
    assert "[Altivar 31: manual appendix, mixed schematic]" in text
    reported = json.loads(ended(1, "plan", folder / "bad.toml", "--json").stdout)
    assert reported["keeps_limits"] is False
    assert [(f["severity"], f["stations"]) for f in reported["findings"]] == [("error", [1])]


def test_bad_file_ends_with_2_and_its_lines(folder: Path) -> None:
    path = folder / "bad.toml"
    path.write_text(path.read_text("utf-8").replace("stub = 21", 'stub = "far"'), "utf-8")
    assert f"{path}:22: station 1, stub: must be a number, not a text" in refused(2, "plan", path)
    assert "cannot be read" in refused(2, "plan", folder / "nosuch.toml")
    assert "--svg is for a plan" in ended(
        2, "plan", path, "--from-scan", folder / "scan.json", "--svg", folder / "p.svg"
    ).stderr  # fmt: skip


def test_plan_of_a_scan_is_written_once(folder: Path) -> None:
    scan, new = folder / "scan.json", folder / "new.toml"
    ended(0, "plan", new, "--from-scan", scan)
    text = new.read_text("utf-8")
    assert ended(0, "plan", "-", "--from-scan", scan).stdout == text
    assert "already exists" in refused(2, "plan", new, "--from-scan", scan)
    assert new.read_text("utf-8") == text
    assert "No device has a polarization." in ended(1, "plan", new).stdout
