"""The record of a replay: what was known of its drives at a time."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

from tui.bus.errors import LineError, LineFailed
from tui.bus.model import IdentificationObjects, LineState, LineStatus, Reply
from tui.bus.tally import Tally

from .block_times import BlockTimes
from .newest import NewestReplies, count_recorded
from .reader import MOST_FILES
from .replay_clock import ReplayClock
from .replay_reader import MeanOf, RecordedReply, ReplayReader
from .schema import EventRow, to_microseconds

_EVENTS = ("fault", "stop", "done", "failed", "alarm", "trigger", "notice", "commander")
"""Kinds of recorded events to which a replay can jump."""


class ReplayedRecord:
    """The files of a line at the time of a clock. For any thread."""

    clock: ReplayClock
    _tally: Tally

    def __init__(self, path: Path, files: Sequence[Path]) -> None:
        """Open `files`, the oldest first; `path` if there are none.

        Raises RecordDamaged, sqlite3.Error.
        """
        self.path = path
        self.files = list(files)[-MOST_FILES:] or [path]
        self._reader = ReplayReader(*self.files)
        try:
            begin, end = self._reader.span(path)
            self.span = begin / 1e6, end / 1e6
            self.recorded_line = self._reader.line
            self.devices = self._reader.devices()
            self.events = tuple(self._reader.events_of(_EVENTS))
            """Events to which a replay can jump, by time."""
            self._profiles = self._reader.events_of(("profile",))
            self._states = self._reader.events_of(("line",))
            self._blocks = {
                device: BlockTimes(self._reader.notes_of(device, "block"))
                for device in self.devices
            }
        except BaseException:
            self._reader.close()
            raise
        self._newest: dict[int, NewestReplies] = {}
        self._lock = threading.RLock()
        """Held while the record is read."""

    def profile_note(self, device: int) -> EventRow | None:
        """Return the event that names a device's profile by now; the first one if it came later."""
        now = to_microseconds(self.clock.monotonic())
        own = [event for event in self._profiles if event.device == device]
        by_now = [event for event in own if event.utc <= now]
        return by_now[-1] if by_now else own[0] if own else None

    def state_at(self, time: float) -> LineState:
        """Return the state of the line at a time of the record."""
        at = to_microseconds(time)
        last = next((event for event in reversed(self._states) if event.utc <= at), None)
        if last is None:
            return LineState(LineStatus.CONNECTED, "", self.clock.begin)
        status, _, reason = last.text.partition(" ")
        with suppress(ValueError):
            if (found := LineStatus(status)) in (LineStatus.LOST, LineStatus.CONNECTING):
                return LineState(found, reason, last.utc / 1e6)
        return LineState(LineStatus.CONNECTED, "", last.utc / 1e6)

    def lost_within(self, since: float, until: float) -> LineState | None:
        """Return how the line was first lost in a time; None if it was not."""
        span = range(to_microseconds(since), to_microseconds(until) + 1)
        states = (self.state_at(event.utc / 1e6) for event in self._states if event.utc in span)
        return next((state for state in states if state.status is LineStatus.LOST), None)

    def in_block(self, device: int, utc: int) -> Mapping[int, str]:
        """Return the codes by register of a device's block at a time in microseconds."""
        return self._blocks[device].at(utc)

    def identification(self, device: int, function: int) -> IdentificationObjects | None:
        """Return what a device reported by a function; None if it is not recorded."""
        with self._reading():
            return self._reader.identification(device, function)

    def last_replies(
        self, device: int, places: Iterable[tuple[int, int, int]]
    ) -> list[Reply | None]:
        """Return registers as they were read last, whatever has failed since; None if never.

        A place is a function, an address and a number of registers.
        """
        replies: list[Reply | None] = []
        with self._reading():
            newest = self._of(device)
            for function, address, count in places:
                found = None
                if newest.has(function, address):
                    with suppress(LineError):
                        words, ended = newest.last_words(function, address, count)
                        found = Reply(words, ended / 1e6)
                replies.append(found)
        return replies

    def last_reply(self, device: int, function: int, address: int, count: int) -> Reply:
        """Return the same of one place. Raises the error of its last read if there is none."""
        with self._reading():
            words, ended = self._of(device).last_words(function, address, count)
        return Reply(words, ended / 1e6)

    @contextmanager
    def _reading(self) -> Iterator[None]:
        try:
            with self._lock:
                yield
        except sqlite3.Error as error:
            raise LineFailed(f"The record cannot be read: {error}.") from error

    def last_before(self, device: int, since: float, at: float, most: int) -> list[RecordedReply]:
        """Return the last replies of a device in a time of the record, the newest first."""
        span = to_microseconds(since), to_microseconds(at)
        try:
            with self._lock:
                return self._reader.last_before(device, *span, most)
        except sqlite3.Error:
            return []

    def replies_from(self, device: int, since: float) -> list[RecordedReply]:
        """Return the next replies of a device whose requests were sent from a time on."""
        try:
            with self._lock:
                return self._reader.replies_from(device, to_microseconds(since))
        except sqlite3.Error:
            return []

    def last_of_each(self, device: int, since: float, at: float) -> list[RecordedReply]:
        """Return the last replies to each read of a device in a time, the oldest first."""
        span = to_microseconds(since), to_microseconds(at)
        try:
            with self._lock:
                return self._reader.last_of_each(device, *span)
        except sqlite3.Error:
            return []

    def use_profile(
        self, device: int, mean_of: MeanOf, place_of: Callable[[str], tuple[int, int] | None]
    ) -> None:
        """Set which registers of a device have a mean, and where its parameters are, by code."""

        def in_block(utc: int) -> Mapping[int, tuple[int, int]]:
            codes = self.in_block(device, utc)
            places = {register: place_of(code) for register, code in codes.items()}
            return {register: place for register, place in places.items() if place is not None}

        with self._lock:
            self._newest.pop(device, None)  # it may have taken words of a block already
            newest = self._newest_of(device)
            newest.mean_of, newest.in_block = mean_of, in_block

    def _newest_of(self, device: int) -> NewestReplies:
        if device not in self._newest:
            self._newest[device] = NewestReplies(
                self._reader, device, partial(count_recorded, self._tally, device)
            )
        return self._newest[device]

    def _of(self, device: int) -> NewestReplies:
        """The newest replies of a device, at the present time; with the lock."""
        newest = self._newest_of(device)
        newest.move(to_microseconds(self.clock.monotonic()))
        return newest
