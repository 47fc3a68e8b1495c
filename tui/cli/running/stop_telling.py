"""Output of stops: a line for each drive, or one JSON document."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from msgspec import UNSET

from tui.session.connect.addresses import addresses_text

from ..shared.drive_commands import complain
from ..shared.errors import DONE
from ..shared.pending_timeouts import timeout_field
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.command.first_stop import SentFirst
    from tui.session.drive import DriveSession

    from ..documents.drive_documents import StopDocument
    from ..documents.parts import FirstWordField


class StopTelling:
    """Reports each drive as soon as it is known, and keeps all for JSON."""

    def __init__(self, line_text: str, *, as_json: bool) -> None:
        self.as_json = as_json
        self._line_text = line_text
        self.documents: list[StopDocument] = []
        self._first: dict[int, list[FirstWordField]] = {}

    def sent_first(self, device: int, sent: Sequence[SentFirst], says: str) -> None:
        """Report the word sent before a drive was identified, and its answer."""
        from ..documents.parts import FirstWordField

        for sent_word in sent:
            if not self.as_json:
                with suppress(OSError):
                    say(f"Device {device}: sent first {sent_word.text}; {says}.")
        self._first[device] = [
            FirstWordField(
                address=sent_word.what.address,
                word=sent_word.what.word,
                families=[family.id for family in sent_word.what.families],
                answer=sent_word.answer,
            )
            for sent_word in sent
        ]

    def stopped(self, session: DriveSession, text: str, *, may_coast: bool) -> None:
        """A motor is at standstill, or `may_coast` without current."""
        from tui.session.monitor.timeout import timeout_now

        if not self.as_json:
            with suppress(OSError):  # a reader that went away must not end the other stops
                say(text)
        self._keep(session.device, session.profile.id, text, DONE)
        self.documents[-1].may_coast = may_coast
        self.documents[-1].timeout = timeout_field(timeout_now(session))

    def failed(self, device: int, profile: str | None, text: str, status: int) -> None:
        """A motor is not known to be at standstill."""
        complain(text)
        self._keep(device, profile, text, status)

    def silent(self, devices: list[int], status: int) -> None:
        """Report addresses without an answer; a status other than 0 if a drive was expected."""
        if status:
            complain(f"NOT STOPPED: no answer at {', '.join(map(str, devices))}.")
        else:
            complain(f"No answer at {addresses_text(devices)}.")
        for device in devices if status else ():
            self._keep(device, None, "No answer.", status)

    def gave_back(self, text: str) -> None:
        """The control of the one drive was given back to its terminals."""
        if not self.as_json:
            say(text)
        self.documents[-1].given_back = text

    def _keep(self, device: int, profile: str | None, text: str, status: int) -> None:
        from ..documents.drive_documents import StopDocument

        self.documents.append(
            StopDocument(
                line=self._line_text,
                device=device,
                profile=profile,
                first=self._first.get(device, UNSET),
                stopped=not status,
                text=text,
                status=status,
            )
        )
