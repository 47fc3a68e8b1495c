"""Commands from the terminals of an Altivar 21: F, R and RES, VIA and VIB.

Source: ATV21 Modbus manual 6.2 (functions 38 and 48 of an input) and 8.8. Without another function
F runs forward, R runs the other way, RES resets a fault; that is the wiring most drives have.
"""

from __future__ import annotations

from ..body import Body
from .altivar21_words import ANALOG_HZ

INPUT_FUNCTIONS = {"F": "F111", "R": "F112", "RES": "F113"}
FORCED_LOCAL, SECOND_REFERENCE, PRESET_INPUT = 48, 38, 6
"""Functions of an input: terminals instead of the line, F207 instead of FMOD, preset speed 1."""
VIB_REFERENCE = 2


class Altivar21Inputs:
    """The inputs of one drive, with the functions that its settings give them."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._reset_before = False

    def run(self, hz: float) -> None:
        """Close F, or R for the other direction, at a reference in Hz at VIA."""
        self._body.terminals.close("R" if hz < 0 else "F")
        self.refer(hz)

    def refer(self, hz: float) -> None:
        """Change the reference at VIA, in Hz."""
        self._body.terminals.apply("VIA", abs(hz) / ANALOG_HZ)

    def halt(self) -> None:
        """Open F and R."""
        for name in ("F", "R"):
            self._body.terminals.close(name, closed=False)

    def resets(self) -> bool:
        """Return True if RES has closed since the last call."""
        closed = self._closed("RES")
        pressed = closed and not self._reset_before
        self._reset_before = closed
        return pressed

    def _closed(self, name: str) -> bool:
        """Return True if an input is closed and has only its own function."""
        return self._body.terminals.closed(name) and not self._function(name)

    def _function(self, name: str) -> int:
        raw = self._body.setting(INPUT_FUNCTIONS[name], 0)
        return raw if raw in (FORCED_LOCAL, SECOND_REFERENCE, PRESET_INPUT) else 0

    def switched(self, function: int) -> bool:
        """Return True if an input with this function is closed."""
        closed = self._body.terminals.closed
        return any(closed(n) and self._function(n) == function for n in INPUT_FUNCTIONS)

    @property
    def run_ordered(self) -> bool:
        """True if F or R commands a run."""
        return self._closed("F") or self._closed("R")

    @property
    def reverse(self) -> bool:
        """True if the inputs command reverse."""
        return self._closed("R") and not self._closed("F")

    @property
    def hz(self) -> float:
        """The analog reference in Hz."""
        name = "VIB" if self._body.setting("FMOD", 1) == VIB_REFERENCE else "VIA"
        return ANALOG_HZ * self._body.terminals.level(name)
