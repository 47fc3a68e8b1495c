"""Commands given to a drive by this program: its reference, its command words, their state."""

from __future__ import annotations

from ..drive import DriveSession
from .reference import Reference


class CommandHistory:
    """State kept from one command to the next."""

    def __init__(self, session: DriveSession) -> None:
        self._session = session
        self._wanted: Reference | None = None
        self.reference_text = ""
        """The result of the last reference that was given, for a person."""
        self._written: dict[str, int] = {}
        self._written_under = 0
        """The count of stops under which they were written."""

    @property
    def wanted(self) -> Reference | None:
        """The reference that was given last."""
        return self._wanted

    def note_reference(self, reference: Reference, text: str) -> None:
        """A reference was given; `text` is the result, for a person."""
        self._wanted, self.reference_text = reference, text

    def forget_reference(self) -> None:
        """The drive has put it back: nothing may send it again."""
        self._wanted = None

    def note_command(self, code: str, word: int) -> None:
        """A command word was written: it is watched from now on."""
        self._written, self._written_under = {code: word}, self._session.work.stops
        self._session.followed = (code,)

    def note_option(self, code: str, word: int) -> None:
        """Option bits of a command word were written."""
        if code in self._written:
            self._written[code] = word

    def forget_words(self) -> None:
        """Others command the drive now: words of another channel say nothing any more."""
        self._written = {}

    def lost_orders(self) -> str:
        """Return the values written by this program that the drive no longer holds, or nothing.

        Nothing behind a stop from here, which wrote another word itself.
        """
        if self._written_under != self._session.work.stops:
            return ""
        lost = self.changed_words()
        return f"Reset, switched off or commanded by others: {lost}." if lost else ""

    def changed_words(self) -> str:
        """The command words that the drive holds otherwise than they were written from here."""
        known = self._session.image.raws
        return ", ".join(
            f"{code} 16#{raw:04X} is now 16#{known[code] & 0xFFFF:04X}"
            for code, raw in self._written.items()
            if code in known and known[code] & 0xFFFF != raw
        )
