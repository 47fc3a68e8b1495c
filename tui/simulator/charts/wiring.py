"""Commands from the inputs of an Altivar 31, 312 or 71: two-wire or three-wire, levels or edges.

Sources: ATV71 communication parameters list and ATV312 communication variables (TCC, TCT, RRS).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..body import Body
from ..plant.motor import Stop

THREE_WIRE, TRANSITION = 1, 1
FORWARD, START, REVERSE_INPUT = "LI1", "LI2", 130
FREEWHEEL_INPUT, FAST_INPUT = "NST", "FST"


@dataclass(frozen=True, slots=True)
class WiredOrder:
    """Present command of the inputs."""

    run: bool = False
    reverse: bool = False


class TerminalWiring:
    """Follower of the run inputs of one drive.

    With two wires, a closed contact runs the motor for as long as it is closed, also after a reset.
    If TCT requires a transition, it must have been open once since power-up, reset or change of
    channel. With three wires, LI1 allows running, a pulse of LI2 starts, one of LI3 or of the input
    of RRS starts reverse.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self.order = WiredOrder()
        self._before: frozenset[str] = frozenset()
        self._spent = False
        """True if the closed inputs must open first."""

    def renew(self) -> None:
        """Require a new transition after a fault, a loss of supply or a change of channel."""
        self.order = WiredOrder()
        self._spent = self._body.setting("TCT", 0) == TRANSITION

    def follow(self) -> None:
        """Read the present inputs."""
        terminals = self._body.terminals
        closed = frozenset(name for name in terminals.names.logic if terminals.closed(name))
        pressed = closed - self._before
        self._before = closed
        backward = self._backward()
        if self._body.setting("TCC", 0) == THREE_WIRE:
            self.order = self._by_pulses(closed, pressed, backward)
            return
        forward, reverse = FORWARD in closed, backward in closed
        if not forward and not reverse:
            self._spent = False
        runs = (forward or reverse) and not self._spent
        self.order = WiredOrder(runs, reverse and not forward)

    def _by_pulses(
        self, closed: frozenset[str], pressed: frozenset[str], backward: str
    ) -> WiredOrder:
        if FORWARD not in closed:
            return WiredOrder()
        if START in pressed:
            return WiredOrder(True, False)
        backward = "LI3" if backward == START else backward
        return WiredOrder(True, True) if backward in pressed else self.order

    def _backward(self) -> str:
        raw = self._body.setting("RRS", REVERSE_INPUT)
        return f"LI{raw - 128}" if 129 <= raw <= 142 else "LI2"

    def stop(self) -> Stop | None:
        """Return the stop by an input that must be closed to run (NST, FST), from any command
        source."""
        for code, way in ((FREEWHEEL_INPUT, Stop.FREEWHEEL), (FAST_INPUT, Stop.FAST)):
            raw = self._body.setting(code, 0)
            if 129 <= raw <= 142 and not self._body.terminals.closed(f"LI{raw - 128}"):
                return way
        return None
