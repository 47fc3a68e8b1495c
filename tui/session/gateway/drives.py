"""Drives of a line, identified when a client first sends a request to their address."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import inf

from tui.bus.api import LineStatus, ModbusLine, Priority
from tui.bus.errors import BytesSwapped, LineError
from tui.bus.limits import MAX_READ, Limits
from tui.bus.line_events import LineEvent, StateChanged
from tui.drive.foreign_write import WordKind, classify_words
from tui.drive.orders import chart_codes
from tui.drive.profile import library
from tui.drive.values import from_words, word_count
from tui.safety import CHART_AGE

from ..connect.contradiction import own_words
from ..connect.identify import DriveIdentity, identify_drive
from ..connect.known_lines import line_name, load_memory
from ..drive import DriveSession
from ..read.order_check import check_byte_order
from ..read.reader import Reader

log = logging.getLogger(__name__)

READ_THROUGH = Limits(
    functions=frozenset({1, 2, 3, 4, 17, 43}),
    max_read=MAX_READ,
    max_read_1=MAX_READ,
    max_read_2=MAX_READ,
    max_read_4=MAX_READ,
    max_write=0,
    max_read_23=0,
    max_write_23=0,
)
"""Limits of a device without a profile, which may not be a drive: reads pass unchanged."""
WHO_AGAIN_AFTER = 30.0
"""Seconds after which an unidentified drive is identified again."""

CHART_READ_EACH = 1.5
"""Seconds after which the word that selects the chart is read again for a client."""

Note = Callable[[int, DriveIdentity | None, str], None]
"""Called with a device, the identity that it reports, and its profile."""


class GatewayDrives:
    """Drives of one line, for one loop; after a loss of the line, others may be connected."""

    def __init__(self, line: ModbusLine, note: Note, named: Mapping[int, str]) -> None:
        self.line = line
        self._named = named
        """Profiles that a person has named, by device."""
        self._note = note
        self._found: dict[int, DriveSession | None] = {}
        self._losses = 0
        """Number of losses of the line; the only field that is changed in the line's thread."""
        self._sure: dict[int, int] = {}
        """By device, the losses when it was identified; no entry if it was silent since."""
        self._candidates: dict[int, tuple[str, ...]] = {}
        """By device, the families of which an unidentified one may be."""
        self._requested: dict[int, tuple[int, float]] = {}
        """By device, the losses and the time of its last identification."""
        self._tasks: dict[int, asyncio.Task[DriveSession | None]] = {}
        self._charts: dict[int, float] = {}
        """By device, the time when the word that selects the chart was last read."""
        self._reads: set[asyncio.Task[None]] = set()
        self._unsubscribe = line.facts.events.subscribe(self._hear)

    def close(self) -> None:
        """End the subscription, and cancel identifications and reads."""
        self._unsubscribe()
        for task in (*self._tasks.values(), *self._reads):
            task.cancel()

    def known(self, device: int) -> DriveSession | None:
        """Return the drive as identified last, or None; allow reads of an unknown device."""
        if device not in self._found:
            self._found[device] = None
            self.line.describe(device, READ_THROUGH)
        return self._found[device]

    def find_out(self, device: int) -> None:
        """Begin to identify a device that answers; every WHO_AGAIN_AFTER at most."""
        sure = self.known(device) is not None and self._is_sure(device)
        if not sure and device not in self._tasks:
            losses, since = self._requested.get(device, (-1, 0.0))
            now = asyncio.get_running_loop().time()
            if losses != self._losses or now - since >= WHO_AGAIN_AFTER:
                self._begin(device)

    async def found(self, device: int) -> DriveSession | None:
        """Return the drive, identified now if necessary; None if no profile fits.

        Raises the line's errors.
        """
        session = self.known(device)
        while session is None or not self._is_sure(device):
            task = self._tasks.get(device) or self._begin(device)
            session = await asyncio.shield(task)
            if session is None:
                break
        return session

    def _is_sure(self, device: int) -> bool:
        """Return False if another drive may have the address since the identification."""
        return self._sure.get(device) == self._losses

    def stoppable(self, device: int, words: Mapping[int, int]) -> DriveSession | None:
        """Return a session of an unidentified drive if the words stop all its candidate families.

        Its profile is one of the candidates.
        """
        profiles = [library.load(id) for id in self._candidates.get(device, ())]
        stops = all(
            word.kind is WordKind.STOP
            for profile in profiles
            for word in classify_words(profile, words, {})
        )
        return DriveSession(self.line, device, profiles[0]) if profiles and stops else None

    def unknown_again(self, device: int) -> None:
        """Allow only reads of an unidentified drive again, after its stop was sent."""
        self._take(device, None, self._losses)

    def doubt(self, device: int) -> None:
        """Identify a silent device again before anything but a stop is written to it."""
        self._sure.pop(device, None)
        self._requested.pop(device, None)

    async def read_deciding(
        self, session: DriveSession, codes: Sequence[str], *, hurry: bool
    ) -> Mapping[str, int]:
        """Read raw values, with the priority of a stop if in a `hurry`.

        Values that cannot be read are missing.
        """
        priority = Priority.STOP if hurry else Priority.OPERATOR_WRITE
        chart, raws = chart_codes(session.profile), {}
        for code in codes:
            # a state may have changed already; the active chart changes only by a write
            age = CHART_AGE if code in chart else 0.0
            try:
                raws[code] = await self._read_raw(session, code, priority, age)
            except LineError as error:
                log.info("%s, which selects the stop word, was not read: %s", code, error)
        return raws

    async def _read_raw(
        self, session: DriveSession, code: str, priority: Priority, max_age: float
    ) -> int:
        """Read one word, or use a reply to any program of the last `max_age` seconds.

        Raises the line's errors.
        """
        parameter = session.profile.find(code)
        reply = await self.line.read(
            session.device, parameter.address, word_count(parameter),
            priority=priority, function=parameter.function, max_age=max_age,
        )  # fmt: skip
        return from_words(parameter, reply.words)

    def keep_chart_known(self, device: int) -> None:
        """Read the word that selects the chart from time to time while a client sends requests.

        So a stop does not have to wait for that read.
        """
        session = self._found.get(device)
        codes = chart_codes(session.profile) if session is not None else []
        now = asyncio.get_running_loop().time()
        if session is None or not codes or now - self._charts.get(device, -inf) < CHART_READ_EACH:
            return
        self._charts[device] = now
        task = asyncio.create_task(self._read_chart(session, codes), name=f"chart of {device}")
        self._reads.add(task)
        task.add_done_callback(self._reads.discard)

    async def _read_chart(self, session: DriveSession, codes: list[str]) -> None:
        with suppress(LineError):
            for code in codes:
                await self._read_raw(session, code, Priority.POLL, CHART_READ_EACH)

    def _hear(self, event: LineEvent) -> None:
        if isinstance(event, StateChanged) and event.state.status is not LineStatus.CONNECTED:
            self._losses += 1

    def _begin(self, device: int) -> asyncio.Task[DriveSession | None]:
        loop = asyncio.get_running_loop()
        self._requested[device] = self._losses, loop.time()
        task = loop.create_task(self._identify(device), name=f"identify {device}")
        self._tasks[device] = task
        task.add_done_callback(lambda done: self._ended(device, done))
        return task

    def _ended(self, device: int, task: asyncio.Task[DriveSession | None]) -> None:
        self._tasks.pop(device, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            log.info("device %s was not identified: %s", device, error)

    async def _identify(self, device: int) -> DriveSession | None:
        named, losses = self._named.get(device), self._losses
        identity: DriveIdentity | None
        if named is not None:
            identity = await own_words(self.line, device, library.load(named))
        else:
            identity = await identify_drive(self.line, device, priority=self._patience(device))
            named = identity.profile or await asyncio.to_thread(self._remembered, device, identity)
        if not named:
            self._candidates[device] = identity.candidates if identity is not None else ()
            return self._take(device, None, losses)
        profile = await asyncio.to_thread(library.load, named)
        session = DriveSession(self.line, device, profile, identity)
        if session.contradiction:
            log.warning("%s Clients can only read it.", session.contradiction)
            return self._take(device, None, losses)
        try:
            await check_byte_order(Reader(session), self._patience(device))
        except BytesSwapped as error:
            log.warning("%s Clients can only read and stop it.", error)
            self._candidates[device] = (profile.id,)
            return self._take(device, None, losses)
        self._note(device, identity, profile.id)
        return self._take(device, session, losses)

    def _take(self, device: int, session: DriveSession | None, losses: int) -> DriveSession | None:
        if session is None:
            self.line.describe(device, READ_THROUGH)
        self._found[device], self._sure[device] = session, losses
        return session

    def _patience(self, device: int) -> Priority:
        """Return the priority of reads; a device that never answered gets a shorter wait."""
        heard = self.line.device_state(device).heard
        return Priority.OPERATOR_READ if heard is not None else Priority.BACKGROUND

    def _remembered(self, device: int, identity: DriveIdentity) -> str:
        """Return the profile of an unidentified drive when the line was last used; may be empty."""
        if identity.reference:
            return ""
        key = line_name(self.line.link).key
        mark = load_memory().lines.get(key) if key else None
        drive = mark.drives.get(device) if mark is not None else None
        if drive is None or any(drive.stated) or not drive.profile:
            return ""
        fits = not identity.candidates or drive.profile in identity.candidates
        return drive.profile if fits else ""
