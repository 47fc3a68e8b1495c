"""Reads with retries, for work that one lost reply or missing word must not stop."""

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
from .presence import look_for_drive, meets_silence
from .reader import Reader

READ_TRIES = 3
"""Number of attempts of a read if its reply is lost or damaged."""
LONGEST_REST = 3.0
"""Longest wait in seconds for a drive whose polling the line pauses."""


PLANNED_AT_ONCE = 60
"""Number of parameters planned together: planning more would block the line's loop."""


def neighbors(profile: Profile, codes: Iterable[str]) -> list[list[str]]:
    """Group the codes by address: split at gaps too wide for one read, and at PLANNED_AT_ONCE."""
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
    """Reads one drive into its image, with its own Reader so that polls are not affected."""

    session: DriveSession
    priority: Priority = Priority.OPERATOR_READ
    headline: str = "not known"
    """The drive's last read state, as text."""
    reader: Reader = field(init=False)

    def __post_init__(self) -> None:
        self.reader = Reader(self.session)

    @property
    def raws(self) -> Mapping[str, int]:
        """All known raw values of the drive, by code."""
        return self.session.image.raws

    @property
    def lacking(self) -> frozenset[str]:
        """Codes that the drive reported as missing."""
        return self.session.image.lacking

    def why_absent(self, code: str) -> str:
        """Return the refusal or error instead of a value; empty if there is a value."""
        refused = self.session.image.refused.get(code)
        return refused.error if refused is not None else ""

    async def ask(self, codes: Iterable[str]) -> dict[str, Reading]:
        """Read with up to READ_TRIES attempts; raises the error of the last attempt."""
        wanted = list(dict.fromkeys(codes))
        for tried in range(1, READ_TRIES + 1):
            try:
                if self.session.byte_order.is_suspect:
                    await check_byte_order(self.reader, self.priority)
                readings = await self.reader.read(wanted, priority=self.priority)
            except (NoAnswer, ChecksumFault, WrongReply) as error:
                if tried == READ_TRIES:
                    raise
                # the line pauses a drive without answers only for polls and background reads
                if self.priority >= Priority.POLL and isinstance(error, NoAnswer):
                    await self.session.clock.sleep(min(error.retry_in or 0.0, LONGEST_REST))
            else:
                return readings
        raise AssertionError  # the last try returns or raises

    async def ask_many(self, codes: Iterable[str]) -> dict[str, int]:
        """Return the raw values of any number of parameters; plans them in parts."""
        found: dict[str, int] = {}
        for part in neighbors(self.session.profile, dict.fromkeys(codes)):
            found |= await self.ask_raws(part)
        return found

    async def ask_raws(self, codes: Iterable[str]) -> dict[str, int]:
        """Return the raw values by code, without those that the drive refuses."""
        readings = await self.ask(codes)
        return {code: reading.raw for code, reading in readings.items() if reading.raw is not None}

    async def ask_state(self) -> StateKind:
        """Read the drive's state, for work that needs the motor at standstill."""
        profile = self.session.profile
        codes = [*watched_codes(profile), profile.data.faults.parameter]
        state = drive_state(profile, await self.ask(code for code in codes if code))
        self.headline = state.headline or state.kind
        return state.motion


NO_SUCH_WORD = "no answer, while the drive answers otherwise: perhaps it has no such word"


async def read_apart(reader: Reader, codes: Iterable[str]) -> dict[str, Reading]:
    """Read parameters that a person chose; one without an answer gets a bad reading.

    Reads them together, or one at a time if that gets no answer but the drive is present.
    Raises the line's errors, and NoAnswer if the drive answers nothing at all.
    """
    wanted = list(dict.fromkeys(codes))
    try:
        return await reader.read(wanted)
    except NoAnswer as error:
        if not meets_silence(reader.profile):
            raise
        await look_for_drive(reader.session, error)
    return {code: await _alone(reader, code) for code in wanted}


async def _alone(reader: Reader, code: str) -> Reading:
    try:
        return (await reader.read([code]))[code]
    except NoAnswer as error:
        await look_for_drive(reader.session, error)
        now = reader.session.clock.monotonic()
        return Reading.bad(reader.profile[code], now, NO_SUCH_WORD)
