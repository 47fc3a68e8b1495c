"""Evidence about a line and one drive on it, for the checks of the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from tui.bus.errors import OWNER_SILENT, LineError, LineLost
from tui.bus.link import Link, SerialLink
from tui.bus.transport.port_errors import PortErrors
from tui.bus.transport.ports import PortSeen
from tui.drive.profile.profile import Profile

from ..connect.identify import DriveIdentity
from .gateway_probe import Works
from .measure import Measure
from .reply_evidence import ReplyEvidence

NO_ERRORS = PortErrors(0, 0, 0, 0)
NO_REQUEST_SEEN = ReplyEvidence()


@dataclass(frozen=True, slots=True)
class AdapterSeen:
    """Present place of the adapter that was last used under a port's name."""

    was: str = ""
    """Its permanent name; empty if the name still leads to it, or nothing is stored."""
    now: str = ""
    """Its present port; empty if it is not plugged in."""


SAME_ADAPTER = AdapterSeen()


@dataclass(frozen=True, slots=True)
class DiagnosticEvidence:
    """Evidence for a diagnosis; times in seconds."""

    link: Link
    device: int
    profile: Profile | None = None
    identity: DriveIdentity | None = None
    """Identity of a drive without a known profile; None if it was not read."""
    trouble: LineError | None = None
    """Error that prevents use of the line; None if it can be used."""
    port: PortSeen | None = None
    adapter: AdapterSeen = SAME_ADAPTER
    changed: str = ""
    """Differences from the stored line for which writes are held."""
    heard: ReplyEvidence = NO_REQUEST_SEEN
    withheld: str = ""
    """Why this program sent nothing to the drive."""
    errors: PortErrors = NO_ERRORS
    """Errors counted by the port while the drive was polled."""
    turnaround: float | None = None
    """Usual time in seconds from the end of a request to the start of its answer."""
    overheard: str = ""
    """Another master on the line, as a sentence; empty if none was detected."""
    loose: int = 0
    """Bytes without a frame that came before the first request, if no frame of a master came."""
    measure: Measure | None = None
    """Shares of faulty frames among many reads; None if the drive was not read often enough."""
    works: Works | None = None
    """The request that a silent gateway answers."""
    behind: bool = False
    """True if the name of the line marks its replies as one behind."""
    idle_closed: bool = False
    """True if the connection was closed because nothing was sent."""
    idle: float = 0.0
    """Seconds without requests in that test; 0 if it was not made."""
    neighbors: tuple[int, ...] = ()
    """Other addresses of this line that answer."""

    @property
    def owner_frozen(self) -> bool:
        """True if a Drive Panel process owns the line and does not respond."""
        return isinstance(self.trouble, LineLost) and OWNER_SILENT in str(self.trouble)

    @property
    def path(self) -> str:
        """The serial port; empty if the line has none."""
        return self.link.path if isinstance(self.link, SerialLink) else ""

    @property
    def broken(self) -> int:
        """Number of characters that the port itself reported as damaged."""
        return self.errors.framing + self.errors.parity + self.errors.breaks
