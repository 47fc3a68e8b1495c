"""Communication timeout of a drive: its time, its start, and the drive's reaction.

Sources: ATV21 Modbus manual 6.4 (F803, F603); ATV71 Modbus manual, communication fault management,
and ATV312 communication variables (ttO, SLL); PX-MODBUS manual 4 (15.07).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tui.drive.profile.schema import CommunicationFault, Reaction

from ..body import Body, Fallback
from .motor import Stop

NO_MONITORING = 1 << 14
"""CMI bit 14 of the ATV31 and ATV312: the timeout is off."""


@dataclass(frozen=True, slots=True)
class Consequence:
    """Reaction to communication loss: a fault with a kind of stop, or a fallback without a
    fault."""

    trip: Stop | None = None
    fallback: Fallback | None = None


ALTIVAR_REACTIONS: Mapping[str, Consequence] = {
    "no": Consequence(),
    "yes": Consequence(trip=Stop.FREEWHEEL),
    "rmp": Consequence(trip=Stop.RAMP),
    "fst": Consequence(trip=Stop.FAST),
    "dci": Consequence(trip=Stop.INJECTION),
    "stt": Consequence(fallback=Fallback.STOP),
    "lff": Consequence(fallback=Fallback.SPEED),
    "rls": Consequence(fallback=Fallback.MAINTAIN),
}
"""Reactions by their code on the keypad."""
ALTIVAR_RAW: Mapping[int, str] = {0: "no", 1: "yes", 6: "rmp", 7: "fst"}
"""Raw values of SLL from the ATV312 manual, for a profile without codes."""
ALTIVAR_21_REACTIONS: Mapping[int, Consequence] = {
    0: Consequence(trip=Stop.FREEWHEEL),
    1: Consequence(trip=Stop.RAMP),
    2: Consequence(trip=Stop.INJECTION),
}
FREEWHEEL = Consequence(trip=Stop.FREEWHEEL)


class SilenceWatch:
    """Timer of the communication loss of one drive."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._data: CommunicationFault | None = body.profile.data.communication_fault
        self._spoken = False
        self._expired = False
        self._silent = 0.0

    def power_up(self) -> None:
        """Wait for a new request before monitoring the timeout."""
        self._spoken = self._expired = False
        self._silent = 0.0

    def heard(self) -> None:
        """Restart the timeout after a valid request to the drive's own address."""
        self._spoken = True
        self._expired = False
        self._silent = 0.0
        self._body.fallback = None

    @property
    def timeout(self) -> float | None:
        """Timeout in force, in s; None if it is off."""
        if self._data is None:
            return None
        parameter = self._body.registers.named(self._data.timeout)
        if parameter is None:
            return None
        raw = self._body.registers.in_force(parameter)
        off = 0 if self._data.off is None else self._data.off
        return None if raw == off else self._body.engineering(parameter)

    @property
    def watching(self) -> bool:
        """True if the timeout has started and is not off."""
        if self._data is None or self.timeout is None:
            return False
        if "no-timeout" in self._body.conditions.planted:
            return False
        if self._body.traits.access_levels:
            cmi = self._body.raw("extended_command_word")
            if cmi & NO_MONITORING:
                return False
        earlier = self._body.earlier_hz is not None
        given = self._body.line_orders.any_given or earlier
        return self._spoken and (given or not self._data.needs_write)

    def step(self, dt: float) -> Consequence | None:
        """Advance the time by `dt` seconds; return the reaction if the timeout has just expired."""
        if self._body.forced_local:
            self._silent = -self._resumes_after
            return None
        if not self.watching or self._expired:
            return None
        self._silent += dt
        if self._silent < (self.timeout or 0.0):
            return None
        self._expired = True
        return self.consequence()

    @property
    def _resumes_after(self) -> float:
        """Return the time in s after forced local control before the timeout is monitored again
        (FLOT)."""
        parameter = self._body.registers.named("FLOT")
        return self._body.engineering(parameter) if parameter else 0.0

    def consequence(self) -> Consequence:
        """Return the reaction in force; an unknown reaction is a freewheel stop."""
        if self._data is None or not self._data.reaction:
            return FREEWHEEL
        raw = self._body.setting(self._data.reaction, -1)
        if self._body.traits.kind == "own":
            return _declared(next((r for r in self._data.reactions if r.raw == raw), None))
        if self._body.traits.kind == "altivar21":
            return ALTIVAR_21_REACTIONS.get(raw, FREEWHEEL)
        reaction = next((r for r in self._data.reactions if r.raw == raw), None)
        code = _code(reaction) or ALTIVAR_RAW.get(raw, "")
        return ALTIVAR_REACTIONS.get(code, FREEWHEEL)

    @property
    def fault(self) -> int | None:
        """Return the raw code of the communication fault.

        If the profile has none, it is a number without a name: a drive in fault never shows none.
        """
        if self._data is None or self._data.fault is not None:
            return self._data.fault if self._data else None
        faults = self._body.profile.data.faults
        known = {faults.none, *(fault.raw for fault in faults.codes)}
        return next(raw for raw in range(1, 0x10000) if raw not in known)


def _declared(reaction: Reaction | None) -> Consequence:
    """Return a reaction of any make, as its row describes it."""
    if reaction is None or (reaction.trips and _code(reaction) not in ALTIVAR_REACTIONS):
        return FREEWHEEL
    if reaction.trips:
        return ALTIVAR_REACTIONS[_code(reaction)]
    return Consequence(fallback=None if reaction.motor_keeps_running else Fallback.STOP)


def _code(reaction: Reaction | None) -> str:
    return reaction.code.casefold() if reaction else ""
