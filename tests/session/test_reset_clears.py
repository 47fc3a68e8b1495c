"""Fault reset of an Altivar 21: its words of the line return to 0, with a prior warning."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from tui.drive.fault_reset import reset_follows
from tui.drive.profile import library
from tui.session.command.access import CommandAccess, CommandHistory
from tui.session.command.commander import give_order, give_reference, run_at_reference
from tui.session.drive import DriveSession
from tui.session.journal import Journal

from .fakes import OneDrive

ATV21 = library.load("atv21")
STATUS, FAULT, COMMAND, REFERENCE = (ATV21[c].address for c in ("FD01", "FC90", "FA00", "FA01"))
RESET_BIT, RUN_BIT = 0x2000, 0x0400
TRIPPED, STANDBY, RUNNING = 0x0003, 0x4000, 0x6400


class TrippedDrive(OneDrive):
    """An Altivar 21 that has tripped; a reset puts the words of its RAM back (manual 8.2)."""

    def __init__(self) -> None:
        super().__init__(dict.fromkeys(range(0x10000), 0))
        self.registers.update({ATV21["FH"].address: 8000, ATV21["UL"].address: 5000})
        self.trip()

    def trip(self) -> None:
        self.registers.update({STATUS: TRIPPED, FAULT: 24})

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        done = await super().write(device, address, values, **how)
        if address == COMMAND and values[0] & RESET_BIT:
            self.registers.update({STATUS: STANDBY, FAULT: 0, COMMAND: 0, REFERENCE: 0})
        elif address == COMMAND and self.registers[STATUS] != TRIPPED:
            self.registers[STATUS] = RUNNING if values[0] & RUN_BIT else STANDBY
        return done


def access(line: TrippedDrive) -> CommandAccess:
    session = DriveSession(line, 1, ATV21)
    session.arming.arm(seconds=math.inf)
    return CommandAccess(session, Journal(), session.work.permit(), CommandHistory(session))


def test_reset_text_warns_of_a_closed_input_until_control_returns() -> None:
    reported = reset_follows(ATV21, {"FD01": 0, "CMOD": 0}, {"FD06": 1})
    assert "Until Drive Panel sends 16#C000, a closed run input" in reported
    assert "clears FA00 and the reference" in reported
    assert reported.endswith("Closed at the terminals now: F.")


async def test_cleared_reference_is_reported_and_not_restored() -> None:
    line = TrippedDrive()
    made = access(line)
    line.registers.update({STATUS: STANDBY, FAULT: 0})
    await give_reference(made, "30Hz")
    assert line.registers[REFERENCE] == 3000
    line.trip()
    output = await give_order(made, "reset")
    assert output == "Fault reset: Standby; the reference is 0.00 Hz now"
    assert line.registers[COMMAND] == 0xC000, "the line keeps command and reference"
    assert made.given.wanted is None
    await run_at_reference(made, "forward", None)
    assert line.registers[REFERENCE] == 0
