"""Facts of a profile that contradict each other: `profiles --check` refuses each by its line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from tui.drive.profile import library

KINDS = Path(__file__).parents[1] / "line" / "profiles"
FILES = {
    "pump": Path(__file__).parent / "pump.toml",
    "atv": KINDS / "atv320-kind.toml",
    "ms": KINDS / "ms300-kind.toml",
}
MISTAKES = tomllib.loads(Path(__file__).with_name("contradictions.toml").read_text("utf-8"))


@pytest.mark.parametrize("mistake", MISTAKES["mistakes"], ids=lambda mistake: mistake["name"])
def test_contradiction_is_refused_at_its_line(tmp_path: Path, mistake: dict[str, Any]) -> None:
    text = FILES[mistake["file"]].read_text("utf-8")
    for right, wrong in mistake["changes"]:
        assert text.count(right) == 1, right
        text = text.replace(right, wrong)
    path = tmp_path / "own.toml"
    path.write_text(text, "utf-8")
    line = text[: text.index(mistake["at"])].count("\n") + 1
    found = library.faults_of(path)
    assert f"{path}:{line}: {mistake['reported']}" in found, (line, found)
