"""What a defect to be planted is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Defect:
    """One change of one place that the tests must notice."""

    name: str
    room: str
    """The folder or file in which the old text stands exactly once."""
    old: str
    new: str
    suffers: str
    """What a person would suffer, in a sentence."""
    tests: tuple[str, ...]
    """The tests that are run with it, as pytest names them."""
