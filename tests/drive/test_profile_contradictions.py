"""Facts of a profile that contradict each other: `profiles --check` refuses each by its line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from tui.drive.profile import library
from tui.simulator import DriveSpec, SimulatedDrive
from tui.simulator.proving.proof_steps import prove_profile

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
    found = library.all_faults_of(path)
    assert f"{path}:{line}: {mistake['reported']}" in found, (line, found)


def test_profile_whose_link_differs_from_its_factory_choices_can_still_be_used(
    tmp_path: Path,
) -> None:
    [mistake] = [m for m in MISTAKES["mistakes"] if "factory choice is 4800" in m["reported"]]
    text = FILES[mistake["file"]].read_text("utf-8")
    for right, wrong in mistake["changes"]:
        text = text.replace(right, wrong)
    path = tmp_path / "own.toml"
    path.write_text(text, "utf-8")
    assert library.load_file(path).id
    assert library.faults_of(path) == []
    assert len(library.all_faults_of(path)) == 1


UPPER_BYTE = ("address = 0x2100\nmask = 0xFF", "address = 0x2226\nshift = 8\nmask = 0xFF")


@pytest.fixture
def combined(tmp_path: Path) -> Path:
    """A drive whose status word has the fault in its upper byte, as several makes do."""
    path = tmp_path / "own.toml"
    path.write_text(FILES["ms"].read_text("utf-8").replace(*UPPER_BYTE), "utf-8")
    return path


def test_fault_may_be_a_part_of_the_status_word_if_neither_is_written(combined: Path) -> None:
    assert library.faults_of(combined) == []
    text = combined.read_text("utf-8").replace('0x2226\naccess = "r"', '0x2226\naccess = "rw"')
    combined.write_text(text, "utf-8")
    assert "bits 16#FF00 of address 8742 also belong to TRIP" in " ".join(
        library.faults_of(combined)
    )


@pytest.mark.sweep
def test_simulated_status_word_keeps_the_fault_in_it(combined: Path) -> None:
    profile = library.load_file(combined)
    assert {step.title: step.fault for step in prove_profile(profile) if step.fault} == {}
    drive = SimulatedDrive(profile, DriveSpec(profile.id, 1))
    drive.provoke(6)
    drive.step(0.1)
    assert (drive.raw("TRIP"), drive.raw("STATUS") >> 8) == (6, 6)
