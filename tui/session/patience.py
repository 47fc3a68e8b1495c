"""Waiting times for drives on a shared line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine

SLOW_CHARACTERS = 1200
"""Characters that others may say meanwhile: at 1200 baud 11 s, at 19200 0.7 s."""


def patience(line: ModbusLine, seconds: float) -> float:
    """So many seconds, and longer on a slow line: what takes ten exchanges takes seconds there."""
    from tui.bus.link import character_time

    return seconds + SLOW_CHARACTERS * character_time(line.link)
