"""Teaching the scales of one drive: read, store, and use them in its profile immediately.

The state folder has one file per drive, named by line, address, profile and reported identity.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import logging
import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

from tui.drive.errors import DriveError, ValueRefused, ValueUndetermined
from tui.drive.profile.profile import Profile
from tui.drive.sentences import all_of
from tui.drive.small_file import read_small_text, replace_file
from tui.drive.taught_profile import reference_of, why_no_reference, why_not_taught, with_taught
from tui.drive.teaching import (
    LOOKS_KEPT,
    DisplayLook,
    Lesson,
    TaughtScale,
    learn,
    parse_display,
    taught_by,
)

from ..connect.identify import DriveIdentity
from ..connect.line_key import line_key
from ..drive import DriveSession
from ..paths import state_folder
from ..read.reader import Reader
from ..stored import make_folder

LONGEST = 200_000
"""Most bytes of such a file; a longer one is not read."""
_CODE = re.compile(r"[\x21-\x7e]{1,24}")


class TaughtUnreadable(DriveError):
    """The taught scales of a drive cannot be read."""


class TaughtNotKept(DriveError):
    """The taught scales of a drive cannot be written to the disk."""


@dataclass(frozen=True, slots=True)
class TaughtLooks:
    """Display readings by parameter code, and the parameter confirmed to take the reference."""

    looks: Mapping[str, tuple[DisplayLook, ...]] = field(default_factory=dict)
    reference: str = ""


@dataclass(frozen=True, slots=True)
class TaughtDrive:
    """Key of the file: the drive that the readings belong to."""

    line: str
    device: int
    profile: str
    stated: str
    """Its reported identity; empty if none."""

    @classmethod
    def of(
        cls, line_text: str, device: int, profile: str, identity: DriveIdentity | None
    ) -> TaughtDrive:
        """Return the key for a device on a line; equivalent spellings of the line are the same."""
        return cls(line_key(line_text), device, profile, identity.text if identity else "")

    @property
    def file(self) -> Path:
        """File of its taught scales."""
        readable = re.sub(r"[^A-Za-z0-9]+", "-", self.line).strip("-")[:40]
        own = _digest(self.stated) if self.stated else "unsaid"
        return _folder() / f"{readable}-{self.device}-{self.profile}-{self._place}-{own}.json"

    @property
    def _place(self) -> str:
        return _digest(repr((self.line, self.device, self.profile)))

    def found(self) -> Path | None:
        """Return the drive's file; None if there is none.

        If either the drive or the only file for its address has no identity, they match.
        """
        if self.file.exists():
            return self.file
        others = sorted(_folder().glob(f"*-{self._place}-*.json"))
        if self.stated:
            others = [path for path in others if path.stem.endswith("-unsaid")]
        return others[0] if len(others) == 1 else None


def load_taught(drive: TaughtDrive) -> TaughtLooks:
    """Return the stored readings of a drive; empty if there is no file. Raises TaughtUnreadable."""
    path = drive.found()
    if path is None:
        return TaughtLooks()
    try:
        return _looks_in(json.loads(read_small_text(path, LONGEST)))
    except (OSError, ValueError, RecursionError, ValueRefused) as error:
        raise TaughtUnreadable(
            f"The learned scales of this drive are not used: {path} cannot be read"
            f" ({_reason(error)}). Fix the file, or teach the scales again. The damaged file is"
            " then kept under another name."
        ) from error


def keep_taught(drive: TaughtDrive, kept: TaughtLooks) -> None:
    """Write the file completely or not at all; keep an unreadable file under another name.

    Raises TaughtNotKept.
    """
    path = drive.found() or drive.file
    try:
        make_folder(path.parent)
        _set_aside_if_damaged(drive, path)
        replace_file(path, json.dumps(_as_json(drive, kept), indent=1).encode())
    except OSError as error:
        raise TaughtNotKept(
            f"The learned scales are lost when this program ends: {path} cannot be written"
            f" ({error.strerror or error})."
        ) from error


def _set_aside_if_damaged(drive: TaughtDrive, path: Path) -> None:
    """Rename an unreadable file, so that the new one does not overwrite it."""
    try:
        load_taught(drive)
    except TaughtUnreadable:
        number = 1
        while (aside := path.with_suffix(f".damaged{number}")).exists():
            number += 1
        path.rename(aside)


def _as_json(drive: TaughtDrive, kept: TaughtLooks) -> dict[str, object]:
    return {
        "line": drive.line,
        "device": drive.device,
        "profile": drive.profile,
        "drive": drive.stated,
        "reference": kept.reference,
        "looks": {
            code: [
                {"raw": look.word, "shown": f"{look.shown:f} {look.unit}".strip()} for look in looks
            ]
            for code, looks in kept.looks.items()
            if looks
        },
    }


def _looks_in(reported: object) -> TaughtLooks:
    """Parse a file; raises ValueRefused if it holds anything else."""
    if not isinstance(reported, dict):
        raise ValueRefused("it is not a table")
    looks, reference = reported.get("looks"), reported.get("reference", "")
    if not isinstance(looks, dict) or not isinstance(reference, str):
        raise ValueRefused("`looks` or `reference` is missing or wrong")
    return TaughtLooks({_code(c): _looks_of(c, listed) for c, listed in looks.items()}, reference)


def _code(code: object) -> str:
    if not isinstance(code, str) or not _CODE.fullmatch(code):
        raise ValueRefused(f"{code!r} is not the code of a parameter")
    return code


def _looks_of(code: str, listed: object) -> tuple[DisplayLook, ...]:
    if not isinstance(listed, list) or len(listed) > LOOKS_KEPT:
        raise ValueRefused(f"the readings of {code} are not a list, or too many")
    return tuple(_look(code, item) for item in listed)


def _look(code: str, reported: object) -> DisplayLook:
    word, shown = (
        (reported.get("raw"), reported.get("shown")) if isinstance(reported, dict) else (None, None)
    )
    if type(word) is not int or not 0 <= word <= 0xFFFF or not isinstance(shown, str):
        raise ValueRefused(f"a reading of {code} lacks its raw word or the displayed value")
    return DisplayLook(word, *parse_display(shown))


def _reason(error: Exception) -> str:
    """Return the error in one line without a final full stop."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return str(error).splitlines()[0].rstrip(".")[:120] if str(error) else type(error).__name__


def _folder() -> Path:
    return state_folder() / "taught"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]


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
            raise ValueUndetermined(f"{code} cannot be read: {reading.error}")
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
                known = reference_of(self.family, code) is not None
                raise (ValueUndetermined if known else ValueRefused)(why)
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
