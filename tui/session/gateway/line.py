"""One line of a gateway: its drives, who commands them, and which motors were started."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from tui.bus.api import ModbusLine
from tui.bus.errors import LineError
from tui.drive.chart import read_chart
from tui.drive.foreign_write import ExternalWord, WordKind, classify_words, stop_deciding_codes

from ..command.stop_report import StopSummary
from ..drive import DriveSession
from ..journal import Journal
from ..read.reader import Reader
from .commanding import GatewayCommanding
from .drives import GatewayDrives, Note
from .host_turns import HostTurns
from .in_turn import PendingWrites
from .resting import RestingDrives
from .started import StartedMotors

NONE_NAMED: Mapping[int, str] = MappingProxyType({})
STANDING_STILL = ("stopped", "ready", "blocked")


class GatewayLine:
    """One line of a gateway: its drives, and who commands them."""

    def __init__(
        self,
        line: ModbusLine,
        journal: Journal,
        note: Note = lambda *_: None,
        profiles: Mapping[int, str] = NONE_NAMED,
    ) -> None:
        self.line = line
        self.journal = journal
        self.drives = GatewayDrives(line, note, profiles)
        self.turns = HostTurns()
        self.pending = PendingWrites(line)
        self.started = StartedMotors(line, journal)
        self.resting = RestingDrives(line)
        self.commanding = GatewayCommanding(line, self._stands, self.started)

    async def close(self) -> StopSummary | None:
        """Leave the line alone; the results for motors that clients had started, None for none."""
        summary = await self.started.end()
        self.resting.close()
        self.commanding.close()
        self.drives.close()
        return summary

    async def identify_apart(
        self, host: str, session: DriveSession, words: Mapping[int, int]
    ) -> list[ExternalWord]:
        """Sort the words of a client by kind, by a read if necessary."""
        found = classify_words(session.profile, words, {})
        codes = tuple(stop_deciding_codes(session.profile, words))
        if not codes or not any(word.kind is WordKind.COMMAND for word in found):
            return found
        hurry = self.turns.may_hurry(host)
        read = partial(self.drives.read_deciding, session, codes, hurry=hurry)
        raws = await self.turns.deciding(host, (session.device, codes), read)
        found = classify_words(session.profile, words, raws)
        if not any(word.kind is WordKind.STOP for word in found):
            self.turns.note_in_vain(host)
        return found

    def keep_resting(self, session: DriveSession) -> None:
        """A drive has answered a client's stop: it must not trip while its motor rests."""
        if self.drives.known(session.device) is session:
            self.resting.keep(session)

    def sign(self, device: int) -> float | None:
        """When the client that started a motor was last heard (monotonic); None for no such motor.

        For any thread.
        """
        return self.commanding.last_sign(device) if self.started.holds(device) else None

    async def _stands(self, device: int) -> bool:
        """Return True if a motor is surely at standstill now, for another program that requests the
        drive."""
        session = self.drives.known(device)
        if session is None:
            return False
        codes = list(dict.fromkeys(chart.status for chart in session.profile.data.charts))
        try:
            await Reader(session).read(codes)
        except LineError:
            return False
        return read_chart(session.profile, session.image.fresh(2.0)).motion in STANDING_STILL
