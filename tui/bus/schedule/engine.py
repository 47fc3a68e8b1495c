"""The thread and the loop of a line, and the entry points from other threads."""

from __future__ import annotations

import asyncio
import logging
import signal
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from time import time
from typing import TypeVar

from tui.wire.frames import pdu_of

from ..errors import HOPELESS, LineBehind, LineClosed, LineError, LineLost
from ..line_events import StateChanged
from ..link import Link, SerialLink, TcpLink, label
from ..master import LineContext, MonotonicClock
from ..model import EndedExchange, LineState, LineStatus, Timing
from ..prepared import PreparedWrite
from ..program_use import ProgramUse
from ..shared_state import SharedState
from ..tally import Tally
from ..trace import Trace
from .connection import Connection, open_transport
from .dispatcher import Dispatcher
from .inside import LineInside, SharedLine
from .last_way import Ended, LastWay
from .pace import Pace
from .patience import Devices
from .queue import Job
from .worker import ThreadWork, Worker

T = TypeVar("T", Job, Worker)

log = logging.getLogger(__name__)

WORKERS_END = 2.0
"""Seconds that cancelled workers have to end when the line is closed."""


class Engine:
    """Runs one line. `_lock` guards the phase, so that nothing enters a loop that has ended.

    It may be taken twice by one thread: a signal handler may close the line in the midst of a
    request that its own thread is handing over.
    """

    def __init__(
        self,
        link: Link,
        timing: Timing,
        clock: MonotonicClock,
        facts: SharedState | None = None,
        share: Callable[[LineInside], SharedLine] | None = None,
    ) -> None:
        self.facts = facts or SharedState()
        self.pace = Pace()
        self.trace = Trace(timing.trace_length)
        self.tally = Tally(use=ProgramUse(clock), clock=clock)
        self.devices = Devices(timing, mistakable=not isinstance(link, TcpLink))
        self.state = LineState(LineStatus.CLOSED, "", clock())
        self._link = link
        self._timing = timing
        self._clock = clock
        self._lock = threading.RLock()
        self._news = threading.Condition()
        self._error: LineError | None = None
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._accepting = False
        self._closed = False
        self._main: asyncio.Task[None] | None = None
        self._workers: set[asyncio.Task[object]] = set()
        self._dispatcher = Dispatcher(
            self.devices,
            self.tally,
            timing,
            clock,
            gateway=isinstance(link, TcpLink),
            buffers=not isinstance(link, SerialLink),
            facts=self.facts,
        )
        self.facts.keep_alives.changed = self._wake
        around = LineContext(timing, self.trace, self.tally, clock, self._dispatcher.stray)
        inside = LineInside(
            link,
            around,
            self._dispatcher,
            self.devices,
            self.pace,
            lambda: self.state,
            lambda: self._error,
            self._take,
        )
        self._shared = share(inside) if share is not None else None
        self._last_way = self._dispatcher.last_way = LastWay(
            lambda message: self._shared is not None and self._shared.pass_on(message),
            self._dispatcher.wake,
            lambda: open_transport(link, around, alone=False),
            self._note_prepared,
        )
        self._connection = Connection(
            link,
            around,
            self._dispatcher,
            self._changed,
            self._quiet_after,
            self._shared,
            self._last_way,
        )

    def start(self, wait: float | None) -> None:
        """Start the thread; see Line.open."""
        with self._lock:
            if self._closed:
                raise LineClosed
            if self._thread is None:
                self._loop = asyncio.new_event_loop()
                self._accepting = True
                self._thread = threading.Thread(
                    target=self._work, args=(self._loop,), name=label(self._link), daemon=True
                )
                self._thread.start()
        if wait is not None:
            self._await_connection(wait)

    def _await_connection(self, wait: float) -> None:
        with self._news:
            while not self._news.wait_for(self._is_decided, wait):
                if self._shared is None or not self._shared.starts:
                    break
            if self._takes_stops():
                return
            error = self._error
        self.close()
        raise error or LineLost(f"{label(self._link)} was not connected within {wait:g} s.")

    def _is_decided(self) -> bool:
        return self._takes_stops() or self._closed or isinstance(self._error, HOPELESS)

    def _takes_stops(self) -> bool:
        connected = self.state.status is LineStatus.CONNECTED
        return connected or isinstance(self._error, LineBehind) or self._waits_for_holder()

    def _waits_for_holder(self) -> bool:
        """True if the process that holds the line does not answer: a stop ends it, or fails."""
        return self._shared is not None and self._shared.frozen

    def close(self) -> None:
        """End the loop and its thread; see Line.close."""
        with self._lock:
            self._closed = True
            if self._accepting and self._loop is not None:
                self._accepting = False
                self._loop.call_soon_threadsafe(self._stop)
            thread = self._thread
        with self._news:
            self._news.notify_all()
        if thread is not None and thread is not threading.current_thread():
            thread.join()

    def _stop(self) -> None:
        if self._main is not None:
            self._main.cancel()

    def _wake(self) -> None:
        """Something has changed that the loop may wait for; for any thread."""
        if self._loop is not None:
            with suppress(RuntimeError):  # it has ended
                self._loop.call_soon_threadsafe(self._dispatcher.wake)

    def submit(self, job: Job) -> None:
        """Hand a job to the loop. Raises LineClosed."""
        job.program = self.facts.me.id
        job.stamp = self.facts.stops.stamp(job.request.device)
        job.requested = self._clock()
        self._enter(self._take, job)

    def _enter(self, action: Callable[[T], None], argument: T) -> None:
        """Have the loop do something. Raises LineClosed."""
        with self._lock:
            if not self._accepting or self._loop is None:
                raise LineClosed
            try:
                self._loop.call_soon_threadsafe(_do, action, argument)
            except RuntimeError:
                raise LineClosed from None

    def send_prepared(self, writes: Sequence[PreparedWrite], ended: Ended) -> None:
        """Send finished frames around the queue; `ended` is called in the loop. Raises LineClosed.

        It shares nothing with `submit` and `spawn`, which may be what has failed.
        """
        if self._loop is None:
            raise LineClosed
        try:
            self._loop.call_soon_threadsafe(self._last_way.put, writes, ended)
        except RuntimeError:
            raise LineClosed from None

    def _note_prepared(self, data: bytes) -> None:
        """Note a finished frame that was sent."""
        now = self._clock()
        self.trace.add(now, "out", data)
        if (record := self.facts.record) is not None:
            sent = pdu_of(data, tcp=isinstance(self._link, TcpLink))
            if sent is not None:
                pdu = bytes([sent.function]) + sent.body
                record(EndedExchange(sent.device, pdu, "sent", b"", now, now, time()))

    def _take(self, job: Job) -> None:
        if self._closed:
            job.fail(LineClosed())
        elif self._connection.refusal is not None:
            self._dispatcher.fail(job, str(self._connection.refusal))
        else:
            self._dispatcher.submit(job)

    def spawn(self, work: ThreadWork, name: str) -> Worker:
        """Start a worker in the loop. Raises LineClosed."""
        if self._loop is None:
            raise LineClosed
        worker = Worker(work, name, self._loop)
        self._enter(self._begin, worker)
        return worker

    def _begin(self, worker: Worker) -> None:
        if self._closed:
            worker.abandon()
            return
        task = worker.start()
        if task is not None:
            self._workers.add(task)
            task.add_done_callback(self._workers.discard)

    def _changed(self, state: LineState, error: LineError | None = None) -> None:
        with self._news:
            self.state = state
            self._error = error
            self._news.notify_all()
        # an error here must not end the loop of the line: a stop may wait for it
        if self._shared is not None:
            try:
                self._shared.tell_state()
            except Exception:
                log.exception("the line's state was not sent to the programs on it")
        try:
            self.facts.events.emit(StateChanged(state))
        except Exception:
            log.exception("a change of the line was not passed on")

    def _work(self, loop: asyncio.AbstractEventLoop) -> None:
        """The thread: run the loop until closed, then leave nothing behind."""
        if hasattr(signal, "pthread_sigmask"):
            # for the main thread, which alone runs handlers: a signal taken here would not wake it
            signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        try:
            self._main = loop.create_task(self._connection.run())
            loop.run_until_complete(self._main)
        except asyncio.CancelledError:
            pass
        finally:
            with self._lock:
                self._accepting = False
                self._closed = True
            loop.run_until_complete(self._end())
            loop.close()
            self._changed(LineState(LineStatus.CLOSED, "", self._clock()))

    async def _end(self) -> None:
        """Fail the waiting requests, end the workers."""
        # first take what other threads submitted before the line was closed
        await asyncio.sleep(0)
        quiet = self._quiet_after()
        self._dispatcher.fail_all("The line is closed.", LineClosed)
        if self._shared is not None:
            await asyncio.sleep(0)  # first send the errors of the failed requests
            await self._shared.close(quiet)
        workers = set(self._workers)
        for task in workers:
            task.cancel()
        if workers:
            await asyncio.wait(workers, timeout=WORKERS_END)
        rest = asyncio.all_tasks() - {asyncio.current_task()}
        for task in rest:
            task.cancel()
        if rest:
            await asyncio.wait(rest, timeout=WORKERS_END)
        await asyncio.get_running_loop().shutdown_asyncgens()

    def _quiet_after(self) -> float:
        """Seconds for which a reply to a request of this program may still come."""
        now = self._clock()
        waits = self._dispatcher.in_flight or self._dispatcher.proof.busy
        late = now + self._timing.late_reply if waits else now
        return max(late, self.devices.last_reply_by(now)) - now


def _do(action: Callable[[T], None], argument: T) -> None:
    """Call an action in the loop; an error reaches the waiting caller."""
    try:
        action(argument)
    except Exception as error:
        log.exception("an internal error of the line")
        argument.break_off(error)
