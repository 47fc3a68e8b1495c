"""The turnarounds of a drive as bars of a histogram, for a person. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tui.bus.api import TURNAROUND_EDGES


@dataclass(frozen=True, slots=True)
class TurnaroundBar:
    """Replies with a turnaround up to so many ms, and longer than the bar before; None: beyond."""

    up_to_ms: int | None
    count: int

    @property
    def label(self) -> str:
        """Which turnarounds it counts: `up to 20 ms`."""
        return f"up to {self.up_to_ms} ms" if self.up_to_ms is not None else "longer"


def bars(turnarounds: Sequence[int]) -> list[TurnaroundBar]:
    """The bars of the counts of a device, the shortest turnaround first."""
    edges = [*(round(1000 * edge) for edge in TURNAROUND_EDGES), None]
    return [TurnaroundBar(edge, count) for edge, count in zip(edges, turnarounds, strict=True)]
