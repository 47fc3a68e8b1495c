"""Work on one drive: one task after another, and a stop that ends them all.

Every task carries the stop count of the moment when it was typed. Once the count has risen, the
task is refused: when it is queued, when its turn comes, and before each frame that it sends.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import StrEnum

from tui.bus.api import LineStatus, LineWorker, ModbusLine
from tui.bus.errors import LineError, Superseded, stopped_first_text
from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused

from .arming import Arming, NotArmed
from .clock import REAL_CLOCK, Clock

log = logging.getLogger(__name__)

MOST_WAITING = 4
"""Tasks that may wait while another one is in progress."""
BY_STOP = "Ended by a stop."
DROPPED_BY_STOP = "Not done: ended by a stop."
STOPPED_DISARMS = "Stopped: no longer armed."


class Stopped(OrderRefused):
    """A stop has ended this work; no more of its frames are sent."""

    def __init__(self, by: str = "") -> None:
        super().__init__(stopped_first_text(by))


class OutcomeKind(StrEnum):
    """Progress or result of work."""

    WORKING = "working"
    DONE = "done"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of the last work on a drive; `time` is monotonic."""

    kind: OutcomeKind
    text: str
    time: float
    error: Exception | None = None
    """The error of a refusal."""


@dataclass(frozen=True, slots=True)
class Permit:
    """Permission of one task to write to its drive; checked before each frame."""

    queue: WorkQueue
    stamp: int

    def refusal(self) -> str:
        """Return why no further frame of this task may be sent; empty if it may. Any thread."""
        if self.stamp != self.queue.stops:
            return str(Stopped(self.queue.stopped_by))
        return self.queue.arming.refusal()

    def check(self) -> None:
        """Raise Stopped or NotArmed if nothing may be written; else restart the arming time."""
        if self.stamp != self.queue.stops:
            raise Stopped(self.queue.stopped_by)
        if why := self.queue.arming.refusal():
            raise NotArmed(why)
        self.queue.arming.touch()


@dataclass(frozen=True, slots=True)
class Task:
    """Work on a drive, for a screen or a command."""

    carry_out: Callable[[Permit], Awaitable[str]]
    """Does the work; returns its result as shown to a person."""
    owner: object = None
    """The object that queued it; see `WorkQueue.busy_for`."""
    working: str = ""
    """Text while the work is in progress."""
    given_up: Callable[[], str | None] | None = None
    """Called in any thread if it ends undone; may return a text about the part that was done."""
    armed: bool = True
    """True if the drive must be armed for it."""


class WorkQueue:
    """Queue of the work on one drive, with its stop count and last outcome; for any thread."""

    def __init__(
        self, line: ModbusLine, device: int, arming: Arming, clock: Clock = REAL_CLOCK
    ) -> None:
        self.arming = arming
        self.outcome: Outcome | None = None
        """Result of the last work, by whichever screen or command; None before the first."""
        self.stops = 0
        """Number of stops of this drive, by this program or another one."""
        self.stopped_by = ""
        """Source of the last stop, for a person."""
        self.on_report: Callable[[Outcome], None] = lambda _: None
        """Called, in any thread, with each outcome that is reported."""
        self.on_change: Callable[[], None] = lambda: None
        """Called in the line's thread when a task has ended: the drive may hold other values."""
        self._line = line
        self._device = device
        self._clock = clock
        self._lock = threading.RLock()
        self._waiting: deque[tuple[Task, Permit]] = deque()
        self._doing: Task | None = None
        self._worker: LineWorker | None = None
        self._turn = object()
        """Identity of the current worker: one that a stop has ended must take no task."""

    # Results

    def report(self, kind: OutcomeKind, text: str, error: Exception | None = None) -> None:
        """Report the result of work on the drive."""
        self.outcome = outcome = Outcome(kind, text, self._clock.monotonic(), error)
        try:
            self.on_report(outcome)
        except Exception:
            # it must not turn the result of work into a failure, or keep a stop from its report
            log.exception("a result of work on device %s was not passed on", self._device)

    # Work

    @property
    def busy(self) -> bool:
        """True if a task is being carried out."""
        return self._worker is not None and not self._worker.done()

    def busy_for(self, owner: object) -> bool:
        """Return True if a task of an owner waits or is being carried out."""
        doing = self._doing if self.busy else None
        tasks = [doing, *(task for task, _ in tuple(self._waiting))]
        return any(task is not None and task.owner is owner for task in tasks)

    def permit(self, stamp: int | None = None) -> Permit:
        """Return a permit for a stop count (default: the current one).

        Raises Stopped if there was a stop since, NotArmed if the drive is not armed.
        """
        made = Permit(self, self.stops if stamp is None else stamp)
        made.check()
        return made

    def arm(self, stamp: int, seconds: float) -> None:
        """Arm the drive, unless it was stopped since that count; raises as `Arming.arm`."""
        with self._lock:  # a stop is either before it and counted, or after it and disarms
            if stamp == self.stops:
                self.arming.arm(seconds=seconds)

    def put(self, task: Task, stamp: int | None = None) -> None:
        """Queue a task; `stamp` is the stop count when it was typed (default: the current one).

        Raises Stopped, NotArmed, and OrderRefused if the line is lost or too many tasks wait.
        """
        with self._lock:
            permit = Permit(self, self.stops if stamp is None else stamp)
            if permit.stamp != self.stops:
                raise Stopped(self.stopped_by)
            if task.armed:
                permit.check()
            if self._line.state.status is not LineStatus.CONNECTED:
                raise OrderRefused("The line is lost; nothing is written.")
            if len(self._waiting) >= MOST_WAITING:
                raise OrderRefused("Earlier commands are still being carried out.")
            if task.working:
                self.report(OutcomeKind.WORKING, task.working)
            self._waiting.append((task, permit))
            if not self.busy:
                self._turn = turn = object()
                self._worker = self._line.spawn(lambda: self._serve(turn), f"work {self._device}")

    def stop(self, by: str = "") -> None:
        """Raise the stop count, end the work in progress, drop what waits, and disarm."""
        with self._lock:
            self.stops += 1
            self.stopped_by = by
            worker, self._worker, self._doing = self._worker, None, None
            self._turn = object()
            # the second report of one stop must not erase the reason that the first has left
            reported = self.arming.why_disarmed == STOPPED_DISARMS
            why = STOPPED_DISARMS if self.arming.armed or reported else ""
            self.arming.disarm(why)
        if worker is not None:
            worker.cancel()
        # a worker that has not begun yet drops nothing
        if self.drop("ended by a stop"):
            self.report(OutcomeKind.REFUSED, DROPPED_BY_STOP, Stopped(by))

    def drop(self, why: str) -> bool:
        """Drop the tasks that wait; return True if there were any."""
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        for task, _ in waiting:
            _given_up(task)
        if waiting:
            self.report(OutcomeKind.REFUSED, f"Not done: {why}.")
        return bool(waiting)

    async def _serve(self, turn: object) -> None:
        while (found := self._next(turn)) is not None:
            await self._one(*found, turn)

    def _next(self, turn: object) -> tuple[Task, Permit] | None:
        with self._lock:
            if turn is not self._turn:
                return None
            if self._waiting:
                task, permit = self._waiting.popleft()
                self._doing = task
                return task, permit
            self._worker, self._doing = None, None
            return None

    async def _one(self, task: Task, permit: Permit, turn: object) -> None:
        """Carry out one task; if it fails, drop those that wait."""
        try:
            if permit.stamp != self.stops:
                raise Stopped(self.stopped_by)
            if task.armed:
                permit.check()
            if text := await task.carry_out(permit):
                self.report(OutcomeKind.DONE, text)
        except Superseded:
            return
        except (LineError, DriveError) as error:
            self._fail(task, turn, error, str(error))
        except Exception as error:
            log.exception("work on device %s failed", self._device)
            self._fail(task, turn, error, f"It failed ({type(error).__name__}: {error}).")
        except asyncio.CancelledError:
            text = " ".join([BY_STOP, *_given_up(task)])
            self.report(OutcomeKind.REFUSED, text, Stopped(self.stopped_by))
            raise
        finally:
            self.on_change()

    def _fail(self, task: Task, turn: object, error: Exception, text: str) -> None:
        # tasks that wait after a stop belong to another worker
        dropped = turn is self._turn and self.drop("a command before it was refused")
        rest = ["The commands after it were canceled."] if dropped else []
        self.report(OutcomeKind.REFUSED, " ".join([text, *rest, *_given_up(task)]), error)


def _given_up(task: Task) -> list[str]:
    """End a task undone; return its sentences about that."""
    message = task.given_up() if task.given_up is not None else None
    return [message] if message else []
