"""Causes of a simulated drive's faults: provoked, a silent line, a word or an input."""

from __future__ import annotations

from dataclasses import replace

from .body import Body
from .charts.families import PlayedChart
from .plant.fault_history import FaultHistory
from .plant.motor import Stop
from .plant.watch import SilenceWatch


class Tripping:
    """Trips one drive, once at a time."""

    def __init__(self, body: Body, chart: PlayedChart, watch: SilenceWatch) -> None:
        self._body = body
        self._chart = chart
        self._watch = watch
        self._history = FaultHistory(body)
        self._raised = False
        """True if the fault is one that a word or an input reports still."""

    def trip(self, raw: int, stop: Stop, *, persists: bool = False) -> None:
        """Trip with a fault, if none is there; the inputs stay as they are."""
        if self._body.fault is None:
            self._history.enter(raw, persists=persists)
            self._chart.trip(stop)

    def look(self) -> None:
        """Trip by what a word or an input reports; once it is gone a reset helps."""
        own = self._chart.raises()
        fault = self._body.fault
        if own is None:
            if self._raised and fault is not None:
                self._body.fault = replace(fault, persists=False)
            self._raised = False
        elif fault is None:
            stop = own.stop or self._watch.consequence().trip or Stop.FREEWHEEL
            self.trip(own.raw, stop, persists=own.persists)
            self._raised = own.persists

    def step(self, dt: float) -> None:
        """Let time pass over a line that may be silent, and over what is reported."""
        if consequence := self._watch.step(dt):
            if consequence.trip is not None:
                self.trip(self._watch.fault or 0, consequence.trip)
            else:
                self._body.fallback = consequence.fallback
        self.look()

    def show(self) -> None:
        """Show the present fault where its word does not keep the last one."""
        self._history.show()
