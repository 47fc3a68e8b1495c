"""Causes of a simulated drive's faults: provoked, communication loss, a word or an input."""

from __future__ import annotations

from dataclasses import replace

from .body import Body
from .charts.families import PlayedChart
from .plant.fault_history import FaultHistory
from .plant.motor import Stop
from .plant.watch import SilenceWatch


class Tripping:
    """Trip logic of one drive; one fault at a time."""

    def __init__(self, body: Body, chart: PlayedChart, watch: SilenceWatch) -> None:
        self._body = body
        self._chart = chart
        self._watch = watch
        self._history = FaultHistory(body)
        self._raised = False
        """True if a word or an input still reports the fault."""

    def trip(self, raw: int, stop: Stop, *, persists: bool = False) -> None:
        """Trip with a fault, if none is present; the inputs stay unchanged."""
        if self._body.fault is None:
            self._history.enter(raw, persists=persists)
            self._chart.trip(stop)

    def look(self) -> None:
        """Trip on a fault reported by a word or an input; once the report ends, a reset clears
        it."""
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
        """Advance the time by `dt` seconds; trip on communication loss or a reported fault."""
        if consequence := self._watch.step(dt):
            if consequence.trip is not None:
                self.trip(self._watch.fault or 0, consequence.trip)
            else:
                self._body.fallback = consequence.fallback
        self.look()

    def show(self) -> None:
        """Show the present fault, unless its word keeps the last one."""
        self._history.show()
