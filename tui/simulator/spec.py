"""Parts of a simulated line: its drives and its timing."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from .errors import SimulatorError

DEFAULT_ADDRESS = 1
LAST_ADDRESS = 247
LONGEST_ADDRESS = 9
"""Digits of the longest address that is parsed; a pasted one may be too long for int()."""
_FORMAT = re.compile(r"8[NEO][12]")


@dataclass(frozen=True)
class DriveSpec:
    """Specification of one simulated drive.

    `sets` are raw values by parameter code (or number, or address) in force from power-up; a
    monitored word among them keeps its value. `%MW20` and `IPC1`..`IPC4` set words of an Altivar
    71's cards. `protects` names parameters that are hidden from the line. `identity` replaces
    objects of function 43 by their id. `run_hz` starts the motor at power-up: by its run input if
    the terminals command, else as if by an earlier command of another master. With `wander`, that
    reference changes at intervals.
    """

    profile: str
    address: int = DEFAULT_ADDRESS
    sets: Mapping[str, int] = field(default_factory=dict)
    protects: frozenset[str] = frozenset()
    name: str = ""
    identity: Mapping[int, str] = field(default_factory=dict)
    run_hz: float = 0.0
    wander: bool = False


@dataclass(frozen=True)
class LineTiming:
    """Baud and character format of the line, and whether the simulation keeps their real time."""

    baud: int = 19200
    format: str = "8E1"
    real_time: bool = False

    def __post_init__(self) -> None:
        """Raise for a format or a baud that no serial port has."""
        if not _FORMAT.fullmatch(self.format):
            raise SimulatorError(
                f"{self.format!r} is not a character format; write it like 8E1, 8O1, 8N1 or 8N2."
            )
        if self.baud < 1:
            raise SimulatorError(f"A line of {self.baud} baud carries nothing; 19200 is usual.")

    @property
    def bits_per_character(self) -> int:
        """Return the bits of one character on the wire: start, data, parity if any, stop bits."""
        return 1 + int(self.format[0]) + (self.format[1] != "N") + int(self.format[2])

    @property
    def character(self) -> float:
        """Return the time of one character on the wire, in seconds."""
        return self.bits_per_character / self.baud

    @property
    def silence(self) -> float:
        """Return the pause that ends a frame, in s: 3.5 characters, 1.75 ms above 19200 baud.

        Computed independently of tui.wire, so that the simulator can show defects in it.
        """
        return 0.00175 if self.baud > 19200 else 3.5 * self.character


def parse_drives(text: str) -> list[DriveSpec]:
    """Return the drives of `atv71@2,atv21`: profiles with addresses, missing ones the next free
    from 1.

    Raises SimulatorError with the invalid part of the text.
    """
    wanted: list[tuple[str, int | None]] = []
    for part in text.split(","):
        profile, sign, address = part.strip().partition("@")
        if not profile:
            raise SimulatorError(
                f"{text!r} names no profile between its commas; write it like atv71@2,atv21."
            )
        wanted.append((profile.strip().lower(), _address(part, address) if sign else None))
    taken: set[int] = set()
    for _, given in wanted:
        if given in taken:
            raise SimulatorError(f"Two simulated drives have address {given}; give each its own.")
        if given is not None:
            taken.add(given)
    drives = []
    for profile, given in wanted:
        if given is None:
            given = next(a for a in range(DEFAULT_ADDRESS, LAST_ADDRESS + 1) if a not in taken)
            taken.add(given)
        drives.append(DriveSpec(profile, given))
    return drives


def _address(part: str, text: str) -> int:
    typed = text.strip()
    if typed.isdecimal() and len(typed) <= LONGEST_ADDRESS and 1 <= int(typed) <= LAST_ADDRESS:
        return int(typed)
    raise SimulatorError(f"{part.strip()!r}: the address after @ must be 1 to {LAST_ADDRESS}.")
