"""GhostRecord drives as ghosts on a simulated line."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from tui.drive.errors import DriveError
from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile
from tui.drive.sentences import all_of
from tui.simulator.ghost import GhostDrive, RecordedExchange

from .reader import ROWS_AT_A_TIME
from .replay_reader import ReplayReader
from .schema import GOOD, RECORDED_READS, REFUSED, SILENT, RecordDamaged, ReplyRow, read_reply

DAMAGED, WRONG = 3, 4
WITHOUT_REPLY = (SILENT, DAMAGED, WRONG)
"""Qualities of exchanges that brought no valid reply."""
ILLEGAL_ADDRESS = 2
"""Exception of a refusal whose own the record does not have."""
_WRITE_ONE, _WRITE_MANY = 6, 16


class GhostError(DriveError):
    """A file has no recorded drive to simulate."""


class GhostRecord(NamedTuple):
    """A drive in a record."""

    path: Path
    device: int
    profile: Profile | None
    """None if the record names none, or it is not installed."""
    begun: float
    """Time of the first exchange, in s since 1970."""
    exchanges: tuple[RecordedExchange, ...]

    def ghost(self, *, repeats: bool, report: Callable[[str], None]) -> GhostDrive:
        """Return the ghost of the drive."""
        return GhostDrive(self.device, self.exchanges, self.profile, repeats=repeats, report=report)

    @property
    def text(self) -> str:
        """The drive, and the time and length of its record."""
        name = self.profile.name if self.profile else "an unknown drive"
        begun = datetime.fromtimestamp(self.begun).astimezone().isoformat(timespec="seconds")
        last = self.exchanges[-1]
        return f"{name} of {begun}, {last.at + last.took:.0f} s"


class GhostReader(ReplayReader):
    """The queries of a ghost."""

    def exchanges(self, device: int) -> Iterator[tuple[str, ReplyRow]]:
        """Yield every whole exchange with a device in its order, with the boot of its time."""
        columns = ", ".join(f"reply.{name}" for name in ReplyRow._fields[:-1])
        last = 0
        while True:
            rows = self._base.execute(
                f"SELECT reply.id, boot, {columns} FROM reply JOIN session ON session.id = session"
                " WHERE device = ? AND reply.id > ? ORDER BY reply.id LIMIT ?",
                (device, last, ROWS_AT_A_TIME),
            ).fetchall()
            for _, boot, *values in rows:
                yield boot, ReplyRow._make((*values, ""))
            if len(rows) < ROWS_AT_A_TIME:
                return
            last = rows[-1][0]


def read_recorded(text: str) -> GhostRecord:
    """Read the drive of `FILE@ADDRESS` from a record. Raises GhostError.

    Only rows of whole replies are used: values that were reduced are not those of one moment.
    """
    name, sign, address = text.rpartition("@")
    if not sign or not address.isdecimal() or not 1 <= int(address) <= 247:
        raise GhostError(f"{text!r}: write FILE@ADDRESS, for example record.sqlite@2.")
    path, device = Path(name), int(address)
    if not path.is_file():
        raise GhostError(f"{name} is not a file.")
    try:
        with closing(GhostReader(path)) as reader:
            rows = list(reader.exchanges(device))
            named = reader.notes_of(device, "profile")
            known = reader.devices()
    except (sqlite3.Error, RecordDamaged) as error:
        raise GhostError(f"{name} cannot be read: {error}.") from None
    exchanges = tuple(_exchanges(rows))
    if not exchanges:
        found = all_of([str(number) for number in known])
        raise GhostError(f"{name} has no whole replies of drive {device}. Its drives: {found}.")
    begun = rows[0][1].utc / 1e6
    return GhostRecord(path, device, _profile(named), begun, exchanges)


def _profile(named: list[tuple[int, str]]) -> Profile | None:
    """Return the profile that a record names last; None if there is none of that name."""
    for _, text in reversed(named):
        try:
            return load(str(json.loads(text)["profile"]))
        except (DriveError, OSError, ValueError, KeyError, TypeError):
            continue
    return None


def _exchanges(rows: list[tuple[str, ReplyRow]]) -> Iterator[RecordedExchange]:
    """Yield the exchanges with their times since the first one, over restarts of the computer."""
    offsets: dict[str, int] = {}
    end = utc = 0
    for boot, row in rows:
        if boot not in offsets:
            pause = max(0, row.utc - utc) if offsets else 0
            offsets[boot] = end + pause - row.mono
        at = max(0, row.mono + offsets[boot])
        end, utc = max(end, at), row.utc
        request = _request(row)
        if request is not None and row.quality in (GOOD, REFUSED, *WITHOUT_REPLY):
            yield RecordedExchange(at / 1e6, row.took / 1e6, request, _reply(row, request))


def _request(row: ReplyRow) -> bytes | None:
    """Return function and data of a request; None if the record does not have it."""
    if row.sent is not None:
        return row.sent
    if row.address is None:
        return None
    head = bytes([row.function]) + row.address.to_bytes(2, "big")
    if row.function in RECORDED_READS:
        return head + row.registers.to_bytes(2, "big")
    if row.function == _WRITE_ONE and row.words:
        return head + row.words
    if row.function == _WRITE_MANY and row.words:
        return head + row.registers.to_bytes(2, "big") + bytes([len(row.words)]) + row.words
    return None


def _reply(row: ReplyRow, request: bytes) -> bytes | None:
    """Return function and data of the reply; None if no valid one came."""
    if row.quality in WITHOUT_REPLY:
        return None
    if row.received is not None:
        return row.received
    if row.quality == REFUSED:
        return bytes([row.function | 0x80, ILLEGAL_ADDRESS])
    if row.function in (_WRITE_ONE, _WRITE_MANY):
        return request[:5]
    if row.words is None:
        return None
    return read_reply(row.function, row.words)
