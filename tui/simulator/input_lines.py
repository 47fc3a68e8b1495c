"""Lines by which a person sets the inputs of simulated drives: `2: LI1=1, AI1=5V`."""

from __future__ import annotations

from .drive import SimulatedDrive
from .errors import SimulatorError
from .simulation import Simulation

EXAMPLE = "2: LI1=1, AI1=5V"


def set_inputs(simulation: Simulation, text: str) -> str:
    """Set the inputs of a line, and return their present state.

    The address may be left out where there is one drive; without inputs they are only told.
    Nothing is set where a part of the line is wrong. Raises SimulatorError.
    """
    drive, assignments = check_inputs(simulation, text)
    reported = [drive.set_input(name, value) for name, value in assignments]
    return f"{drive.address}: {', '.join(reported) if reported else drive.terminals.reported()}"


def check_inputs(simulation: Simulation, text: str) -> tuple[SimulatedDrive, list[tuple[str, str]]]:
    """The drive that a line means, with its inputs and what they are set to; sets nothing.

    Raises SimulatorError where a part of the line is wrong.
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
