"""Causes of a simulated drive's faults: provoked, communication loss, a word or an input."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from .body import Body
from .charts.families import PlayedChart
from .plant.fault_history import FaultHistory
from .plant.motor import Stop
from .plant.watch import SilenceWatch

LEAST_MAINS = 0.7
"""Share of the rated supply voltage below which a drive trips. A guess: no manual gives it."""
MOST_BUS = 1.2
"""Share of the rated voltage of the DC bus above which a drive trips. A guess."""
MOST_THERMAL = 118.0
"""Thermal state of the motor in % at which a drive trips: ATV71 and ATV312 manuals, THR."""


@dataclass(frozen=True, slots=True)
class Protection:
    """Trip of a drive by its supply or its load, if a bench has changed them."""

    codes: tuple[str, ...]
    """Codes of the fault; the first that the profile has is raised."""
    due: Callable[[Body], bool]


def _is_undervoltage(body: Body) -> bool:
    changed = body.conditions.volts is not None
    return changed and body.motor.mains < LEAST_MAINS * body.rating.voltage


def _is_overbraking(body: Body) -> bool:
    most = MOST_BUS * math.sqrt(2) * body.rating.voltage
    return body.conditions.inertia > 1 and body.motor.dc_bus > most


def _is_overload(body: Body) -> bool:
    changed = body.conditions.load is not None or body.conditions.jammed
    return changed and body.motor.motor_thermal >= MOST_THERMAL


PROTECTIONS = (
    Protection(("USF", "UP1"), _is_undervoltage),
    Protection(("OBF", "OP2"), _is_overbraking),
    Protection(("OLF", "OL2"), _is_overload),
)


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
        self._protect()
        self.look()

    def _protect(self) -> None:
        """Trip if the supply or the load that a bench has set is too much for the drive."""
        if self._body.fault is not None:
            return
        for protection in PROTECTIONS:
            if protection.due(self._body):
                codes = {f.code.upper(): f.raw for f in self._body.profile.data.faults.codes}
                raw = next((codes[c] for c in protection.codes if c in codes), None)
                if raw is not None:
                    self.trip(raw, Stop.FREEWHEEL)

    def show(self) -> None:
        """Show the present fault, unless its word keeps the last one."""
        self._history.show()
