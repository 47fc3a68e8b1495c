"""One line of a gateway: its drives, who commands them, and which motors were started."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Collection, Coroutine, Hashable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, TypeVar

from tui.bus.api import ModbusLine
from tui.bus.errors import LineError
from tui.bus.gateway.talk import TcpClient
from tui.bus.stop_counts import next_count
from tui.drive.chart import read_chart
from tui.drive.foreign_write import ExternalWord, WordKind, classify_words, stop_deciding_codes

from ..command.stop_report import StopSummary
from ..drive import DriveSession
from ..journal import Journal
from ..read.reader import Reader
from .commanding import GatewayCommanding
from .drives import GatewayDrives, Note
from .resting import RestingDrives
from .started import StartedMotors

NONE_NAMED: Mapping[int, str] = MappingProxyType({})
STANDING_STILL = ("stopped", "ready", "blocked")


class GatewayLine:
    """One line of a gateway, with its drives and its clients; for the gateway's loop."""

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
        """Stop the motors that clients have started, then end; None if there were none."""
        summary = await self.started.end()
        self.resting.close()
        self.commanding.close()
        self.drives.close()
        return summary

    async def identify_apart(
        self, host: str, session: DriveSession, words: Mapping[int, int]
    ) -> list[ExternalWord]:
        """Classify the words of a client; read what that depends on if necessary."""
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
        """Poll a drive whose motor a client has stopped, so that it does not trip at standstill."""
        if self.drives.known(session.device) is session:
            self.resting.keep(session)

    def sign(self, device: int) -> float | None:
        """Return when the client that started a motor last sent a request (monotonic).

        None if no client has started it. For any thread.
        """
        return self.commanding.last_sign(device) if self.started.holds(device) else None

    async def _stands(self, device: int) -> bool:
        """Read the state for a program that requests the drive; True if at standstill."""
        session = self.drives.known(device)
        if session is None:
            return False
        try:
            await Reader(session).read(session.profile.data.status_codes)
        except LineError:
            return False
        return read_chart(session.profile, session.image.fresh(2.0)).motion in STANDING_STILL


T = TypeVar("T")

READS_EACH_HOST = 8
"""Reads of the clients of one host that wait for the line at once."""


READING, DECIDING, STOPPING = "read", "read before a stop", "stop"
SLOTS = {READING: READS_EACH_HOST, DECIDING: 1, STOPPING: 1}
MOST_IN_VAIN, IN_VAIN_LASTS = 5, 10.0
"""Words of a host that proved not to be a stop, in so many seconds, before its reads wait."""


class HostTurns:
    """Turns of the hosts of clients on one line: one stop at a time each, and a few reads.

    So a host that floods the line with requests does not delay a stop of another one. A stop waits
    only for the read that precedes it. For one loop.
    """

    def __init__(self) -> None:
        self._slots: dict[tuple[str, str], tuple[asyncio.Semaphore, int]] = {}
        """By host and kind of request, with the number of users."""
        self._waiting: dict[tuple[str, Hashable], asyncio.Future[Any]] = {}
        """Stops, and reads before them, that were not sent yet."""
        self._in_vain: dict[str, deque[float]] = {}
        """By host, the times of reads for words that proved not to be a stop."""

    @asynccontextmanager
    async def reading(self, host: str) -> AsyncIterator[None]:
        """Wait for the turn of a read."""
        async with self._slot(host, READING):
            yield

    @asynccontextmanager
    async def _slot(self, host: str, kind: str) -> AsyncIterator[None]:
        which = host, kind
        slots, users = self._slots.get(which, (asyncio.Semaphore(SLOTS[kind]), 0))
        self._slots[which] = slots, users + 1
        try:
            async with slots:
                yield
        finally:
            slots, users = self._slots.pop(which)
            if users > 1:
                self._slots[which] = slots, users - 1

    def may_hurry(self, host: str) -> bool:
        """Return False if too many words of this host proved not to be a stop.

        Then the reads before its stops have the priority of commands.
        """
        last = self._in_vain.get(host, deque[float]())
        now = asyncio.get_running_loop().time()
        return len(last) < MOST_IN_VAIN or now - last[0] > IN_VAIN_LASTS

    def note_in_vain(self, host: str) -> None:
        """Count a read of this host for a word that proved not to be a stop."""
        now = asyncio.get_running_loop().time()
        self._in_vain = {h: t for h, t in self._in_vain.items() if now - t[-1] <= IN_VAIN_LASTS}
        self._in_vain.setdefault(host, deque(maxlen=MOST_IN_VAIN)).append(now)

    async def deciding(
        self, host: str, codes: Hashable, read: Callable[[], Coroutine[Any, Any, T]]
    ) -> T:
        """Read what identifies a stop, in the turn of its host; equal reads share one request."""
        return await self._shared(host, DECIDING, codes, read)

    async def stopping(
        self, host: str, word: Hashable, send: Callable[[], Coroutine[Any, Any, T]]
    ) -> T:
        """Send a stop in the turn of its host; equal stops that wait share one frame."""
        return await self._shared(host, STOPPING, word, send)

    async def _shared(
        self, host: str, kind: str, what: Hashable, send: Callable[[], Coroutine[Any, Any, T]]
    ) -> T:
        which = host, (kind, what)
        while (first := self._waiting.get(which)) is not None:
            try:
                shared: T = await asyncio.shield(first)
                return shared
            except asyncio.CancelledError:
                task = asyncio.current_task()
                if not first.cancelled() or (task is not None and task.cancelling()):
                    raise
        mine = self._waiting[which] = asyncio.get_running_loop().create_future()
        try:
            async with self._slot(host, kind):
                del self._waiting[which]  # a later one is sent as well
                mine.set_result(await send())
        except Exception as error:
            mine.set_exception(error)
            mine.exception()  # marks it as retrieved, because perhaps no other one waits
            raise
        finally:
            if self._waiting.get(which) is mine:
                del self._waiting[which]
            mine.cancel()
        done: T = mine.result()
        return done


@dataclass(slots=True, eq=False)
class PendingWrite:
    """A write of a client that is not answered yet."""

    client: TcpClient
    device: int
    words: Mapping[int, int]
    """Words to write, by register."""
    stops: int
    """Stop count of the device when it arrived: a later stop cancels it."""


class PendingWrites:
    """Writes to the drives of one line in the order of their arrival; for one loop."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._pending: list[PendingWrite] = []

    def came(self, client: TcpClient, device: int, words: Mapping[int, int]) -> PendingWrite:
        """Add a write that has arrived."""
        write = PendingWrite(client, device, words, self._line.facts.stops.stamp(device))
        self._pending.append(write)
        return write

    def ended(self, write: PendingWrite) -> None:
        """Remove a write that was answered."""
        self._pending.remove(write)

    def stops_by(self, write: PendingWrite) -> None:
        """Keep later writes of the same client valid after this one has stopped the drive."""
        at = self._pending.index(write)
        for pending_write in self._pending[at:]:
            if pending_write.client is write.client and pending_write.device == write.device:
                pending_write.stops = next_count(pending_write.stops)

    def void(self, write: PendingWrite) -> bool:
        """Return True if its drive was stopped since it arrived."""
        return write.stops != self._line.facts.stops.stamp(write.device)

    def changes_before(self, write: PendingWrite, registers: Collection[int]) -> bool:
        """Return True if an earlier write of its client to one of these registers still waits."""
        before = self._pending[: self._pending.index(write)]
        return any(
            pending_write.client is write.client and pending_write.device == write.device
            and not pending_write.words.keys().isdisjoint(registers)
            for pending_write in before
        )  # fmt: skip
