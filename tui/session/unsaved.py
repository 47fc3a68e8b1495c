"""Settings that a drive loses at power-off, by what this program has written and read."""

from __future__ import annotations

from threading import Lock


class UnsavedSettings:
    """Raw values of settings that the drive keeps until power-off only, unless it saves them.

    What is saved is the value read before the first write from here, as long as nothing else has
    changed it since. If that value is not known, the setting counts as unsaved. For any thread.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._saved: dict[str, int | None] = {}
        self._held: dict[str, int | None] = {}
        self._known = True

    @property
    def codes(self) -> frozenset[str]:
        """The settings whose value is not known to be the saved one."""
        with self._lock:
            held = self._held.items()
            return frozenset(c for c, raw in held if raw is None or raw != self._saved[c])

    def note_write(self, code: str, before: int | None, now: int | None) -> None:
        """Note a write: what the drive held before it, and holds now; None if not known."""
        with self._lock:
            if code not in self._saved:
                self._saved[code] = before if self._known else None
            elif self._held[code] != before:
                self._saved[code] = None  # changed by another source, which may have saved it
            self._held[code] = now

    def note_value(self, code: str, raw: int) -> None:
        """Note what a setting holds that was written without a sure reply."""
        with self._lock:
            if code in self._held:
                self._held[code] = raw

    def forget_values(self) -> None:
        """Many settings may have changed: from now on no value read is known to be saved."""
        with self._lock:
            self._known = False
            self._saved = dict.fromkeys(self._saved)

    def clear(self) -> None:
        """The drive has saved all settings, or lost what was not saved."""
        with self._lock:
            self._saved, self._held, self._known = {}, {}, True
