"""One connected drive: what it is, what it shows, what is asked of it."""

from __future__ import annotations

import time
from collections.abc import Sequence

from tui.bus.line import Line, Priority
from tui.bus.link import label
from tui.drive.profile import Profile

from .identify import DriveIdentity
from .monitor import Monitor
from .order_queue import OrderQueue
from .reader import Rating, Reader
from .readings import Reading


class DriveSession:
    """A drive on a line, with its profile and its monitor.

    The monitor works in the line's loop; `read` belongs to the loop of its caller.
    """

    def __init__(
        self, line: Line, device: int, profile: Profile, identity: DriveIdentity | None = None
    ) -> None:
        self.line = line
        self.device = device
        self.profile = profile
        self.identity = identity
        self.orders = OrderQueue(line, device)
        """What is to be done to the drive; a stop ends it."""
        self.commanded_at: float | None = None
        """When a command or reference was last sent to the drive from here (monotonic)."""
        self.monitor = Monitor(line, device, profile)
        self._reader = Reader(line, device, profile)

    @property
    def commanded(self) -> bool:
        """Whether a command or reference was sent to the drive from here."""
        return self.commanded_at is not None

    def note_command(self) -> None:
        """A command or reference was sent."""
        self.commanded_at = time.monotonic()

    @property
    def line_text(self) -> str:
        """The line as it is written."""
        return label(self.line.link)

    async def read(
        self, codes: Sequence[str], *, priority: Priority = Priority.OPERATOR_READ
    ) -> dict[str, Reading]:
        """Readings by code; a parameter that the drive refuses is bad, the others are not hurt.

        Raises the line's errors (no answer, line lost) and UnknownParameter.
        """
        return await self._reader.read(codes, priority=priority)

    def rate(self, code: str, rating: Rating) -> None:
        """Tell what 100 % of a parameter is, from the drive's nameplate."""
        self._reader.ratings[code] = rating
        self.monitor.reader.ratings[code] = rating

    def close(self) -> None:
        """Stop watching; the line stays open."""
        self.monitor.stop()
