"""Parameters that a person marked, confirmed or edited lately; kept in the state folder."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ..paths import state_folder
from ..stored import store_json, stored_json

RECENT_KEPT = 30
STORED_KEYS = {"favorites": "favourites", "confirmed": "confirmed", "recent": "recent"}
"""Key in the stored file by field; files of earlier versions have the same keys."""


@dataclass(frozen=True, slots=True)
class Marks:
    """Marked codes of one drive family."""

    favorites: tuple[str, ...] = ()
    confirmed: tuple[str, ...] = ()
    """Unverified parameters whose address a person has compared with the keypad."""
    recent: tuple[str, ...] = ()
    """The last edited first."""

    def toggled(self, code: str) -> Marks:
        """Return marks with a code added to the favorites, or removed."""
        if code in self.favorites:
            return replace(self, favorites=tuple(c for c in self.favorites if c != code))
        return replace(self, favorites=(*self.favorites, code))

    def with_confirmed(self, code: str) -> Marks:
        """Return marks with a code added to the confirmed ones."""
        return replace(self, confirmed=tuple(dict.fromkeys((*self.confirmed, code))))

    def edited(self, codes: Iterable[str]) -> Marks:
        """Return marks with these codes as the ones edited last."""
        return replace(self, recent=tuple(dict.fromkeys((*codes, *self.recent)))[:RECENT_KEPT])


def load_marks(profile_id: str) -> Marks:
    """Return the stored marks; empty if the file is missing or damaged."""
    reported = stored_json(_file(profile_id))
    stored = reported if isinstance(reported, dict) else {}
    return Marks(**{name: _texts(stored.get(key)) for name, key in STORED_KEYS.items()})


def _texts(found: object) -> tuple[str, ...]:
    return tuple(item for item in found if isinstance(item, str)) if isinstance(found, list) else ()


def save_marks(profile_id: str, marks: Marks) -> None:
    """Store the marks; errors of the folder are ignored."""
    with suppress(OSError):
        fields = asdict(marks)
        store_json(_file(profile_id), {key: fields[name] for name, key in STORED_KEYS.items()})


def _file(profile_id: str) -> Path:
    return state_folder() / f"marks-{profile_id}.json"
