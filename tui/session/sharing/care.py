"""Drives that programs on a line have armed, with the data that their owner needs to stop them."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import msgspec

from tui.bus.api import ModbusLine
from tui.bus.line_events import LineEvent, WriteAbandoned
from tui.bus.link import label
from tui.bus.requests import Request
from tui.bus.shared_state import accepts_any_care
from tui.drive.errors import DriveError
from tui.drive.profile.profile import Profile, unpacked_profile
from tui.wire.frames import at_place, raw_of_words, written_text

from ..drive import CareData, DriveSession
from ..journal import Entry, Journal, now_text

if TYPE_CHECKING:
    from tui.bus.model import Reply
    from tui.bus.program import Program

log = logging.getLogger(__name__)

MOST_PROFILES = 16
"""Unpacked profiles that are kept for further drives of their family."""


class DrivesInCare:
    """Keeps a session for each of them, and records writes whose program has ended.

    Its methods are called in the line's thread.
    """

    def __init__(
        self,
        line: ModbusLine,
        journal: Journal,
        session_of: Callable[[int], DriveSession | None] = lambda _: None,
    ) -> None:
        """`session_of` returns the session of a drive that this program itself has open."""
        self._session_of = session_of
        self._line = line
        self._journal = journal
        self._profiles: dict[bytes, Profile] = {}
        self._sessions: dict[int, tuple[bytes, DriveSession]] = {}
        line.facts.accepts_care = self._registered
        self._unsubscribe = line.facts.events.subscribe(self._hear)

    def close(self) -> None:
        """Accept no further drives, and end the subscription."""
        self._line.facts.accepts_care = accepts_any_care
        self._unsubscribe()

    def session(self, device: int) -> DriveSession | None:
        """Return the drive with the profile of the program that armed it last; None if none did."""
        _, session = self._sessions.get(device, (b"", None))
        return session

    def _registered(self, device: int, care: bytes) -> bool:
        """Store the data of a program that arms a drive; return False if they cannot be used."""
        before, _ = self._sessions.get(device, (b"", None))
        if before == care or self._session_of(device) is not None:
            return True
        try:
            data = msgspec.msgpack.decode(care, type=CareData)
            profile = self._profiles.get(data.profile) or unpacked_profile(data.profile)
            session = DriveSession(self._line, device, profile, data.identity)
        except (msgspec.MsgspecError, DriveError, ValueError) as error:
            log.error("drive %s cannot be taken into care: %s", device, error)
            return False
        except Exception:
            # only the sender has checked the profile, so decoding it may raise anything
            log.exception("drive %s cannot be taken into care", device)
            return False
        session.guessed = data.guessed
        if len(self._profiles) >= MOST_PROFILES:
            self._profiles.clear()
        self._profiles[data.profile] = profile
        self._sessions[device] = (care, session)
        return True

    # Writes of programs that have ended

    def _hear(self, event: LineEvent) -> None:
        match event:
            case WriteAbandoned(program, request, answer):
                entry = self._entry(program, request)
                if entry is not None:
                    answer.add_done_callback(partial(self._keep, entry))

    def _keep(self, entry: Entry, answer: Future[Reply]) -> None:
        if answer.cancelled():
            return  # the write was not sent
        error = answer.exception()
        self._journal.add(replace(entry, answer="ok" if error is None else str(error)))

    def _entry(self, program: Program, request: Request) -> Entry | None:
        place, words = request.written
        if not words:
            return None
        function, address = at_place(place)
        session = self.session(request.device)
        parameter = session.profile.at(address, function) if session is not None else None
        return Entry(
            time=now_text(),
            line=label(self._line.link),
            device=request.device,
            profile=session.profile.id if session is not None else "",
            code=parameter.code if parameter is not None else str(address),
            address=address,
            old_raw=None,
            old="",
            new_raw=raw_of_words(place, words),
            new=written_text(place, words),
            answer="",
            read_back=None,
            why=f"sent for {program.text}, which has ended",
        )
