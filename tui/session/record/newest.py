"""Newest reply to each read of a device at a time of a record: the state that a replay shows."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

from tui.bus.errors import ExchangeError, NotRecorded
from tui.bus.tally import Tally

from .replay_reader import (
    ROWS_AHEAD,
    MeanOf,
    RecordedReply,
    ReplayReader,
    reduced_in,
    reply_in,
)
from .schema import COPY, GOOD, RECORDED_READS, REFUSED, SILENT, WRONG

PASSED_OVER = 120_000_000
"""Microseconds beyond which only the newest replies are read, not those in between."""
SOUGHT_AGAIN = 1_000_000
"""Microseconds after which the end of a file is read again: it may still be written."""
REPEATED_WITHIN = 2_000_000
"""Microseconds within which a repeated request replaces the failed one before it."""
BLOCK_FUNCTION = 3
"""Function by which indirect blocks and scanners are read."""
InBlock = Callable[[int], Mapping[int, tuple[int, int]]]
"""By a time in microseconds: function and address of the parameter in each register of a block."""
PAUSE_OF_CYCLES = 0.1
"""Seconds without a request that end a cycle of a monitor."""


def ends_of_cycles(replies: Sequence[RecordedReply], until: float) -> list[float]:
    """Return when the cycles of a monitor ended, up to a time, by the pauses after them."""
    ends = [
        reply.ended / 1e6
        for reply, following in pairwise(replies)
        if following.sent - reply.ended > PAUSE_OF_CYCLES * 1e6
    ]
    return [end for end in ends if end <= until]


def count_recorded(tally: Tally, device: int, reply: RecordedReply) -> None:
    """Count an exchange of the record, as the line counted it then.

    Reduced replies are not counted: neither their number nor their times are those of one exchange.
    """
    if reply.quality > COPY or reply.reduced:
        return
    seconds = (reply.ended - reply.sent) / 1e6
    tally.count_sent(device, 0)
    if reply.repeat:
        tally.count_repeat(device)
    tally.count_end(device, seconds, 0)
    if reply.quality in (GOOD, REFUSED, COPY):
        tally.count_reply(device, seconds)
        tally.count_good(device, was_heard=True)
        if reply.quality == REFUSED:
            tally.count_exception(device, reply.received[1] if reply.received else 0)
    elif reply.quality == SILENT:
        tally.count_silence(device, searched=False)
    else:
        (tally.count_wrong if reply.quality == WRONG else tally.count_checksum)(device)
        tally.count_minute(device, "damaged")


class NewestReplies:
    """Follows the replies of one device through a record."""

    def __init__(
        self, reader: ReplayReader, device: int, ended: Callable[[RecordedReply], None]
    ) -> None:
        """`ended` is called with each exchange that ends while time goes on."""
        self._reader = reader
        self._device = device
        self._ended = ended
        self._at: int | None = None
        self._raw_since = reader.raw_since(device)
        self._by_register: dict[tuple[int, int], RecordedReply] = {}
        self._good: dict[tuple[int, int], RecordedReply] = {}
        """Last good reply of each register whose newest one is not good."""
        self._refused: dict[tuple[int, int, int], RecordedReply] = {}
        self._tables: dict[str, _Following] = {}
        self.heard: int | None = None
        """When its last reply ended, in microseconds; None before the first."""
        self.failures = 0
        """Number of exchanges without a reply since."""
        self.last_failure: RecordedReply | None = None
        self.mean_of: MeanOf = lambda place: None
        self.in_block: InBlock = lambda utc: {}

    def move(self, at: int) -> None:
        """Go to a later time in microseconds, or begin there."""
        if self._at is None or at - self._at > PASSED_OVER:
            newest = self._reader.newest(self._device, self._before_repeat(at))
            for reply in sorted(newest, key=lambda reply: (reply.ended, reply.reduced)):
                self._take(reply)
            if self.failures:  # the newest ones have one for each place only
                failed = self._reader.failures(self._device, self.heard or 0, at)
                self.failures = max(self.failures, failed)
            # exchanges that had begun by then may end later
            begin = at - 2 * REPEATED_WITHIN
            self._tables = {name: _Following(begin, at) for name in ("reply", "reduced")}
        self._at = at
        for table, following in self._tables.items():
            for reply, repeated in following.until(at, partial(self._read, table)):
                if repeated or self._take(reply):
                    self._ended(reply)

    def _before_repeat(self, at: int) -> int:
        """Return a time before the last try, if that failed and is repeated soon."""
        replies = self._reader.replies_from(self._device, at - REPEATED_WITHIN)
        for reply, following in reversed(list(pairwise(replies))):
            if reply.ended <= at < following.ended and is_repeated(reply, following):
                return self._before_repeat(reply.sent - 1)
        return at

    def _read(self, table: str, last: tuple[int, int]) -> tuple[list[RecordedReply], Any]:
        rows = self._reader.following(table, self._device, last)
        form = reply_in if table == "reply" else reduced_in
        return [form(row) for row in rows], (rows[-1][0], rows[-1][2]) if rows else last

    def _take(self, reply: RecordedReply) -> bool:
        """Take a reply; return False for reduced ones whose replies are recorded as well."""
        if reply.reduced and reply.sent >= self._raw_since:
            return False
        if reply.quality in (GOOD, REFUSED):
            self.heard, self.failures = max(self.heard or 0, reply.ended), 0
        else:
            self.failures += 1
            self.last_failure = reply
        if reply.function not in RECORDED_READS:
            return True
        if reply.quality == REFUSED:
            # a refused long read does not concern its registers one by one
            key = reply.function, reply.address, reply.registers
            self._refused[key] = _later(self._refused.get(key), reply)
            return True
        read = range(reply.address, reply.address + reply.registers)
        for register in read:
            self._note((reply.function, register), reply)
        for register, (function, address) in self.in_block(reply.sent).items():
            if register in read and reply.function == BLOCK_FUNCTION:
                first = address - (register - reply.address)
                self._note((function, address), reply._replace(function=function, address=first))
        return True

    def _note(self, place: tuple[int, int], reply: RecordedReply) -> None:
        before = self._by_register.get(place)
        if before is not None and before.quality == GOOD != reply.quality:
            self._good[place] = before
        elif reply.quality == GOOD:
            self._good.pop(place, None)
        self._by_register[place] = _later(before, reply)

    def has(self, function: int, register: int) -> bool:
        """Return True if a register was read, or was to be."""
        return (function, register) in self._by_register

    def last_words(self, function: int, address: int, count: int) -> tuple[tuple[int, ...], int]:
        """Return registers as they were read last, whatever has failed since; see `words`."""
        try:
            return self.words(function, address, count)
        except ExchangeError:
            first = self._good.get((function, address))
            places = range(address, address + count)
            if first is None or any(self._good.get((function, at)) is not first for at in places):
                raise
            return self._words_of(first, places)

    def words(self, function: int, address: int, count: int) -> tuple[tuple[int, ...], int]:
        """Return registers and when they were read (microseconds); raise the recorded error.

        Raises NotRecorded for registers that were not read, or not by one request.
        """
        places = range(address, address + count)
        found = [self._by_register.get((function, register)) for register in places]
        newest = max((reply.ended for reply in found if reply is not None), default=0)
        refused = self._refused.get((function, address, count))
        if refused is not None and refused.ended >= newest:
            raise refused.error(self._device)
        first = found[0]
        for reply in found:
            if reply is not None and reply.quality != GOOD and reply.ended == newest:
                if reply.reduced:  # how they failed is not known any more
                    raise NotRecorded(self._device, function, address)
                raise reply.error(self._device)
        if first is None or any(reply is not first for reply in found):
            raise NotRecorded(self._device, function, address)
        return self._words_of(first, places)

    def _words_of(self, reply: RecordedReply, places: range) -> tuple[tuple[int, ...], int]:
        words = [reply.word(register, self.mean_of) for register in places]
        known = tuple(word for word in words if word is not None)
        if len(known) < len(places):
            raise NotRecorded(self._device, reply.function, places.start)
        return known, reply.ended


def _later(before: RecordedReply | None, reply: RecordedReply) -> RecordedReply:
    return reply if before is None or reply.ended >= before.ended else before


class _Following:
    """Rows of one table in the order of their time, some read ahead."""

    def __init__(self, begin: int, known_to: int) -> None:
        self.last = (begin, -1)
        self.skip = known_to
        """Time up to which replies are known already."""
        self._ahead: deque[RecordedReply] = deque()
        self._sought = 0

    def until(
        self, at: int, read: Callable[[tuple[int, int]], tuple[list[RecordedReply], Any]]
    ) -> list[tuple[RecordedReply, bool]]:
        """Return the replies that have ended since the last call; True for a repeated request."""
        found: list[tuple[RecordedReply, bool]] = []
        while True:
            if not self._ahead and at >= self._sought:
                rows, self.last = read(self.last)
                self._ahead.extend(rows)
                if len(rows) < ROWS_AHEAD:
                    self._sought = at + SOUGHT_AGAIN
            if not self._ahead or self._ahead[0].ended > at:
                return found
            reply = self._ahead.popleft()
            repeated = bool(self._ahead) and is_repeated(reply, self._ahead[0])
            if reply.ended > self.skip:
                found.append((reply, repeated))


def is_repeated(reply: RecordedReply, following: RecordedReply) -> bool:
    """Return True if a failed request was repeated at once: only its last try counts."""
    if reply.quality in (GOOD, REFUSED):
        return False
    same = (reply.function, reply.address) == (following.function, following.address)
    soon = following.sent - reply.ended < REPEATED_WITHIN
    return same and soon and following.repeat == reply.repeat + 1
