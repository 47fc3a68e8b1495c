"""Result of one step of the self-test of a profile, and how a step is carried out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tui.drive.errors import DriveError
from tui.drive.profile.toml_lines import TomlPath

from ..errors import SimulatorError
from .proof_bench import Unproved


@dataclass(frozen=True, slots=True)
class ProofStep:
    """Result of one step, and the place of its claim in the file."""

    path: TomlPath
    title: str
    fault: str = ""
    """Why it failed; empty if it passed."""


def proof_step(path: TomlPath, title: str, test: Callable[[], None]) -> ProofStep:
    """Carry out a step; an error of the drive is its fault."""
    try:
        test()
    except (Unproved, DriveError, SimulatorError) as error:
        return ProofStep(path, title, str(error) or "failed")
    return ProofStep(path, title)
