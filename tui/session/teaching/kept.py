"""File with the display readings that were taught for one drive; its scales follow from them.

The state folder has one file per drive, named by line, address, profile and reported identity.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from tui.drive.errors import DriveError, ValueRefused
from tui.drive.small_file import read_small_text
from tui.drive.teaching import LOOKS_KEPT, DisplayLook, parse_display

from ..connect.line_key import line_key
from ..paths import state_folder
from ..stored import make_folder

if TYPE_CHECKING:
    from ..connect.identify import DriveIdentity

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
        part = path.with_suffix(f".{os.getpid()}.part")
        try:
            with part.open("w", encoding="utf-8") as file:
                json.dump(_as_json(drive, kept), file, indent=1)
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
        finally:
            with suppress(OSError):
                part.unlink(missing_ok=True)
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
