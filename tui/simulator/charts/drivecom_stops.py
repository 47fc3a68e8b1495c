"""Words that stop an Altivar 31, 312 or 71 while it stays enabled, and those that lock it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..body import Body
from ..plant.fault_history import OwnFault
from ..plant.motor import Stop

HALT, STOP_STT, INJECTION, FAST = (1 << bit for bit in (8, 12, 13, 14))
CMI_FAST, CMI_INJECTION, CMI_STANDSTILL, CMI_LOCKED = (1 << bit for bit in (10, 11, 13, 15))
CMI_EXTERNAL_FAULT = 1 << 3
STT = {0: Stop.RAMP, 1: Stop.FAST, 2: Stop.FREEWHEEL, 3: Stop.INJECTION}
EXTERNAL_FAULTS = ("EPF", "EPF1")
EXTERNAL_REACTIONS: Mapping[int, Stop | None] = {
    0: None,
    1: Stop.FREEWHEEL,
    2: Stop.RAMP,
    6: Stop.RAMP,
    7: Stop.FAST,
    8: Stop.INJECTION,
}
"""Reactions to an external fault, by the raw value of EPL; None: it is ignored."""


def stop_type(body: Body) -> Stop:
    """Return the normal stop type, by STT."""
    return STT.get(body.setting("STT", 0), Stop.RAMP)


def commanded_stop(body: Body, word: int, *, low_access: bool) -> Stop | None:
    """Return the stop of an enabled motor by a command word and CMI; None: no stop."""
    cmi = extended_command(body)
    compact = body.traits.access_levels
    orders = (
        (bool(cmi & CMI_FAST) and not compact, Stop.FAST),
        (bool(cmi & CMI_INJECTION) and not compact, Stop.INJECTION),
        (bool(word & FAST) and low_access, Stop.FAST),
        (bool(word & INJECTION) and low_access, Stop.INJECTION),
        (bool(word & HALT) and not compact, stop_type(body)),
        (bool(word & STOP_STT) and compact, stop_type(body)),
    )
    return next((stop for given, stop in orders if given), None)


def extended_command(body: Body) -> int:
    """Return the extended command word CMI."""
    return body.raw("extended_command_word") & 0xFFFF


def locked(body: Body, *, stands: bool) -> bool:
    """Return True if the drive must not supply the motor.

    CMI bit 15 locks at once; bit 13 keeps a motor at rest (ATV31/312: reserved on the ATV71).
    """
    cmi = extended_command(body)
    at_rest = body.traits.access_levels and cmi & CMI_STANDSTILL
    return bool(cmi & CMI_LOCKED) or bool(at_rest and stands)


def external_fault(body: Body, is_on: Callable[[int], bool]) -> OwnFault | None:
    """Return the external fault if CMI bit 3 (ATV31/312) or the assignment of ETF reports it.

    LET = 0 inverts an input: it reports a fault while it is open. EPL selects the stop, or that the
    motor continues.
    """
    assigned = body.setting("ETF", 0)
    by_input = assigned != 0 and is_on(assigned) == bool(body.setting("LET", 1))
    by_word = body.traits.access_levels and bool(extended_command(body) & CMI_EXTERNAL_FAULT)
    stop = EXTERNAL_REACTIONS.get(body.setting("EPL", 1), Stop.FREEWHEEL)
    codes = (f for f in body.profile.data.faults.codes if f.code.upper() in EXTERNAL_FAULTS)
    known = next(codes, None)
    if stop is None or known is None or not (by_input or by_word):
        return None
    return OwnFault(known.raw, stop, persists=True)
