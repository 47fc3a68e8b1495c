"""Counters of one drive, read repeatedly and compared, and frames that answer no request."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from tui.bus.api import DeviceCounters, LastMinute, LineCounters, Priority
from tui.bus.errors import DeviceException, LineError, RequestRefused
from tui.bus.link import TcpLink
from tui.bus.trace import Frame
from tui.drive.chart import watched_codes
from tui.drive.profile.schema import PortCounters
from tui.drive.sentences import counted

from ..connect.other_masters import overheard
from ..diagnosis.asking import last_time
from ..diagnosis.measure import measure_of
from ..drive import DriveSession
from ..journal import Entry, Journal, now_text
from ..read.reader import Reader
from .compare import (
    Bounds,
    Comparison,
    Difference,
    DriveCount,
    device_since,
    differences,
    load_of,
    own_differences,
)

LIKELY = "late or repeated replies, a second drive at the address, or another master"


def stray_difference(
    count: int, frames: Sequence[Frame], since: float, device: int, *, tcp: bool
) -> list[Difference]:
    """Return a difference for this number of strays, or an empty list for 0.

    The recorded frames after `since` (line's clock) show their kinds, if they are still recorded.
    """
    if count <= 0:
        return []
    frames = [frame for frame in frames if frame.time > since]
    found = measure_of(frames, device, tcp=tcp)
    kinds = (
        (found.duplicated, "1 copy of a reply", "{count} copies of replies"),
        (found.late, "1 reply after its timeout", "{count} replies after their timeout"),
        (
            found.second,
            "1 second reply with other values",
            "{count} second replies with other values",
        ),
        (found.behind, "1 reply to the request before", "{count} replies to the request before"),
        (found.foreign, "1 reply of another address", "{count} replies of other addresses"),
    )
    shown = [counted(number, single, several) for number, single, several in kinds if number]
    rest = count - sum(number for number, _, _ in kinds)
    if shown and rest > 0:
        shown.append(f"{rest} of unknown kind")
    seen = ", ".join(shown) or LIKELY
    master = [] if tcp or not (heard := overheard(frames, since)).requests else [heard.text]
    text = counted(
        count,
        "1 frame answers no program's request: {seen}.",
        "{count} frames answer no program's request: {seen}.",
        seen=seen,
    )
    text = " ".join([text, *master, "Find the cause with `drivepanel why`."])
    return [Difference("strays", count, text)]


UNANSWERED_KINDS = ("never-arrived", "damaged-there")
"""Differences of the drive's counters that explain missing replies."""
DIAGNOSTICS = 8
ECHO, RESET, DAMAGED, FRAMES = 0x00, 0x0A, 0x0C, 0x0E
"""Sub-functions of function 8."""
ECHOED = 0xA55A
"""Word of an echo test: it has as many ones as zeros."""
THIS_PORT = "function 8"
COUNTS_ARRIVE_WITHIN = 0.5
"""Seconds after which the keeper has sent its latest counts to this program."""


PairRequested = Callable[[], Awaitable[tuple[int, int] | None]]
"""Reads a pair of counters; returns None if the drive refuses them."""


@dataclass(frozen=True, slots=True)
class CountersNow:
    """Current counts for display. "Ours" are those of the process that holds the line."""

    total: DeviceCounters
    """Ours, since the line was opened."""
    since: DeviceCounters
    """Ours, since the first reading or the last reset."""
    seconds: float
    """Seconds covered by `since`."""
    line_load: float | None
    """Share of that time in which the line was busy, 0 to 1; None if not known."""
    device_load: float | None
    """Share of that time in which the line was busy with this drive."""
    counted_by: str
    """Text of the program that counts, the owner of the line; empty if it is this one."""
    drive: tuple[tuple[str, Comparison], ...]
    """Comparisons with the drive's own counters, with the name of each pair."""
    trouble: str
    """Why reading the drive's own counters failed; empty if it did not."""
    differences: tuple[Difference, ...] = ()
    line_minute: LastMinute = field(default_factory=LastMinute)

    has_own: bool = False
    """True if the profile names counters of the drive."""
    refused: bool = False
    """True if the drive refused to report them."""

    @property
    def agree(self) -> bool:
        """True if every frame was counted and answered, and both sides were read."""
        return not self.differences and not self.trouble

    @property
    def compared(self) -> Comparison | None:
        """Comparison with the counters of this line's port; None if the drive has none."""
        return dict(self.drive).get(THIS_PORT) or next(
            (comparison for _, comparison in self.drive if comparison.counts_this_line), None
        )

    @property
    def agreeing(self) -> str:
        """Sentence to show if there are no differences."""
        comparison = self.compared
        if comparison is None:
            text = f"Frames sent: {self.since.requests}. None was lost."
            if self.drive:
                return text
            if not self.has_own:
                return f"{text} The drive reports no counters of its own."
            if self.refused:
                return f"{text} The drive refused to report its own counters."
            return f"{text} The drive's own counters are not read yet."
        return f"Frames counted by the drive: {comparison.frames}. All were sent here and answered."


@dataclass(slots=True, eq=False)
class CounterWatch:
    """Reads both sides. A reset of ours applies to this watch only. For one loop only."""

    session: DriveSession
    trouble: str = ""
    is_refused: bool = False
    """True if `trouble` is a refusal of the drive."""
    _line: LineCounters = field(init=False)
    """Counts of the line at the last reset."""
    _begun: float = field(init=False)
    _since: float = field(init=False)
    """Time of the last frame before the reset, on the line's clock."""
    _looked: bool = False
    _refused: bool = False
    _drive: dict[str, Comparison] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.reset_ours()

    @property
    def has_diagnostics(self) -> bool:
        """True if the drive reports its counters by function 8."""
        return self._has(DAMAGED) and self._has(FRAMES)

    @property
    def can_reset_drive(self) -> bool:
        """True if this program can reset the drive's own counters."""
        return self._has(RESET) and not self.session.line.read_only

    def _has(self, subfunction: int) -> bool:
        function = self.session.profile.function(DIAGNOSTICS)
        return function is not None and subfunction in function.subfunctions

    @property
    def _ours(self) -> DeviceCounters:
        return self.session.line.counters.devices.get(self.session.device, DeviceCounters())

    @property
    def counted_by(self) -> str:
        """Text of the program that owns the line and counts; empty if it is this one."""
        facts = self.session.line.facts
        owner = facts.programs[0] if facts.programs else facts.me
        return "" if owner.id == facts.me.id else owner.text

    def reset_ours(self) -> None:
        """Restart our counts for this watch; the line's counts, which others use, continue."""
        self._line = self.session.line.counters
        self._since = last_time(self.session.line.trace)
        self._begun = self.session.clock.monotonic()
        self._drive = {
            name: Comparison(comparison.last, comparison.last)
            for name, comparison in self._drive.items()
        }

    async def reset_drive(self, journal: Journal) -> None:
        """Set the drive's counters to 0 (sub-function 0A). Raises the line's errors.

        By the manual, it resets the communication counters and nothing else. The journal gets an
        entry with the result, even if the request fails.
        """
        if why := self.session.contradiction:
            raise RequestRefused(f"Not reset: {why}")
        device, line = self.session.device, self.session.line
        answer = "ended before the reply, may have taken effect"
        try:
            await line.diagnose(device, RESET, priority=Priority.OPERATOR_WRITE)
            answer = "ok"
        except LineError as error:
            answer = str(error)
            raise
        finally:
            journal.add(_reset_entry(self.session, answer))
        self._drive = {}
        self.reset_ours()
        await self.look()

    async def look(self) -> None:
        """Read the drive's own counters; an error of the line is stored in `trouble`."""
        self.trouble, self.is_refused = "", False
        if not self._looked:
            # both sides must begin at the same time
            self._looked = True
            self.reset_ours()
        try:
            if self.has_diagnostics:
                await self._look_by_diagnostics()
            for port in self.session.profile.data.port_counters:
                await self._take(port.name, partial(self._port_counts, port))
        except LineError as error:
            self.trouble, self.is_refused = str(error), isinstance(error, DeviceException)

    async def _look_by_diagnostics(self) -> None:
        line, device = self.session.line, self.session.device
        damaged = await line.diagnose(device, DAMAGED)

        async def pair() -> tuple[int, int]:
            return await line.diagnose(device, FRAMES), damaged

        # the bounds of the frames sent are taken around this one request
        await self._take(THIS_PORT, pair)

    async def _port_counts(self, port: PortCounters) -> tuple[int, int] | None:
        found = await Reader(self.session).read([port.frames, port.checksum_errors])
        frames, damaged = found[port.frames].raw, found[port.checksum_errors].raw
        return None if frames is None or damaged is None else (frames, damaged)

    async def _take(self, name: str, ask: PairRequested) -> None:
        """Read a pair of counters with the bounds of the frames sent and answered by then."""
        before = self._ours
        found = await ask()
        if self.counted_by:
            await self.session.clock.sleep(COUNTS_ARRIVE_WITHIN)
        after = self._ours
        self._refused = found is None
        if found is None:
            return
        now = DriveCount(
            *found,
            Bounds(before.requests + 1, max(before.requests + 1, after.requests)),
            Bounds(before.replies + 1, max(before.replies + 1, after.replies)),
        )
        known = self._drive.get(name)
        self._drive[name] = known.with_look(now) if known else Comparison(now, now)

    async def echo(self, times: int) -> int:
        """Send test frames that change nothing; return how many were answered.

        They are echoes of function 8, or reads of the status word if the drive has no echo.
        """
        answered = 0
        for _ in range(times):
            try:
                await self._one_echo()
            except LineError:
                continue
            answered += 1
        return answered

    async def _one_echo(self) -> None:
        line, device = self.session.line, self.session.device
        if self._has(ECHO):
            await line.diagnose(device, ECHO, ECHOED)
            return
        profile = self.session.profile
        codes = watched_codes(profile) or [
            value.parameter for value in profile.data.monitoring.values
        ]
        word = profile[codes[0]]
        await line.read(
            device, word.address, function=word.function, priority=Priority.OPERATOR_READ
        )

    def now(self) -> CountersNow:
        """Return the present counts."""
        line, ours = self.session.line.counters, self._ours
        seconds = self.session.clock.monotonic() - self._begun
        before = self._line.devices.get(self.session.device, DeviceCounters())
        since = device_since(ours, before)
        only = LineCounters(busy_seconds=since.busy_seconds)
        found = CountersNow(
            ours,
            since,
            seconds,
            load_of(line, self._line, seconds),
            load_of(only, LineCounters(), seconds),
            self.counted_by,
            tuple(self._drive.items()),
            self.trouble,
            line_minute=line.minute,
            has_own=self.has_diagnostics or bool(self.session.profile.data.port_counters),
            refused=self._refused,
        )
        strays = stray_difference(
            line.stale - self._line.stale,
            self.session.line.trace,
            self._since,
            self.session.device,
            tcp=isinstance(self.session.line.link, TcpLink),
        )
        return replace(found, differences=(*_differences_since(found.compared, since), *strays))


def _reset_entry(session: DriveSession, answer: str) -> Entry:
    """Create the journal entry of a reset; it has no register and no old value."""
    return Entry(
        now_text(), session.line_text, session.device, session.profile.id,
        f"function {DIAGNOSTICS}, {RESET:02X}", 0, None, "", 0, "0", answer, None,
        "the drive's own counters of its exchanges", kind="reset",
    )  # fmt: skip


def _differences_since(mine: Comparison | None, since: DeviceCounters) -> tuple[Difference, ...]:
    """Return the differences by the counters of this port, else by our counts alone."""
    reported = differences(mine) if mine is not None else []
    if any(difference.kind == "not-answered" for difference in reported):
        return tuple(reported)
    if mine is None:
        return (*reported, *own_differences(since))
    explained = sum(each.count for each in reported if each.kind in UNANSWERED_KINDS)
    open_ = max(0, since.timeouts - explained)
    return (*reported, *own_differences(since, unanswered=open_, compared=True))
