"""Interface between sharing and the line that is shared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from ..errors import LineError
from ..link import Link
from ..master import LineContext, MonotonicClock
from ..model import LineState, LineStatus, Timing
from ..shared_state import SharedState
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
    error: Callable[[], LineError | None]
    """The reason why the line is lost."""
    submit: Callable[[Job], None]
    """Queues a job, or fails it immediately if the line is lost."""

    @property
    def timing(self) -> Timing:
        """Timing of the line."""
        return self.around.timing

    @property
    def clock(self) -> MonotonicClock:
        """Clock of the line."""
        return self.around.clock

    @property
    def facts(self) -> SharedState:
        """State shared by the programs on the line."""
        return self.dispatcher.facts


Say = Callable[[LineStatus, str, LineError | None], None]
"""Report the line's status, the message about it, and the error of a lost one."""


class SharedLine(Protocol):
    """Other programs on the line; see tui.bus.share."""

    @property
    def starts(self) -> bool:
        """True while the process starts that is to hold the line, for some time."""

    @property
    def frozen(self) -> bool:
        """True while the process that holds the line does not answer."""

    async def own(self, say: Say) -> None:
        """Return once this program owns the line; until then its requests go to the owner."""

    async def unwanted(self) -> None:
        """Return once no program needs the line: never if this one does."""

    async def pause(self, seconds: float) -> None:
        """Wait before the next attempt on a lost line; a program that attaches ends the wait."""

    def rest(self, quiet: float) -> None:
        """Note that the port is closed; a reply may still come for `quiet` seconds."""

    def pass_on(self, message: bytes) -> bool:
        """Send a finished message to the owner; False if there is none that accepts it."""

    def tell_state(self) -> None:
        """The line's state has changed."""

    async def close(self, quiet: float) -> None:
        """Leave the line; a reply may still come for `quiet` seconds."""
