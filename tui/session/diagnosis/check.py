"""One check of a diagnosis: its test, its sentence, its next steps, its certainty."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from .evidence import DiagnosticEvidence
from .sick import CERTAIN

Steps = Callable[[DiagnosticEvidence], Iterable[str]]


@dataclass(frozen=True, slots=True)
class Check:
    """Check for one possible cause."""

    id: str
    fails: Callable[[DiagnosticEvidence], bool]
    says: Callable[[DiagnosticEvidence], str]
    """Cause as one sentence."""
    steps: Steps
    certainty: Callable[[DiagnosticEvidence], str] = lambda _: CERTAIN
    others: tuple[str, ...] = ()
    """Other possible causes, if the verdict is not certain."""


def first_sentence(text: str) -> str:
    """The first sentence of a text."""
    return text.partition(". ")[0].rstrip(".") + "."
