"""Drivecom state chart: its states, its commands, and its transitions."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum


class DrivecomState(Enum):
    """States of the chart with bits 0 to 6 of their status word, without bit 4."""

    DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP = 0x07
    REACTION = 0x0F
    FAULT = 0x08


class DrivecomCommand(Enum):
    """Commands of the chart: mask and value of the command word."""

    DISABLE_VOLTAGE = (0x0002, 0x0000)
    QUICK_STOP = (0x0006, 0x0002)
    SHUTDOWN = (0x0007, 0x0006)
    SWITCH_ON = (0x000F, 0x0007)
    ENABLE = (0x000F, 0x000F)


TRANSITIONS: Mapping[tuple[DrivecomState, DrivecomCommand], DrivecomState] = {
    (DrivecomState.DISABLED, DrivecomCommand.SHUTDOWN): DrivecomState.READY,
    (DrivecomState.READY, DrivecomCommand.SWITCH_ON): DrivecomState.SWITCHED_ON,
    (DrivecomState.READY, DrivecomCommand.DISABLE_VOLTAGE): DrivecomState.DISABLED,
    (DrivecomState.READY, DrivecomCommand.QUICK_STOP): DrivecomState.DISABLED,
    (DrivecomState.SWITCHED_ON, DrivecomCommand.ENABLE): DrivecomState.ENABLED,
    (DrivecomState.SWITCHED_ON, DrivecomCommand.SHUTDOWN): DrivecomState.READY,
    (DrivecomState.SWITCHED_ON, DrivecomCommand.DISABLE_VOLTAGE): DrivecomState.DISABLED,
    (DrivecomState.SWITCHED_ON, DrivecomCommand.QUICK_STOP): DrivecomState.DISABLED,
    (DrivecomState.ENABLED, DrivecomCommand.SHUTDOWN): DrivecomState.READY,
    (DrivecomState.ENABLED, DrivecomCommand.DISABLE_VOLTAGE): DrivecomState.DISABLED,
    (DrivecomState.ENABLED, DrivecomCommand.QUICK_STOP): DrivecomState.QUICK_STOP,
    (DrivecomState.QUICK_STOP, DrivecomCommand.DISABLE_VOLTAGE): DrivecomState.DISABLED,
}
"""Transitions that happen at once; Disable operation (16#0007) may wait for a ramp."""


def command_of(word: int) -> DrivecomCommand | None:
    """Return the command of a word; None if its bits 0 to 3 match none."""
    return next((c for c in DrivecomCommand if word & c.value[0] == c.value[1]), None)
