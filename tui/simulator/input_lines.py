"""Text lines that set the inputs of simulated drives: `2: LI1=1, AI1=5V`."""

from __future__ import annotations

from .drive import SimulatedDrive
from .errors import SimulatorError
from .simulation import Simulation

EXAMPLE = "2: LI1=1, AI1=5V"


def set_inputs(simulation: Simulation, text: str) -> str:
    """Set the inputs in a text line, and return their present state.

    The address may be omitted if there is one drive; a line without inputs only returns their
    state. Nothing is set if a part of the line is invalid. Raises SimulatorError.
    """
    drive, assignments = check_inputs(simulation, text)
    reported = [drive.set_input(name, value) for name, value in assignments]
    return f"{drive.address}: {', '.join(reported) if reported else drive.terminals.reported()}"


def check_inputs(simulation: Simulation, text: str) -> tuple[SimulatedDrive, list[tuple[str, str]]]:
    """Return the drive of a text line, with its inputs and their new values; sets nothing.

    Raises SimulatorError if a part of the line is invalid.
    """
    head, colon, rest = text.partition(":")
    address = head.strip() if colon else ""
    if colon and not address.isdecimal():
        raise SimulatorError(f"{text.strip()!r}: write it like {EXAMPLE!r}.")
    drive = simulation.drive(int(address)) if address else simulation.only_drive
    parts = [part for part in (rest if colon else text).split(",") if part.strip()]
    assignments = []
    for part in parts:
        name, sign, value = part.partition("=")
        if not sign:
            raise SimulatorError(f"{part.strip()!r}: write an input like LI1=1 or AI1=5V.")
        assignments.append((name, value))
    for name, value in assignments:
        drive.terminals.check(name, value)
    return drive, assignments
