"""The panel knows a drive family by its profile alone: no name, code or group of one in Python.

`tui/simulator` plays families and is left out.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import get_args

import pytest

from tui.drive.profile import library
from tui.drive.profile.schema import Quantity

from .sources import PACKAGE as TUI
from .sources import modules, nodes_of

FILES = [path for path in modules(TUI) if (TUI / "simulator") not in path.parents]
PROFILES = [library.load(listing.id) for listing in library.listings()]
NAMES = re.compile(
    r"(?i)\batv ?\d|altivar|leroy|power ?drive|proxidrive|varmeca|drivecom|\bpx-|telemecanique"
)
CODES = {parameter.code.casefold() for profile in PROFILES for parameter in profile.parameters}
TITLES = {"Faults", "Monitoring", "Identification"}
"""Groups that are also titles of screens or tables of the profile language."""
GROUPS = {parameter.group for profile in PROFILES for parameter in profile.parameters} - TITLES
WORDS = {"add", "cos", "cod", "inr", "in", "os", "typ", "fan", "pro", "dis", "bit", "no", "if",
         "run", "time", "int", "f1", "f2", "day"}  # fmt: skip
"""Codes that are also English words or program words."""
SPOKEN = re.compile(r"\b(HSP|LSP|TFR|FRH|RFR|ETA|CMD|LFRD?|CMI|CHCF|DOTD|FA\d\d|F\d{3})\b")
"""Codes that a person would see."""


def texts(nodes: Sequence[ast.AST]) -> Iterator[tuple[int, str]]:
    """Yield line and text of every string except docstrings."""
    alone = {
        id(node.value)
        for node in nodes
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in alone:
            yield node.lineno, node.value


def known_families(path: Path) -> list[str]:
    """Return references to a family in a module, each with its line."""
    found = []
    nodes = nodes_of(path)
    for line, text in texts(nodes):
        name = NAMES.search(text)
        code = text.casefold() in CODES - WORDS and len(text) > 1
        spoken = SPOKEN.search(text)
        if name or code or spoken:
            found.append(f"{path.relative_to(TUI)}:{line}: {text!r}")
    for node in nodes:
        # a name of a group in a comparison with one, or in a set of them
        if isinstance(node, ast.Compare | ast.Set | ast.Dict | ast.Call):
            inside = (n for n in ast.walk(node) if isinstance(n, ast.Constant))
            groups = [f"{path.name}:{n.lineno}: {n.value!r}" for n in inside if n.value in GROUPS]
            if groups and (isinstance(node, ast.Set) or "group" in ast.unparse(node)):
                found += groups
    return found


def test_no_module_names_a_family() -> None:
    assert len(FILES) > 300
    assert [known for path in FILES for known in known_families(path)] == []


def test_page_lists_no_family_known_to_python() -> None:
    text = (TUI.parent / "docs" / "architecture.md").read_text(encoding="utf-8")
    part = text.split("## Where Python still knows a family")[1].split("\n## ")[0]
    assert [line for line in part.splitlines() if line.startswith("|")] == []


@pytest.mark.parametrize(
    "planted",
    ['RESETS = ("cfg", "bfr")', 'if parameter.group == "Command": pass', 'DEMO = {"atv21": 35.0}',
     'TEXT = "at most to HSP"', 'if chart.kind == "drivecom": pass', 'WORD = "15.01"'],
)  # fmt: skip
def test_planted_defect_is_found(
    planted: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = tmp_path / "planted.py"
    module.write_text(planted, encoding="utf-8")
    monkeypatch.setattr(f"{__name__}.TUI", tmp_path)
    assert known_families(module) != []


def test_quantities_are_not_codes() -> None:
    assert not {quantity for quantity in get_args(Quantity) if quantity in CODES}
