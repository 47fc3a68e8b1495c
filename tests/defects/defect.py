"""Fields of a planted defect."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Defect:
    """One change of one place that the tests must notice."""

    name: str
    room: str
    """The folder or file in which the old text appears exactly once."""
    old: str
    new: str
    suffers: str
    """The consequence for a person, in a sentence."""
    tests: tuple[str, ...]
    """The tests that run with it, as pytest names them."""
