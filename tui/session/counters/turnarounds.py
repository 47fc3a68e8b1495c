"""Histogram of a drive's turnarounds. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tui.bus.api import TURNAROUND_EDGES


@dataclass(frozen=True, slots=True)
class TurnaroundBar:
    """Bar of the histogram: replies up to a turnaround in ms; None for all longer ones."""

    up_to_ms: int | None
    count: int

    @property
    def label(self) -> str:
        """Range of the bar as text, for example `up to 20 ms`."""
        return f"up to {self.up_to_ms} ms" if self.up_to_ms is not None else "longer"


def bars(turnarounds: Sequence[int]) -> list[TurnaroundBar]:
    """Return the bars for the counts of a device, shortest turnaround first."""
    edges = [*(round(1000 * edge) for edge in TURNAROUND_EDGES), None]
    return [TurnaroundBar(edge, count) for edge, count in zip(edges, turnarounds, strict=True)]
