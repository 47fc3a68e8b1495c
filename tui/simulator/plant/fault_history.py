"""Faults of a drive: raw values of codes, fault words, history and records.

Source of the records of an Altivar 31, 312 or 71: ATV71 communication parameters list (DP0 and its
record); ATV312 communication variables (EP1 to EP4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tui.drive.profile.profile import Profile

from ..body import ActiveFault, Body
from ..errors import SimulatorError
from .motor import Stop

RECORDED: Mapping[str, str] = {
    "EP": "ETA",
    "IP": "ETI",
    "CMP": "CMD",
    "ULP": "ULN",
    "LCP": "LCR",
    "RFP": "RFR",
    "THP": "THR",
    "RTP": "RTH",
}
"""Code prefixes of a fault's record, and the word that each stores; 0 is the last fault."""
RECORDS = 9


class FaultRecords:
    """States of the drive at its last faults, the last first."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._records: list[dict[str, int]] = []

    def take(self) -> None:
        """Store the present words as the record of a fault."""
        registers = self._body.registers
        record = {
            start: registers.present(parameter)
            for start, code in RECORDED.items()
            if (parameter := registers.named(code))
        }
        self._records = [record, *self._records][:RECORDS]
        for number, kept in enumerate(self._records):
            for start, raw in kept.items():
                self._body.show_code(f"{start}{number}", raw)


@dataclass(frozen=True, slots=True)
class OwnFault:
    """Fault caused by a word or an input, and its kind of stop."""

    raw: int
    stop: Stop | None
    """Kind of stop; None: the configured reaction to communication loss."""
    persists: bool = False
    """True if the fault cannot be reset while it is raised."""


def fault_raw(profile: Profile, fault: str | int) -> int:
    """Return the raw value of a fault given by code in any case, or by its raw value.

    Raises SimulatorError for a code that the profile does not have.
    """
    if isinstance(fault, int):
        return fault
    wanted = fault.strip()
    for known in profile.data.faults.codes:
        if known.code.casefold() == wanted.casefold():
            return known.raw
    if wanted.isdecimal():
        return int(wanted)
    codes = ", ".join(f.code for f in profile.data.faults.codes[:8]) or "none"
    raise SimulatorError(f"{profile.name} has no fault {fault!r}. Known: {codes} ...")


class FaultHistory:
    """Fault words of one drive."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._faults = body.profile.data.faults
        self._records = FaultRecords(body)

    def enter(self, raw: int, *, persists: bool) -> None:
        """Enter a fault: store its record, show it, and shift the history.

        The new fault enters the history, or the one before it if the word of the last fault is the
        first place of the history.
        """
        body = self._body
        self._records.take()
        named = self._faults.parameter
        present = body.registers.named(named) if named else None
        newest = raw
        if named in self._faults.history and present is not None:
            newest = body.registers.present(present)
        if present is not None:
            body.registers.put(present, raw)
        if newest != self._faults.none:
            self._push(newest)
        known = body.profile.fault(raw)
        body.fault = ActiveFault(raw, known.code if known else str(raw), persists)

    def _push(self, newest: int) -> None:
        registers = self._body.registers
        behind = (code for code in self._faults.history if code != self._faults.parameter)
        places = [self._body.profile[code] for code in behind]
        kept = [newest, *(registers.present(place) for place in places)]
        for place, value in zip(places, kept, strict=False):
            registers.put(place, value)

    def show(self) -> None:
        """Show the present fault, unless its word keeps the last one."""
        if self._faults.parameter and not self._faults.shows_last:
            fault = self._body.fault
            self._body.show_code(self._faults.parameter, fault.raw if fault else self._faults.none)
