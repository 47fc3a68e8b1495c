"""A line whose devices answer from a record, as they did then. Nothing is sent anywhere."""

from __future__ import annotations

import asyncio
import math
import sqlite3
import threading
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from tui.bus.api import LineWorker
from tui.bus.bounds import MOST_BYTES
from tui.bus.errors import (
    LineClosed,
    LineLost,
    LinkSyntaxError,
    NoAnswer,
    RequestRefused,
)
from tui.bus.expectation import IDENTIFY
from tui.bus.limits import Limits
from tui.bus.link import Link, SerialLink, TcpLink, parse_link
from tui.bus.model import (
    DeviceState,
    IdentificationObjects,
    LineCounters,
    LineState,
    LineStatus,
    Priority,
    Reply,
    Timing,
)
from tui.bus.prepared import PreparedWrite
from tui.bus.schedule.pace import Pace
from tui.bus.schedule.worker import Worker
from tui.bus.shared_state import SharedState
from tui.bus.tally import Tally
from tui.bus.trace import Frame
from tui.wire.frames import frame

from .rebuilt_frames import RebuiltFrame, frames_of
from .replay_clock import WAKING_TURNS, ReplayClock
from .replayed_record import ReplayedRecord
from .schema import RecordDamaged, to_microseconds

NO_HOST = "replay.invalid"
"""A name that no host can have: the line of a replay must never be reached."""


def replayed_link(line: str) -> Link:
    """Return the recorded link, to plan reads as then; it leads to no port and no host."""
    try:
        link = parse_link(line)
    except LinkSyntaxError:
        return SerialLink("replay")
    if isinstance(link, SerialLink):
        return replace(link, path="replay")
    if isinstance(link, TcpLink):
        return replace(link, host=NO_HOST)
    return replace(link, host=NO_HOST)


def wire_frame(rebuilt: RebuiltFrame, link: Link) -> Frame:
    """Return a frame as the line of a link has it, with checksum or head."""
    data = rebuilt.data
    if rebuilt.checked and isinstance(link, TcpLink):
        data = bytes(4) + (len(data) + 1).to_bytes(2, "big") + bytes([rebuilt.device]) + data
    elif rebuilt.checked:
        data = frame(rebuilt.device, data)
    return Frame(rebuilt.wall, "out" if rebuilt.request else "in", data[:MOST_BYTES], rebuilt.note)


T = TypeVar("T")

REPLAY_SENDS_NOTHING = "This is a replay: nothing is sent to a drive."
COUNTED_EVERY = 1.0
BEFORE_SECOND = 1e-5
"""Seconds before the end of a second at which its exchanges are counted."""
SILENT_AFTER = 2
"""Failed requests in a row after which any other one would have failed, too."""
FRAMES_OF = 10.0
"""Seconds of the record whose frames are listed."""
STARTS_WITHIN = 10.0
"""Seconds within which the thread of a line starts and ends."""


class ReplayLine(ReplayedRecord):
    """A ModbusLine on a record; see tui.bus.api. Reads return what was known at the clock's time.

    A drive that did not answer then does not answer now. What was never read raises NotRecorded.
    """

    def __init__(
        self,
        path: Path,
        at: float | None = None,
        *,
        lead: float = 0.0,
        files: Sequence[Path] = (),
    ) -> None:
        """Open a record, `lead` seconds before a time (since 1970; default: its begin).

        `files` are those of `path`, the oldest first, if it is not a file. Raises RecordDamaged,
        sqlite3.Error.
        """
        super().__init__(path, files)
        begin, end = self.span
        start = begin if at is None else min(max(at, begin), end)
        self.at = start
        """The time at which the replay begins, after `lead`."""
        self.clock = ReplayClock(begin, end, max(begin, start - lead))
        self.link = replayed_link(self.recorded_line)
        self.read_only = True
        self.held = REPLAY_SENDS_NOTHING
        self.timing = Timing()
        self.pace = Pace()
        self.facts = SharedState()
        self.facts.gated = True
        self._frames: tuple[float, tuple[Frame, ...]] = (0.0, ())
        """The frames before a time."""
        self._tally = Tally(clock=self.clock.monotonic)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None
        self._workers: set[asyncio.Task[object]] = set()
        self._closed = False

    # A line

    @property
    def state(self) -> LineState:
        """The state of the line at the time of the clock."""
        if self._closed:
            return LineState(LineStatus.CLOSED, "", self.clock.begin)
        return self.state_at(self.clock.monotonic())

    @property
    def trace(self) -> tuple[Frame, ...]:
        """The frames of the last seconds, made of the rows of the record."""
        now = self.clock.monotonic()
        if self._frames[0] != now:
            span = to_microseconds(now - FRAMES_OF), to_microseconds(now)
            try:
                with self._lock:
                    rows = sorted(
                        row
                        for device in self.devices
                        for row in self._reader.exchanges_of(device, *span)
                    )
            except sqlite3.Error:
                return ()
            found = [wire_frame(each, self.link) for row in rows for each in frames_of(row)]
            self._frames = now, tuple(item for item in found if item.time <= now)
        return self._frames[1]

    def _count_all(self) -> None:
        """Count what has ended by now."""
        with suppress(sqlite3.Error), self._lock:
            for device in self.devices:
                self._of(device)

    @property
    def counters(self) -> LineCounters:
        """Counts of the exchanges that were replayed."""
        if not self._closed:
            self._count_all()
        return self._tally.frozen()

    def open(self, *, wait: float | None = None) -> None:
        """Start the thread of the line."""
        started: Future[None] = Future()
        self._thread = threading.Thread(
            target=self._run, args=(started,), name="replay", daemon=True
        )
        self._thread.start()
        started.result(STARTS_WITHIN)

    def _run(self, started: Future[None]) -> None:
        loop = self._loop = asyncio.new_event_loop()
        loop.call_soon(started.set_result, None)
        try:
            loop.run_until_complete(self._work())
        finally:
            loop.close()

    async def _work(self) -> None:
        self._workers |= {
            asyncio.ensure_future(work) for work in (self.clock.follow(), self._count())
        }
        while not self._closed or self._workers:
            await asyncio.wait(self._workers, timeout=0.05)
            self._workers = {task for task in self._workers if not task.done()}
            if self._closed:
                for task in self._workers:
                    task.cancel()

    async def _count(self) -> None:
        """Count what ends, in its second: the counts of the last minute are by seconds."""
        while True:
            self._count_all()
            now = self.clock.monotonic()
            following = (now + 2 * BEFORE_SECOND) // COUNTED_EVERY + 1
            await self.clock.sleep(following * COUNTED_EVERY - BEFORE_SECOND - now)

    def close(self) -> None:
        """Close the line; may be called twice."""
        if self._closed:
            return
        self._closed = True
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(STARTS_WITHIN)
        with self._lock:
            self._reader.close()

    def describe(self, device: int, limits: Limits) -> None:
        """Limits are those of the record."""

    def device_state(self, device: int) -> DeviceState:
        """Return what was known of a device."""
        try:
            with self._lock:
                newest = self._of(device)
        except sqlite3.Error:
            return DeviceState(None, 0, None, None, None, None, None)
        heard = None if newest.heard is None else newest.heard / 1e6
        answers = None if heard is None and not newest.failures else not newest.failures
        silent = heard if newest.failures else None
        return DeviceState(answers, newest.failures, silent, None, None, None, heard)

    async def read(
        self,
        device: int,
        address: int,
        count: int = 1,
        *,
        priority: Priority = Priority.POLL,
        function: int = 3,
        max_age: float = 0.0,
        within: float | None = None,
    ) -> Reply:
        """Return the registers as they were read last; raises the recorded error."""
        self._check()
        with self._reading():
            newest = self._of(device)
            if newest.last_failure is not None and newest.failures >= SILENT_AFTER:
                # as another request to it would have failed
                failure = newest.last_failure._replace(function=function, address=address)
                raise failure.error(device)
            words, ended = newest.words(function, address, count)
        return Reply(words, ended / 1e6)

    def _check(self) -> None:
        if self._closed:
            raise LineClosed
        if (state := self.state).status is not LineStatus.CONNECTED:
            raise LineLost(state.reason)

    async def identify(
        self,
        device: int,
        *,
        priority: Priority = Priority.OPERATOR_READ,
        within: float | None = None,
        function: int = IDENTIFY,
    ) -> IdentificationObjects:
        """Return the identification that was recorded, before or after this time."""
        if (found := self.identification(device, function)) is None:
            raise NoAnswer(device, function, 0)
        return found

    async def write(self, device: int, address: int, values: Sequence[int], **_: Any) -> float:
        """Refuse."""
        raise RequestRefused(REPLAY_SENDS_NOTHING)

    async def read_write(
        self, device: int, read_address: int, count: int, write_address: int,
        values: Sequence[int], **_: Any,
    ) -> Reply:  # fmt: skip
        """Refuse."""
        raise RequestRefused(REPLAY_SENDS_NOTHING)

    async def diagnose(self, device: int, subfunction: int, data: int = 0, **_: Any) -> int:
        """Refuse."""
        raise RequestRefused(REPLAY_SENDS_NOTHING)

    async def broadcast(self, address: int, values: Sequence[int], **_: Any) -> float:
        """Refuse."""
        raise RequestRefused(REPLAY_SENDS_NOTHING)

    def send_prepared(self, writes: Sequence[PreparedWrite], ended: Callable[[str], None]) -> None:
        """Refuse."""
        ended(REPLAY_SENDS_NOTHING)

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        """Run a coroutine in the line's own loop."""
        loop = self._loop
        if loop is None or self._closed:
            raise LineClosed
        worker = Worker(work, name, loop)

        def start() -> None:
            if (task := worker.start()) is not None:
                self._workers.add(task)

        try:
            loop.call_soon_threadsafe(start)
        except RuntimeError:
            raise LineClosed from None
        return worker

    async def run_to(self, at: float, takes: float = math.inf) -> None:
        """Go on to a later time, whatever the speed; for the loop of any thread.

        If it takes more than `takes` seconds of processor time, the rest is left out.
        """

        async def run() -> None:
            for _ in range(WAKING_TURNS):  # work that was just started begins to sleep
                await self.clock.sleep(0)
            end = min(at, self.clock.end)
            if not await self.clock.run_to(end, takes):
                self.clock.skip_to(end)

        await self.do(run, "replay to a time")

    async def do(self, work: Callable[[], Coroutine[Any, Any, None]], name: str) -> None:
        """Run a coroutine in the line's loop to its end; for the loop of any thread."""
        done: Future[None] = Future()

        async def run() -> None:
            if not done.set_running_or_notify_cancel():
                return
            try:
                await work()
                done.set_result(None)
            except BaseException as error:
                done.set_exception(error)
                raise

        self.spawn(run, name)
        await asyncio.wrap_future(done)


__all__ = ["REPLAY_SENDS_NOTHING", "RecordDamaged", "ReplayLine"]
