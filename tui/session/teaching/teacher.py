"""Teaching the scales of one drive: read, store, and use them in its profile immediately."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Mapping
from decimal import Decimal

from tui.drive.errors import ValueRefused
from tui.drive.profile.profile import Profile
from tui.drive.sentences import all_of
from tui.drive.taught_profile import reference_of, why_no_reference, why_not_taught, with_taught
from tui.drive.teaching import DisplayLook, Lesson, TaughtScale, learn, parse_display, taught_by

from ..drive import DriveSession
from ..read.reader import Reader
from .kept import (
    TaughtDrive,
    TaughtLooks,
    TaughtNotKept,
    TaughtUnreadable,
    keep_taught,
    load_taught,
)

log = logging.getLogger(__name__)


class Teacher:
    """Learned scales of one drive. Only `look` reads the drive; other methods block on files."""

    def __init__(self, session: DriveSession) -> None:
        self.session = session
        self.trouble = ""
        """Why stored readings are not used or new ones not stored; empty if there is no error."""
        self._known = TaughtLooks()
        self._unkept = False
        """True if the file lacks some of the readings, because writing it failed."""
        self._lock = threading.Lock()

    @property
    def family(self) -> Profile:
        """The drive's profile without learned scales."""
        return self.session.family

    @property
    def scales(self) -> Mapping[str, TaughtScale]:
        """Current learned scales, by code."""
        return self.session.profile.taught

    @property
    def reference(self) -> str:
        """Code of the parameter that a person confirmed to take the reference; empty if none."""
        code = self._known.reference
        return code if code and not why_no_reference(self.family, code, self.scales) else ""

    def looks(self, code: str) -> tuple[DisplayLook, ...]:
        """Return the stored display readings of a parameter."""
        return self._known.looks.get(code, ())

    def recall(self) -> None:
        """Load the stored readings and use them; reports an unreadable file in `trouble`."""
        with self._lock:
            try:
                self._known, self.trouble = load_taught(self._drive()), ""
            except TaughtUnreadable as error:
                self.trouble = str(error)
                log.warning("%s", error)
            self._use()

    async def look(self, code: str, text: str, unit: str = "") -> Lesson:
        """Read a parameter, and store its word with the value that the drive's display shows.

        `text` is that value as typed. Raises ValueRefused if the parameter cannot be taught or read
        or the text is not a value, and the line's errors.
        """
        if why := why_not_taught(self.family, code):
            raise ValueRefused(why)
        shown = parse_display(text, unit)
        reading = (await Reader(self.session).read([code]))[code]
        if reading.raw is None:
            raise ValueRefused(f"{code} cannot be read: {reading.error}")
        return await asyncio.to_thread(self.take, code, reading.raw, *shown)

    def take(self, code: str, raw: int, shown: Decimal, unit: str) -> Lesson:
        """Add a display reading of a parameter, and store it."""
        with self._lock:
            before = self._latest().looks.get(code, ())
            lesson = learn(code, before, DisplayLook(raw & 0xFFFF, shown, unit))
            self._change({code: lesson.looks}, self._known.reference)
        return lesson

    def forget(self, code: str) -> bool:
        """Delete the readings of a parameter; return False if there were none."""
        with self._lock:
            if not self._latest().looks.get(code):
                return False
            self._change({code: ()}, self._known.reference)
            return True

    def confirm_reference(self, code: str) -> str:
        """Use a parameter for the reference, as a person confirmed; return a sentence about it.

        Raises ValueRefused if the parameter cannot take the reference.
        """
        with self._lock:
            self._latest()
            if why := why_no_reference(self.family, code, self._taught_scales()):
                raise ValueRefused(why)
            self._change({}, code)
        return f"{code} now takes the reference, in {self.scales[code].unit}."

    def drop_reference(self) -> None:
        """Stop using a taught parameter for the reference."""
        with self._lock:
            self._latest()
            self._change({}, "")

    def proposal(self) -> str:
        """Return a parameter that could take the reference if a person confirms it; else empty."""
        if self.reference:
            return ""
        ways = self.family.data.teachable_references
        scales = self.scales
        fit = (w.parameter for w in ways if not why_no_reference(self.family, w.parameter, scales))
        return next(fit, "")

    def _latest(self) -> TaughtLooks:
        """Return the readings from the file, because another program may have added some."""
        try:
            on_disk = load_taught(self._drive())
        except TaughtUnreadable:
            return self._known
        if not self._unkept:
            self._known = on_disk
        return self._known

    def _change(self, looks: Mapping[str, tuple[DisplayLook, ...]], reference: str) -> None:
        """Use and store the readings; a lost scale cancels the confirmation of its reference."""
        every = {**self._known.looks, **looks}
        self._known = TaughtLooks({c: kept for c, kept in every.items() if kept}, reference)
        self._use()
        if not self.reference:
            self._known = TaughtLooks(self._known.looks)
        try:
            keep_taught(self._drive(), self._known)
            self.trouble, self._unkept = "", False
        except TaughtNotKept as error:
            self.trouble, self._unkept = str(error), True
            log.warning("%s", error)

    def _use(self) -> None:
        """Set the session's profile to the family's profile with the learned scales."""
        self.session.learn(with_taught(self.family, self._taught_scales(), self._known.reference))

    def _taught_scales(self) -> dict[str, TaughtScale]:
        """Return the scales that follow from the readings, by code."""
        found = {code: taught_by(looks) for code, looks in self._known.looks.items()}
        return {code: scale for code, scale in found.items() if scale is not None}

    def _drive(self) -> TaughtDrive:
        session = self.session
        return TaughtDrive.of(session.line_text, session.device, self.family.id, session.identity)


def reference_asks(family: Profile, code: str) -> str:
    """Return the warning that a person must confirm before a parameter takes the reference."""
    way = reference_of(family, code)
    texts = [f"No available manual says that {code} takes this drive's reference."]
    if way is not None and way.bits:
        word = family.quantity("command_word")
        bits = all_of([f"bit {bit}" for bit in range(16) if way.bits >> bit & 1])
        word_name = word.code if word else "the command word"
        texts.append(f"Each run command then sets {bits} of {word_name}.")
    if way is not None and way.note:
        texts.append(way.note)
    texts.append("First try it where the motor may turn at any speed, and be ready to stop it.")
    return " ".join(texts)
