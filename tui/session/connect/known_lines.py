"""Stored facts about lines: the adapter and drives of each at its last use.

They are in one file in the state folder. A port is stored by its adapter's permanent name if it has
one. A typed name, such as /dev/ttyUSB0, is stored with the port that it led to.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from tui.bus.errors import LinkSyntaxError
from tui.bus.link import Link, SerialLink, label, parse_link
from tui.bus.transport.port_names import PortName, lasting_name
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.library import version_shown
from tui.drive.small_file import read_small_text

from ..paths import state_folder
from ..stored import store_json
from .line_key import line_key

LINES_KEPT = 60
NAMES_KEPT = 100
LONGEST_MEMORY = 2_000_000
"""Maximum size of the file in bytes."""
LONGEST_IDENTITY_TEXT = 200
"""Maximum length of a stored identity text in characters."""
NO_PORT = PortName("")
_TERMINALS = "/dev/pts/"


@dataclass(frozen=True, slots=True)
class DriveMark:
    """Stored identity of a drive: the one that it reports, or its assumed profile."""

    vendor: str = ""
    reference: str = ""
    version: str = ""
    name: str = ""
    profile: str = ""

    @property
    def stated(self) -> tuple[str, ...]:
        """The reported identity; all texts are empty if it reports none."""
        return self.vendor, self.reference, self.version, self.name

    def fits(self, now: DriveMark) -> bool:
        """Return True if it may be the same drive; compares profiles if one has no reported
        identity."""
        if any(self.stated) and any(now.stated):
            return self.stated == now.stated
        return not (self.profile and now.profile) or self.profile == now.profile

    @property
    def text(self) -> str:
        """Short description of the drive."""
        name_text = " ".join(part for part in (self.reference or self.vendor, self.name) if part)
        shown = version_shown(self.profile, self.version)
        version = f"version {shown}" if shown else ""
        return (
            ", ".join(part for part in (name_text, version) if part)
            or _family(self.profile)
            or "a drive"
        )


def _family(profile: str) -> str:
    """Return the name of a profile; its id if it cannot be read."""
    try:
        return library.load(profile).name if profile else ""
    except DriveError:
        return profile


@dataclass(frozen=True, slots=True)
class LineMark:
    """State of a line at its last use."""

    adapter: str = ""
    drives: Mapping[int, DriveMark] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LinesMemory:
    """All stored lines by key, and the line that each typed name led to."""

    lines: Mapping[str, LineMark] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class LineName:
    """Stored name of a line."""

    key: str
    """Constant while adapter, host or port are the same; empty for a line that cannot be found
    again, such as a numbered pseudo-terminal."""
    typed: str = ""
    """Typed name of a serial port if that may later mean another port; else empty."""
    port: PortName = NO_PORT


def line_name(link: Link) -> LineName:
    """Return the stored name of the line at a link, from the present name of its port."""
    if not isinstance(link, SerialLink):
        return LineName(line_key(label(link)))
    path = os.path.abspath(link.path) if os.name == "posix" else link.path
    port = lasting_name(link.path)
    if port.path.startswith(_TERMINALS):
        # the next program may get this number; a link to it is a name chosen by a person
        return LineName("" if path.startswith(_TERMINALS) else f"serial:{path}")
    return LineName(line_key(label(link)), path if path != port.path else "", port)


def remembered_text(text: str) -> str:
    """Stored form of a LINE: a port by its permanent name if its adapter has one."""
    try:
        link = parse_link(text)
    except LinkSyntaxError:
        return text  # a simulated line
    if not isinstance(link, SerialLink):
        return text
    port = lasting_name(link.path)
    if not port.lasting or port.path == link.path:
        return text
    return label(SerialLink(port.path, link.baud, link.format, link.timeout))


def memory_file() -> Path:
    """Return the path of the file of stored lines."""
    return state_folder() / "known-lines.json"


def load_memory() -> LinesMemory:
    """Return the stored lines; damaged files and parts are skipped."""
    try:
        stored = json.loads(read_small_text(memory_file(), LONGEST_MEMORY))
    except (OSError, ValueError, RecursionError):
        return LinesMemory()
    if not isinstance(stored, dict):
        return LinesMemory()
    lines = {key: _line_mark(name_text) for key, name_text in _table(stored, "lines").items()}
    names = {typed: key for typed, key in _table(stored, "names").items() if isinstance(key, str)}
    return LinesMemory({key: mark for key, mark in lines.items() if mark is not None}, names)


def keep_memory(memory: LinesMemory) -> None:
    """Write the stored lines to disk atomically, the latest first. Raises OSError."""
    lines = {
        key: {
            "adapter": mark.adapter,
            "drives": {str(device): asdict(drive) for device, drive in mark.drives.items()},
        }
        for key, mark in list(memory.lines.items())[:LINES_KEPT]
    }
    names = dict(list(memory.names.items())[:NAMES_KEPT])
    store_json(memory_file(), {"lines": lines, "names": names})


def _table(name_text: Mapping[str, Any], key: str) -> dict[str, Any]:
    found = name_text.get(key)
    return found if isinstance(found, dict) else {}


def _line_mark(name_text: object) -> LineMark | None:
    if not isinstance(name_text, dict):
        return None
    adapter = name_text.get("adapter")
    drives = {}
    for device, mark in _table(name_text, "drives").items():
        if device.isdecimal() and isinstance(mark, dict):
            texts = {field.name: mark.get(field.name, "") for field in fields(DriveMark)}
            if all(isinstance(text, str) for text in texts.values()):
                drives[int(device)] = DriveMark(**texts)
    return LineMark(adapter if isinstance(adapter, str) else "", drives)
