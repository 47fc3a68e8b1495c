"""Work on one drive: one task after another, and a stop that ends them all.

Every task carries the count of stops under which it was typed. Once the count has risen the task
is refused: when it is handed in, when its turn comes, and before each frame that it sends.
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
from tui.bus.errors import LineError, Superseded
from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused

from .arming import Arming, NotArmed
from .clock import REAL_CLOCK, Clock

log = logging.getLogger(__name__)

MOST_WAITING = 4
"""Tasks that may wait behind the one that is being carried out."""
BY_STOP = "ended by a stop"
STOPPED_DISARMS = "Stopped: no longer armed."


class Stopped(OrderRefused):
    """Work that a stop has ended; nothing more of it goes out."""

    def __init__(self, by: str = "") -> None:
        super().__init__(f"Not sent: a stop came after it{f' ({by})' if by else ''}.")


class OutcomeKind(StrEnum):
    """Kind of an outcome."""

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
    """Refusal, and its source."""


@dataclass(frozen=True, slots=True)
class Permit:
    """The right of one task to write to its drive; asked before each frame."""

    queue: WorkQueue
    stamp: int

    def refusal(self) -> str:
        """Why no frame of this task may go out any more; empty where it may."""
        if self.stamp != self.queue.stops:
            return str(Stopped(self.queue.stopped_by))
        return self.queue.arming.refusal()

    def check(self) -> None:
        """Raise Stopped or NotArmed where nothing more may be written; work keeps it armed."""
        if self.stamp != self.queue.stops:
            raise Stopped(self.queue.stopped_by)
        if why := self.queue.arming.refusal():
            raise NotArmed(why)
        self.queue.arming.touch()


@dataclass(frozen=True, slots=True)
class Task:
    """Something to be done to a drive, by whichever screen or command."""

    carry_out: Callable[[Permit], Awaitable[str]]
    """Does it, and returns what was done, for a person."""
    owner: object = None
    """Whose work it is."""
    working: str = ""
    """Text while the work is in progress."""
    given_up: Callable[[], str | None] | None = None
    """Called, in any thread, where it ends without having been done; says what was done of it."""
    armed: bool = True
    """True if the drive must be armed for it."""


class WorkQueue:
    """Takes the work on one drive from any thread; knows its stops and its last outcome."""

    def __init__(
        self, line: ModbusLine, device: int, arming: Arming, clock: Clock = REAL_CLOCK
    ) -> None:
        self.arming = arming
        self.outcome: Outcome | None = None
        """Result of the last work: the one truth about this drive."""
        self.stops = 0
        """Number of stops given to this drive by this program."""
        self.stopped_by = ""
        """Program of the last stop."""
        self.on_tell: Callable[[Outcome], None] = lambda _: None
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
        """Whose turn it is to take tasks: a worker that a stop has ended takes none."""

    # Telling

    def tell(self, kind: OutcomeKind, text: str, error: Exception | None = None) -> None:
        """Report the result of work on the drive."""
        self.outcome = outcome = Outcome(kind, text, self._clock.monotonic(), error)
        self.on_tell(outcome)

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
        """The right to write under a stamp, the present one by default.

        Raises Stopped where a stop came since, NotArmed where the drive is not armed.
        """
        made = Permit(self, self.stops if stamp is None else stamp)
        made.check()
        return made

    def arm(self, stamp: int, seconds: float) -> None:
        """Arm the drive, unless it was given a stop since that count; raises as `Arming.arm`."""
        with self._lock:  # a stop comes before it, or after it and ends it
            if stamp == self.stops:
                self.arming.arm(seconds=seconds)

    def put(self, task: Task, stamp: int | None = None) -> None:
        """Do a task behind those before it; `stamp` is the count of stops when it was typed.

        Raises Stopped, NotArmed, and OrderRefused where the line is lost or too many wait.
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
                self.tell(OutcomeKind.WORKING, task.working)
            self._waiting.append((task, permit))
            if not self.busy:
                self._turn = turn = object()
                self._worker = self._line.spawn(lambda: self._serve(turn), f"work {self._device}")

    def stop(self, by: str = "") -> None:
        """A stop was given: end what is being done, forget what waits, disarm."""
        with self._lock:
            self.stops += 1
            self.stopped_by = by
            worker, self._worker, self._doing = self._worker, None, None
            self._turn = object()
            # one that is told of twice leaves the reason of the first
            reported = self.arming.why_disarmed == STOPPED_DISARMS
            why = STOPPED_DISARMS if self.arming.armed or reported else ""
            self.arming.disarm(why)
        if worker is not None:
            worker.cancel()
        # a worker that had no time to begin would leave them to the next task
        if self.drop(BY_STOP):
            self.tell(OutcomeKind.REFUSED, f"Not done: {BY_STOP}.", Stopped(by))

    def drop(self, why: str) -> bool:
        """Forget the tasks that wait; True if there were any."""
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        for task, _ in waiting:
            _given_up(task)
        if waiting:
            self.tell(OutcomeKind.REFUSED, f"Not done: {why}.")
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
        """One task; where it fails, those behind it are not carried out."""
        try:
            if permit.stamp != self.stops:
                raise Stopped(self.stopped_by)
            if task.armed:
                permit.check()
            if text := await task.carry_out(permit):
                self.tell(OutcomeKind.DONE, text)
        except Superseded:
            return
        except (LineError, DriveError) as error:
            self._fail(task, turn, error, str(error))
        except Exception as error:
            log.exception("work on device %s failed", self._device)
            self._fail(task, turn, error, f"It failed ({type(error).__name__}: {error}).")
        except asyncio.CancelledError:
            text = f"{BY_STOP[0].upper()}{BY_STOP[1:]}.{_given_up(task)}"
            self.tell(OutcomeKind.REFUSED, text, Stopped(self.stopped_by))
            raise
        finally:
            self.on_change()

    def _fail(self, task: Task, turn: object, error: Exception, text: str) -> None:
        # behind a stop wait tasks of another turn
        dropped = turn is self._turn and self.drop("a command before it was refused")
        rest = " The commands behind it were dropped." if dropped else ""
        self.tell(OutcomeKind.REFUSED, f"{text}{rest}{_given_up(task)}", error)


def _given_up(task: Task) -> str:
    """Let a task end undone; what it says of that, with a space before it."""
    message = task.given_up() if task.given_up is not None else None
    return f" {message}" if message else ""
