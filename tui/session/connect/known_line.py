"""Comparison of an open line with its stored identity: its adapter, and the drives on it.

Another adapter under the same name, or another drive at an address, blocks all writes to the line
except stops until a person accepts the change.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping
from dataclasses import replace

from tui.bus.api import ModbusLine
from tui.drive.plain import plain

from .identify import DriveIdentity
from .known_lines import (
    LONGEST_IDENTITY_TEXT,
    DriveMark,
    LineMark,
    LineName,
    LinesMemory,
    keep_memory,
    line_name,
    load_memory,
)

log = logging.getLogger(__name__)

BY_OPTION = "If that is right, --accept-line takes the line as it is now."


class KnownLine:
    """Open line checked against its stored identity. Thread-safe."""

    def __init__(self, line: ModbusLine, *, way: str = BY_OPTION) -> None:
        self._line = line
        self._lock = threading.RLock()
        self._found: dict[int, DriveMark] = {}
        self._changed: Mapping[int | None, str] = {}
        """Differences by device, with None for the adapter; replaced as a whole."""
        self._accepts = False
        self.way = way
        """Step by which a person accepts the change, as a sentence."""
        self._name = LineName("")
        self.look()

    @property
    def changed(self) -> tuple[str, ...]:
        """Differences from the stored line, one sentence each; empty if there are none. Does not
        block."""
        return tuple(self._changed.values())

    @property
    def text(self) -> str:
        """The differences as one text."""
        return " ".join(self.changed)

    def look(self) -> None:
        """Compare the present adapter: when the line is opened, and after it was reconnected."""
        with self._lock:
            self._name = line_name(self._line.link)
            self._say(None, self._adapter_changed(load_memory()) if self._name.key else "")
            if not self._changed:
                self._keep()

    def note(self, identity: DriveIdentity | None, device: int, profile: str = "") -> None:
        """Compare a drive that answered with the stored drive at its address."""
        with self._lock:
            if not self._name.key:
                return
            now = _mark_of(identity, profile)
            if not any(now.stated) and not now.profile:
                return
            before = load_memory().lines.get(self._name.key, LineMark()).drives.get(device)
            self._found[device] = now
            reported = ""
            if before is not None and not before.fits(now):
                reported = (
                    f"Device {device} was {plain(before.text)}, and is {plain(now.text)} now."
                )
            self._say(device, reported)
            if device not in self._changed and None not in self._changed and before != now:
                self._keep()

    def accept(self, *, all_that_comes: bool = False) -> None:
        """Accept the present line and store it.

        With `all_that_comes`, later differences are accepted too.
        """
        with self._lock:
            self._accepts = all_that_comes
            self._changed = {}
            self._line.held = ""
            self._keep()

    def _say(self, what: int | None, reported: str) -> None:
        """Record the difference of the adapter or a device; writes are held while anything
        differs."""
        others = {key: text for key, text in self._changed.items() if key != what}
        self._changed = {**others, what: reported} if reported and not self._accepts else others
        reason = f"Until you confirm, only stops are written. {self.text} {self.way}"
        self._line.held = reason if self._changed else ""

    def _adapter_changed(self, memory: LinesMemory) -> str:
        """Return how the adapter differs, as a sentence; empty if it does not."""
        name = self._name
        before = memory.names.get(name.typed)
        if name.typed and before is not None and before != name.key:
            was = memory.lines.get(before, LineMark()).adapter
            return (
                f"{plain(name.typed)} was {_port(before, was)}, and is"
                f" {_port(name.key, name.port.adapter)} now."
            )
        was = memory.lines.get(name.key, LineMark()).adapter
        if was and name.port.adapter and was != name.port.adapter:
            return (
                f"Another adapter is in {plain(name.port.path)}: it was {plain(was)}, and is"
                f" {plain(name.port.adapter)} now."
            )
        return ""

    def _keep(self) -> None:
        """Store the present line except for differences; a failure is ignored."""
        if not self._name.key:
            return
        memory, name = load_memory(), self._name
        before = memory.lines.get(name.key, LineMark())
        new = {d: mark for d, mark in self._found.items() if d not in self._changed}
        drives = {d: _fuller(before.drives.get(d), mark) for d, mark in new.items()}
        mark = replace(
            before,
            adapter=name.port.adapter or before.adapter,
            drives=dict(sorted({**before.drives, **drives}.items())),
        )
        lines = {
            name.key: mark,
            **{k: line_mark for k, line_mark in memory.lines.items() if k != name.key},
        }
        names = dict(memory.names)
        if name.typed:
            names = {name.typed: name.key, **{k: v for k, v in names.items() if k != name.typed}}
        now = LinesMemory(lines, names)
        if now == memory:
            return
        try:
            keep_memory(now)
        except OSError as error:
            log.warning("what the line is was not remembered: %s", error)


def _mark_of(identity: DriveIdentity | None, profile: str) -> DriveMark:
    if identity is None:
        return DriveMark(profile=profile)
    stated = (identity.vendor, identity.reference, identity.version, identity.name)
    vendor, reference, version, name = (text[:LONGEST_IDENTITY_TEXT] for text in stated)
    return DriveMark(vendor, reference, version, name, profile or identity.profile or "")


def _fuller(before: DriveMark | None, now: DriveMark) -> DriveMark:
    """Return the more complete of the stored and the present identity of a drive."""
    if before is not None and any(before.stated) and not any(now.stated) and before.fits(now):
        return before
    return now


def _port(key: str, adapter: str) -> str:
    path = plain(key.removeprefix("serial:"))
    return f"{path} ({plain(adapter)})" if adapter else path
