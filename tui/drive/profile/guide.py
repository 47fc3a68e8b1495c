"""Causes of a family's faults and alarms, by fault and by alarm bit."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from ..errors import ProfileError
from .schema import AlarmHelp, FaultHelp, HelpData, ProfileData


class FaultGuide:
    """Help of faults and alarms; its file is read on first use, not with the profile."""

    def __init__(self, profile: ProfileData, read: Callable[[], HelpData] | None = None) -> None:
        self._numbered = bool(profile.faults.codes)
        self._rows = HelpData(faults=list(profile.faults.help))
        self._read = read
        self.trouble = ""
        """Why its file could not be read; empty if it was read, or not needed yet."""

    @cached_property
    def data(self) -> HelpData:
        """All help; raises ProfileError if the file is wrong."""
        return self._read() if self._read is not None else self._rows

    @cached_property
    def _found(self) -> tuple[dict[int | None, FaultHelp], dict[tuple[str, int], AlarmHelp]]:
        """Help by raw fault, and by word and bit; empty, without an error, if the file is wrong."""
        try:
            reported = self.data
        except ProfileError as error:
            self.trouble = str(error).partition("\n")[0]
            reported = self._rows
        return {fault.raw: fault for fault in reported.faults}, {
            (a.word, a.bit): a for a in reported.alarms
        }

    def fault(self, raw: int | None) -> FaultHelp | None:
        """Return the help on a fault by its raw code; None if nothing is known.

        A family whose trips have no numbers has one help for all of them, that of None.
        """
        return self._found[0].get(raw if self._numbered else None)

    def alarm(self, word: str, bit: int) -> AlarmHelp | None:
        """Return the help on an alarm bit; None if nothing is known."""
        return self._found[1].get((word, bit))
