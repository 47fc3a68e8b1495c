"""Number of writes to the EEPROM of each drive, by all programs of this computer, over years.

They are in one file of the state folder. The journal's thread adds to it, so that no caller waits
for the disk. A crash loses at most the writes that were not added yet; the file is always whole.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from tui.drive.small_file import read_small, replace_file

from .connect.line_key import line_key
from .journal_file import folder_turn
from .stored import make_folder

COUNTS_NAME = "eeprom-writes.json"
LONGEST_COUNTS = 8_000_000
"""Most bytes of the file."""
DRIVES_KEPT = 500
"""Drives in the file; the one that was written first goes first."""
COUNTED_DAY = 86400.0
TIMES_KEPT = 30
"""Times of the last day that are kept for each count."""

log = logging.getLogger(__name__)


class EepromWrite(NamedTuple):
    """One write to the EEPROM of a drive."""

    line: str
    device: int
    profile: str
    drive: str
    """Identity that the drive reports; empty if it reports none."""
    code: str
    """The parameter; empty if all settings were saved."""
    time: float
    """Seconds since 1970."""


class EepromTally(msgspec.Struct):
    """Number of writes since the first one."""

    count: int = 0
    first: float = 0.0
    """Seconds since 1970; as `last` and `times`."""
    last: float = 0.0
    times: list[float] = []
    """Writes of the last day, the newest last."""

    def add(self, time: float) -> None:
        """Count a write."""
        self.first = self.first or time
        self.count, self.last = self.count + 1, time
        self.times = [*self.within(COUNTED_DAY, time), time][-TIMES_KEPT:]

    def within(self, seconds: float, now: float) -> list[float]:
        """Return the times of the last writes; a clock that was set back counts no later ones."""
        return [time for time in self.times if now - seconds < time <= now]


class DriveCounts(msgspec.Struct):
    """The writes to the EEPROM of one drive."""

    line: str
    device: int
    profile: str
    drive: str = ""
    saves: EepromTally = msgspec.field(default_factory=EepromTally)
    writes: dict[str, EepromTally] = {}
    """By the code of the parameter."""

    def of(self, code: str) -> EepromTally:
        """Return the count of a parameter, or of all saves for an empty code."""
        return self.writes.get(code, EepromTally()) if code else self.saves

    @property
    def last(self) -> float:
        """The time of the last write, in seconds since 1970."""
        return max(count.last for count in (self.saves, *self.writes.values()))


class _Counts(msgspec.Struct):
    drives: list[DriveCounts] = []


class EepromCounts:
    """The file of a folder. Several programs may add to it; any thread may call."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / COUNTS_NAME

    def counts_of(self, line: str, device: int, profile: str, drive: str) -> DriveCounts:
        """Return the counts of a drive, all 0 if it is not in the file.

        Raises OSError, and ValueError for a damaged file.
        """
        key = line_key(line)
        found = _find(self._read(), key, device, profile, drive)
        return found or DriveCounts(key, device, profile, drive)

    def add(self, writes: Sequence[EepromWrite]) -> None:
        """Add writes, flushed to the disk. A damaged file is kept under another name.

        Raises OSError; then none of them was added.
        """
        make_folder(self.path.parent)
        with folder_turn(self.path.parent) as alone:
            if not alone:
                raise BlockingIOError("another program keeps the folder locked")
            try:
                drives = self._read()
            except ValueError as error:
                drives = []
                aside = self._set_aside()
                log.error("the counts of EEPROM writes begin again: %s, kept as %s", error, aside)
            for write in writes:
                _count(drives, write)
            drives.sort(key=lambda drive: drive.last)
            counts = msgspec.json.encode(_Counts(drives[-DRIVES_KEPT:]))
            replace_file(self.path, msgspec.json.format(counts, indent=1))

    def _read(self) -> list[DriveCounts]:
        try:
            data = read_small(self.path, LONGEST_COUNTS)
        except FileNotFoundError:
            return []
        return msgspec.json.decode(data, type=_Counts).drives

    def _set_aside(self) -> Path:
        number = 1
        while (aside := self.path.with_suffix(f".damaged{number}")).exists():
            number += 1
        return self.path.rename(aside)


def _count(drives: list[DriveCounts], write: EepromWrite) -> None:
    key = line_key(write.line)
    found = _find(drives, key, write.device, write.profile, write.drive)
    if found is None:
        found = DriveCounts(key, write.device, write.profile, write.drive)
        drives.append(found)
    found.drive = found.drive or write.drive
    count = found.writes.setdefault(write.code, EepromTally()) if write.code else found.saves
    count.add(write.time)


def _find(
    drives: Iterable[DriveCounts], key: str, device: int, profile: str, drive: str
) -> DriveCounts | None:
    """Return the drive with this identity at this place.

    A drive that reports no identity is the last one that was written there.
    """
    here = [d for d in drives if (d.line, d.device, d.profile) == (key, device, profile)]
    same = [d for d in here if drive in ("", d.drive)] or [d for d in here if not d.drive]
    return max(same, key=lambda d: d.last, default=None)
