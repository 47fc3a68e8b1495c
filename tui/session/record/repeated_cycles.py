"""Cycles of a monitor in a record: the monitor of a replay repeats them, each at its time."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from tui.bus.errors import DeviceException, ExchangeError, NotRecorded
from tui.bus.model import LineStatus, Reply
from tui.bus.poll_plan import PlannedRead, PolledTurn

from .newest import PAUSE_OF_CYCLES, is_repeated
from .replay_line import ReplayLine
from .replay_reader import ROWS_AHEAD, RecordedReply
from .schema import RECORDED_READS, REFUSED, to_microseconds

LONGEST_CYCLE = 2.0
"""Seconds before a time in which a cycle that goes on then has begun."""
SOON = 5.0
"""Seconds, or a period, after which a cycle is not waited for: the drive was not polled."""
END_SOUGHT_AGAIN = 1.0
"""Seconds after which the end of a file is read again: it may still be written."""


class RepeatedCycle(NamedTuple):
    """One cycle, from its first request (microseconds since 1970) to its last reply."""

    begun: int
    last: RecordedReply
    block: int | None = None
    """Register from which it read values of a block; None without one."""


def cycles_of(
    line: ReplayLine, device: int, since: float, reads: Sequence[PlannedRead]
) -> tuple[list[RepeatedCycle], bool]:
    """Return the next cycles of a device, by the reads of its monitor; True if they are the last.

    A record does not say which work of a program made a request. So a cycle ends before a pause,
    and before a request that it has made already. Requests for other registers are not in it.
    """
    found: list[RepeatedCycle] = []
    places: set[tuple[int, int, int]] = set()
    before: RecordedReply | None = None
    replies = line.replies_from(device, since)
    for reply in replies:
        # a silent drive fails the next cycle too, whatever was requested first
        silent = before is not None and min(before.quality, reply.quality) > REFUSED
        before = reply
        if reply.function not in RECORDED_READS:
            continue
        block = reply.address if _has_block(line, device, reply) else None
        if block is None and not (silent or _concerns(reply, reads)):
            continue
        place = reply.function, reply.address, reply.registers
        last = found[-1].last if found else None
        is_next = last is None or not is_repeated(last, reply)
        pause = 0.0 if last is None else (reply.sent - last.ended) / 1e6
        if is_next and (last is None or place in places or pause > PAUSE_OF_CYCLES):
            found.append(RepeatedCycle(reply.sent, reply, block))
            places = set()
        else:
            block = found[-1].block if block is None else block
            found[-1] = found[-1]._replace(last=reply, block=block)
        places.add(place)
    return found, len(replies) < ROWS_AHEAD


def _has_block(line: ReplayLine, device: int, reply: RecordedReply) -> bool:
    """Return True for a read of the drive's block, which a monitor reads for its values."""
    last = reply.address + reply.registers
    return any(reply.address <= at < last for at in line.in_block(device, reply.sent))


def _concerns(reply: RecordedReply, reads: Sequence[PlannedRead]) -> bool:
    return any(
        read.function == reply.function
        and read.address < reply.address + reply.registers
        and reply.address < read.address + read.count
        for read in reads
    )


class RepeatedTurn(PolledTurn):
    """A cycle of a record. Its values are the last ones by its end; it fails if it failed then."""

    def __init__(self, line: ReplayLine, device: int, cycle: RepeatedCycle) -> None:
        super().__init__(0, cycle.begun / 1e6, {})
        self.ended = cycle.last.ended / 1e6
        self.block = cycle.block
        self._line, self._device, self._last = line, device, cycle.last

    def take(self, read: PlannedRead, after: float) -> Reply | None:
        """Return the last good reply, however old. Raises NotRecorded without one."""
        if self._last.quality > REFUSED:
            raise self._last.error(self._device)
        place = self._device, read.function, read.address
        try:
            return self._line.last_reply(*place, read.count)
        except ExchangeError as error:
            # another cycle may have failed; this one has read none of it
            refused = isinstance(error, DeviceException)
            raise error if refused else NotRecorded(*place) from error

    def take_more(self, read: PlannedRead) -> Reply | None:
        """Return the same for a read beyond the plan."""
        return self.take(read, -math.inf)


class RepeatedCycles:
    """The next cycles of one drive. For the loop of the replay's line."""

    def __init__(self, line: ReplayLine, device: int) -> None:
        self._line, self._device = line, device
        self._reads: Sequence[PlannedRead] = ()
        self._ahead: deque[RepeatedCycle] = deque()
        self._sought = 0.0
        """Time from which the record is read again."""

    async def next(self, reads: Sequence[PlannedRead], at: float, period: float) -> PolledTurn:
        """Wait for the end of the next cycle, which is due `at` a time.

        If the line was lost then, or the record has no cycle soon, it is a cycle of that time.
        """
        clock = self._line.clock
        now = clock.monotonic()
        due, cycle = max(at, now), self._following(now, reads)
        works = self._line.state_at(due).status is LineStatus.CONNECTED
        if works and cycle is not None and cycle.begun / 1e6 < due + max(period, SOON):
            lost = self._line.lost_within(due, cycle.begun / 1e6)
            if lost is None:
                await clock.sleep(cycle.last.ended / 1e6 - now)
                return RepeatedTurn(self._line, self._device, cycle)
            due = lost.since
        await clock.sleep(due - now)
        return PolledTurn(0, clock.monotonic(), {})

    def last(self, reads: Sequence[PlannedRead]) -> PolledTurn | None:
        """Return the cycle that ended last, as one of this time; None if that is too long ago."""
        now = self._line.clock.monotonic()
        found, _ = cycles_of(self._line, self._device, now - SOON, reads)
        ended = [cycle for cycle in found if cycle.last.ended <= to_microseconds(now)]
        if not ended or self._line.state_at(now).status is not LineStatus.CONNECTED:
            return None
        turn = RepeatedTurn(self._line, self._device, ended[-1])
        turn.begun = turn.ended = now
        return turn

    def _following(self, now: float, reads: Sequence[PlannedRead]) -> RepeatedCycle | None:
        """Return the first cycle that ends after a time; None without one."""
        if reads != self._reads:
            self._reads, self._sought = reads, 0.0
            self._ahead.clear()
        at = to_microseconds(now)
        while self._ahead and self._ahead[0].last.ended <= at:
            self._ahead.popleft()
        if len(self._ahead) < 2 and now >= self._sought:  # the last one may go on
            since = self._ahead[0].begun / 1e6 if self._ahead else now - LONGEST_CYCLE
            found, is_end = cycles_of(self._line, self._device, since, reads)
            self._ahead = deque(cycle for cycle in found if cycle.last.ended > at)
            if is_end:
                self._sought = now + END_SOUGHT_AGAIN
        return self._ahead[0] if self._ahead else None
