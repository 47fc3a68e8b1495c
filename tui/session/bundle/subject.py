"""The line of a bundle, open if possible, and its drives."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

from tui.bus.errors import LineError

from ..connect.line_key import SIMULATED_PREFIX
from .parts import Missing
from .redaction import is_address

if TYPE_CHECKING:
    from tui.bus.link import Link
    from tui.drive.profile.profile import Profile

    from ..changes import ChangeList
    from ..connect.open_line import OpenLine
    from ..counters.watch import CountersNow
    from ..diagnosis.diagnosis import Diagnosis
    from ..drive import DriveSession
    from ..events import Event

ONE_DAY = timedelta(days=1)
"""The age of the oldest journal entries and messages in a bundle."""
NOT_OPEN = "The line is not open."

OpensDrive = Callable[[int], Awaitable["DriveSession"]]


class DriveDocuments(NamedTuple):
    """JSON documents of the commands with these names; `None` is a drive without session."""

    why: Callable[[str, int, DriveSession | None, Diagnosis], dict[str, Any]]
    counters: Callable[[str, DriveSession, CountersNow, Mapping[str, int]], dict[str, Any]]
    journal: Callable[[str, ChangeList], dict[str, Any]]


@dataclass(eq=False)
class BundleSubject:
    """The line, its drives, and data that only the caller has."""

    text: str
    """The LINE as typed."""
    link: Link | None
    """None for simulated drives on a line that is not open."""
    opened: OpenLine | None
    trouble: LineError | None
    """Error that prevented opening; None if it is open."""
    devices: Sequence[int]
    open_drive: OpensDrive
    """Returns the session with an identified drive; raises LineError, DriveError, Missing."""
    documents: DriveDocuments
    expected_profile: Callable[[int], Profile | None]
    """Returns a drive's profile as far as it is known without a request; may read files."""
    events: Sequence[Event] | None = None
    """The messages of the panel; None if there is no panel."""
    screens: Mapping[str, str] | None = None
    """The screens of the panel as text, by name; None if there is no panel."""
    since: datetime = field(default_factory=lambda: datetime.now().astimezone() - ONE_DAY)
    _sessions: dict[int, DriveSession | Exception] = field(default_factory=dict)

    async def session(self, device: int) -> DriveSession:
        """Return the session with a drive; a failure is stored, so that it is not requested
        again."""
        if self.opened is None:
            raise Missing(f"{NOT_OPEN} {self.trouble or ''}".strip())
        known = self._sessions.get(device)
        if known is None:
            # kept until it is known: the caller may run out of time
            self._sessions[device] = Missing("The drive was not identified in time.")
            try:
                known = await self.open_drive(device)
            except Exception as error:
                known = error
            self._sessions[device] = known
        if isinstance(known, Exception):
            raise Missing(str(known) or type(known).__name__)
        return known

    def known_session(self, device: int) -> DriveSession | None:
        """Return the session if it was requested before."""
        known = self._sessions.get(device)
        return None if isinstance(known, Exception) else known

    @property
    def sessions(self) -> list[DriveSession]:
        """Return the sessions with the identified drives."""
        found = (self.known_session(device) for device in self.devices)
        return [session for session in found if session is not None]


def bundle_name(link: Link | None, when: datetime) -> str:
    """Return the name of a bundle without extension: line and time, but no host name."""
    return f"drivepanel-{_line_part(link)}-{when:%Y%m%d-%H%M%S}"


def _line_part(link: Link | None) -> str:
    from tui.bus.link import RtuTcpLink, SerialLink

    if link is None:
        return SIMULATED_PREFIX.rstrip(":")
    if isinstance(link, SerialLink):
        text = PurePath(link.path.replace("\\", "/")).name
    else:
        kind = "rtu-tcp" if isinstance(link, RtuTcpLink) else "tcp"
        text = f"{kind}-{link.host if is_address(link.host) else ''}"
    return re.sub(r"[^A-Za-z0-9.]+", "-", text).strip("-.") or "line"
