"""A command that owns a line looks after the motors of programs that share it and are gone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .say import say

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine
    from tui.bus.program import Program
    from tui.session.sharing.guardian import Guardian


def guard_motors(line: ModbusLine) -> None:
    """From now on stop the motors of a program that is gone, as far as this one owns the line."""
    guardians: list[Guardian] = []

    def gone(program: Program) -> None:
        # imported when it is needed: most commands never are left by anybody
        from tui.session.journal import Journal
        from tui.session.sharing.guardian import Guardian

        if not guardians:
            guardians.append(Guardian(line, Journal()))
            guardians[0].gone(program)

    line.facts.on_gone(gone)
    line.facts.on_text(_tell)


def _tell(device: int, text: str) -> None:
    say(f"drivepanel: drive {device}: {text}", err=True)
