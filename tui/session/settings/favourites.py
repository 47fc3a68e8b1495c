"""Parameters that a person marked, confirmed or edited lately; kept in the state folder."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ..paths import state_folder

RECENT_KEPT = 30


@dataclass(frozen=True, slots=True)
class Marks:
    """Codes of one drive family."""

    favourites: tuple[str, ...] = ()
    confirmed: tuple[str, ...] = ()
    """Unverified parameters whose address a person has compared with the keypad."""
    recent: tuple[str, ...] = ()
    """The last edited first."""

    def toggled(self, code: str) -> Marks:
        """With a favourite more, or less."""
        if code in self.favourites:
            return replace(self, favourites=tuple(c for c in self.favourites if c != code))
        return replace(self, favourites=(*self.favourites, code))

    def with_confirmed(self, code: str) -> Marks:
        """With one more confirmed."""
        return replace(self, confirmed=tuple(dict.fromkeys((*self.confirmed, code))))

    def edited(self, codes: Iterable[str]) -> Marks:
        """With these edited last."""
        return replace(self, recent=tuple(dict.fromkeys((*codes, *self.recent)))[:RECENT_KEPT])


def load_marks(profile_id: str) -> Marks:
    """What was kept; nothing where the file is missing or damaged."""
    try:
        told = json.loads(_file(profile_id).read_text(encoding="utf-8"))
        return Marks(**{key: tuple(map(str, told.get(key, ()))) for key in asdict(Marks())})
    except (OSError, ValueError, TypeError, AttributeError):
        return Marks()


def save_marks(profile_id: str, marks: Marks) -> None:
    """Keep them; a folder that cannot be written is no error."""
    file = _file(profile_id)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part")
        part.write_text(json.dumps(asdict(marks), indent=1), encoding="utf-8")
        part.replace(file)
    except OSError:
        return


def _file(profile_id: str) -> Path:
    return state_folder() / f"marks-{profile_id}.json"
