"""Reading raw values for work that must not stop at one lost reply, with the drive's state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from tui.bus.api import Priority
from tui.bus.errors import ChecksumFault, NoAnswer, WrongReply
from tui.drive.chart import watched_codes
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import StateKind

from ..drive import DriveSession
from ..drive_state import drive_state
from ..reading import Reading
from .order_check import check_byte_order
from .reader import Reader

READ_TRIES = 3
"""Number of attempts of a read if its reply is lost or damaged."""
LONGEST_REST = 3.0
"""Seconds that are waited at most for a drive that the line leaves alone for a while."""


PLANNED_AT_ONCE = 60
"""Number of parameters planned together: planning more would hold up the line's loop."""


def neighbors(profile: Profile, codes: Iterable[str]) -> list[list[str]]:
    """The codes by address, parted where no read could go over the gap, and where they get many."""
    function = profile.function(3)
    longest = (function.max_read if function else None) or 1
    parts: list[list[str]] = []
    last = -1
    for parameter in sorted((profile[code] for code in codes), key=lambda p: p.address):
        if not parts or parameter.address - last > longest or len(parts[-1]) >= PLANNED_AT_ONCE:
            parts.append([])
        parts[-1].append(parameter.code)
        last = parameter.address
    return parts


@dataclass(slots=True)
class RetryingReader:
    """Reads of one drive into its image by a reader of its own, so that no other is disturbed."""

    session: DriveSession
    priority: Priority = Priority.OPERATOR_READ
    headline: str = "not known"
    """The drive's state in words, as last read."""
    reader: Reader = field(init=False)

    def __post_init__(self) -> None:
        self.reader = Reader(self.session)

    @property
    def raws(self) -> Mapping[str, int]:
        """All raw values known of the drive."""
        return self.session.image.raws

    @property
    def lacking(self) -> frozenset[str]:
        """Codes that the drive itself said it does not have."""
        return self.session.image.lacking

    def why_absent(self, code: str) -> str:
        """Return the refusal or error instead of a value; empty if there is a value."""
        refused = self.session.image.refused.get(code)
        return refused.error if refused is not None else ""

    async def ask(self, codes: Iterable[str]) -> dict[str, Reading]:
        """Read, again where a reply was lost; raises the line's errors when that does not help."""
        wanted = list(dict.fromkeys(codes))
        for tried in range(1, READ_TRIES + 1):
            try:
                if self.session.byte_order.is_suspect:
                    await check_byte_order(self.reader, self.priority)
                readings = await self.reader.read(wanted, priority=self.priority)
            except (NoAnswer, ChecksumFault, WrongReply) as error:
                if tried == READ_TRIES:
                    raise
                # only behind everything else a drive that fell silent is left alone for a while
                if self.priority >= Priority.POLL and isinstance(error, NoAnswer):
                    await self.session.clock.sleep(min(error.retry_in or 0.0, LONGEST_REST))
            else:
                return readings
        raise AssertionError  # the last try returns or raises

    async def ask_many(self, codes: Iterable[str]) -> dict[str, int]:
        """The raw values of any number of parameters, planned a part at a time."""
        found: dict[str, int] = {}
        for part in neighbors(self.session.profile, dict.fromkeys(codes)):
            found |= await self.ask_raws(part)
        return found

    async def ask_raws(self, codes: Iterable[str]) -> dict[str, int]:
        """The raw values of those that the drive reports."""
        readings = await self.ask(codes)
        return {code: reading.raw for code, reading in readings.items() if reading.raw is not None}

    async def ask_state(self) -> StateKind:
        """The kind of the drive's present state, for callers that need a motor at rest."""
        profile = self.session.profile
        codes = [*watched_codes(profile), profile.data.faults.parameter]
        state = drive_state(profile, await self.ask(code for code in codes if code))
        self.headline = state.headline or state.kind
        return state.motion
