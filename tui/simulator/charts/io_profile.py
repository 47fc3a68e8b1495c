"""The ATV71's I/O profile: commands by single bits, a simplified status word.

Source: ATV71 communication parameters guide, I/O profile (CHCF = 3).
"""

from __future__ import annotations

from dataclasses import dataclass

THREE_WIRE = 1


@dataclass(frozen=True, slots=True)
class IoCommand:
    """Commands by bits of the command word."""

    run: bool = False
    reverse: bool = False


def read_io_command(before: IoCommand, word: int, rising: int, wiring: int) -> IoCommand:
    """Return the command after a new command word, with the bits that have just become 1.

    Two-wire control: bit 0 runs forward, bit 1 reverse, as long as they are 1. Three-wire control:
    bit 0 allows running, an edge of bit 1 starts forward, of bit 2 reverse.
    """
    if wiring != THREE_WIRE:
        forward, reverse = bool(word & 1), bool(word & 2)
        return IoCommand(forward or reverse, reverse and not forward)
    if not word & 1:
        return IoCommand()
    if rising & 2:
        return IoCommand(True, False)
    if rising & 4:
        return IoCommand(True, True)
    return before


def io_status(*, fault: bool, running: bool) -> int:
    """Return bits 0 to 6 of the status word: 1 ready, 2 running, 3 fault, 5 always 1."""
    return 1 << 5 | (1 << 3 if fault else 1 << 1) | (1 << 2 if running and not fault else 0)
