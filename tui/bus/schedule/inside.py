"""What sharing needs of the line that is shared, and what the line needs of sharing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from ..link import Link
from ..master import LineContext, MonotonicClock
from ..model import LineState, LineStatus, Timing
from ..shared_facts import SharedFacts
from .dispatcher import Dispatcher
from .pace import Pace
from .patience import Devices
from .queue import Job


@dataclass(frozen=True, slots=True)
class LineInside:
    """One line from inside; used in its loop."""

    link: Link
    around: LineContext
    dispatcher: Dispatcher
    devices: Devices
    pace: Pace
    state: Callable[[], LineState]
    submit: Callable[[Job], None]
    """Queues a job, or fails it at once where the line is lost."""

    @property
    def timing(self) -> Timing:
        """What governs the line."""
        return self.around.timing

    @property
    def clock(self) -> MonotonicClock:
        """What the line counts by."""
        return self.around.clock

    @property
    def facts(self) -> SharedFacts:
        """What the programs on the line must know of each other."""
        return self.dispatcher.facts


class SharedLine(Protocol):
    """Other programs on the line; see tui.bus.share."""

    @property
    def stops_only(self) -> bool:
        """Whether the owner is frozen, so that nothing but stops goes out."""

    async def own(self, say: Callable[[LineStatus, str], None]) -> None:
        """Return once this program owns the line; until then its requests go to the owner."""

    def pass_on(self, message: bytes) -> bool:
        """Send a finished message to the owner; False if none takes it."""

    def tell_state(self) -> None:
        """The line's state has changed."""

    async def close(self, quiet: float) -> None:
        """Leave the line; a reply may still come for `quiet` seconds."""
