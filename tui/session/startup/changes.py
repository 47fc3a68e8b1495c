"""Settings that changed while this program did not read them."""

from __future__ import annotations

from collections.abc import Mapping

from tui.drive.settings.writable import is_setting
from tui.drive.shown import shown

from ..drive import DriveSession


class SettingChanges:
    """Compares the settings of all steps before and after a gap: a restart, or a lost line."""

    def __init__(self, session: DriveSession) -> None:
        self.session = session
        self.texts: tuple[str, ...] = ()
        """Changed settings: code, old value, new value."""
        self._gap = True
        """True until all values are read again after a start or a lost line."""

    def lost(self) -> None:
        """Note that the drive does not answer: its settings may change unseen."""
        self._gap = True

    @property
    def needs_all(self) -> bool:
        """True if every value must be read, to find the changes."""
        return self._gap

    def take(self, seen: dict[str, int], raws: Mapping[str, int], *, whole: bool) -> bool:
        """Compare raw values with those in `seen`, and put them there; return True if it changed.

        After a gap, only a `whole` read of all steps counts.
        """
        profile = self.session.profile
        settings = {c: raw for c, raw in raws.items() if is_setting(profile, profile[c])}
        different = [code for code, raw in settings.items() if seen.get(code) != raw]
        if self._gap and not whole:
            return False
        if self._gap:
            self._gap = False
            known = (code for code in different if code in seen)
            self.texts += tuple(self._text(code, seen[code], settings) for code in known)
        seen |= settings
        return bool(different)

    def _text(self, code: str, old: int, raws: Mapping[str, int]) -> str:
        profile = self.session.profile
        before = shown(profile, profile[code], old, raws).display
        return f"{code} {before} → {shown(profile, profile[code], raws[code], raws).display}"
