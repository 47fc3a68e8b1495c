"""Notes about the contents of a drive's block, for the recorder of the line."""

from __future__ import annotations

import json
from collections.abc import Mapping

from tui.bus.notes import LineNote
from tui.drive.read_plan import block_places

from ..drive import DriveSession
from ..event_notes import BLOCK_OF_DRIVE
from ..read.reader import Reader


class BlockNotes:
    """Has the recorder know which parameters are in a block: its words do not show that."""

    def __init__(self, session: DriveSession, reader: Reader) -> None:
        self._session, self._reader = session, reader
        self._noted: Mapping[int, str] = {}

    def note(self, *, used: bool) -> None:
        """Note the code in each register if that has changed; from the first use on."""
        if not used and not self._noted:
            return
        session = self._session
        places = block_places(session.profile, self._reader.in_force)
        if places != self._noted:
            self._noted = places
            # with its time: an equal note of before would not be recorded again
            data = json.dumps({"places": places, "since": session.clock.wall()}).encode()
            session.line.facts.notes.leave(LineNote(session.device, BLOCK_OF_DRIVE, data))
