"""Stopping motors: from any thread, before everything else on the line, seen to its end.

The first frame goes out behind at most the one exchange in flight. What became of it is then
read from the drive: an answer alone stops no motor.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial

from tui.bus.api import LineWorker, ModbusLine, Priority
from tui.bus.errors import DeviceException, ExchangeError, LineError, RequestRefused
from tui.drive.errors import DriveError
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    choose,
    order_target,
)
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId

from ..connect.limits import limits_of
from ..drive import DriveSession
from ..events import EventLog
from ..journal import Journal
from ..settings.write import Writer
from .motor_stop import STANDSTILL_POLL_INTERVAL, MotorStop
from .stop_report import Phase, StopReport, StopSummary

log = logging.getLogger(__name__)

STOP_TRIES = 5


class Stopper:
    """Stops drives of one line; `stop` may be called from any thread and returns at once."""

    def __init__(self, line: ModbusLine, journal: Journal, events: EventLog | None = None) -> None:
        self._line = line
        self._events = events
        self._journal = journal
        self._reports: dict[int, StopReport] = {}
        self._under_way: dict[int, _UnderWay] = {}
        self._own: dict[int, tuple[DriveSession, DriveSession]] = {}
        """By device, a session that its drive contradicts, and one by the drive's own family."""
        self._lock = threading.Lock()

    @property
    def reports(self) -> Mapping[int, StopReport]:
        """The last report of each drive, by device."""
        return self._reports

    def stop(
        self, sessions: Iterable[DriveSession], order: OrderId = "stop", by: str = "the stop key"
    ) -> None:
        """Order drives to stop; ends their work and their arming. Raises LineClosed.

        A stop whose word has not gone out yet is not begun anew: a key that is held down would
        keep every one of them from going out.
        """
        wanted = list(sessions)
        # first: what other programs meant for them before is void from here on
        self._line.facts.give_stop([session.device for session in wanted], by)
        ordered = wanted[0].clock.monotonic() if wanted else 0.0
        for session in wanted:
            session.work.stop(by)
            if session.starts is not None:
                session.starts.withdraw(session)
        wanted = [self._by_its_own(session) for session in wanted]
        if len(wanted) > 1:
            self._line.spawn(lambda: self._broadcast(wanted, order), "stop all")
        with self._lock:
            for session in wanted:
                self._begin(session, order, ordered)

    def _by_its_own(self, session: DriveSession) -> DriveSession:
        """The session by which a drive is stopped: that of the family which it says it is of.

        A word that stops the family it was taken for may start its own.
        """
        own = session.known_identity.profile
        if not session.contradiction or own is None:
            return session
        with self._lock:
            taken, found = self._own.get(session.device, (None, None))
            if taken is not session or found is None:
                profile = library.load(own)
                found = DriveSession(
                    session.line, session.device, profile, session.identity, session.clock
                )
                self._own[session.device] = (session, found)
            return found

    def _begin(self, session: DriveSession, order: OrderId, ordered: float) -> None:
        """Begin a stop of one drive, unless the same one goes out yet."""
        device = session.device
        before = self._under_way.get(device)
        if before is not None:
            if before.goes_out(session, order):
                return
            before.worker.cancel()
        self._say(session, Phase.SENDING, "stop is being sent", ordered)
        writer = Writer(session, self._journal, None)
        one = MotorStop(session, writer, order, ordered, self._say)
        worker = self._line.spawn(partial(self._stop, one), f"stop {device}")
        self._under_way[device] = _UnderWay(one, worker, session.arming.times)

    def wait(self, sessions: Iterable[DriveSession], seconds: float) -> StopSummary:
        """Wait from another thread until these stops have ended, or the time is up."""
        devices = {session.device for session in sessions}
        # the thread that waits does so by the real clock, whichever the drives have
        end = time.monotonic() + seconds
        while True:
            reports = [one for device, one in self._reports.items() if device in devices]
            summary = StopSummary(reports)
            if (len(reports) == len(devices) and summary.ended) or time.monotonic() > end:
                return summary
            time.sleep(STANDSTILL_POLL_INTERVAL)

    def _say(self, session: DriveSession, phase: Phase, text: str, ordered: float) -> None:
        before = self._reports.get(session.device)
        same = before is not None and (before.phase, before.time) == (phase, ordered)
        since = before.since if same and before is not None else session.clock.monotonic()
        report = StopReport(session.device, phase, text, ordered, since)
        self._reports = {**self._reports, session.device: report}
        if not same:
            if self._events is not None:
                kind = "failed" if phase is Phase.FAILED else "stop"
                head = "Stopping: " if phase is Phase.STOPPING else ""
                said = f"{head}{text}" if head else f"{text[:1].upper()}{text[1:]}"
                self._events.add(kind, said, session.device)
            log.info("stop of device %s: %s, %s", session.device, phase, text)

    async def _broadcast(self, sessions: list[DriveSession], order: OrderId) -> None:
        """Reach at once all drives of families whose word can start none that hears it."""
        sent: set[tuple[int, int]] = set()
        for session in sessions:
            raws = session.image.trusted
            try:
                chart = chart_in_force(session.profile, raws)
                found = choose(chart, order, raws) if chart else None
            except OrderRefused:
                continue
            if chart is None or found is None or not found.broadcast:
                continue
            address = order_target(session.profile, chart, found).address
            for word in found.words:
                if (address, word) not in sent:
                    sent.add((address, word))
                    limits = limits_of(session.profile)
                    await self._line.broadcast(
                        address, [word & 0xFFFF], limits=limits, priority=Priority.STOP
                    )

    async def _stop(self, one: MotorStop) -> None:
        error = "it did not answer"
        for _ in range(STOP_TRIES):
            try:
                text = await one.carry_out()
            except RequestRefused as refused:
                error = str(refused)
                break
            except (OrderRefused, DeviceException) as refused:
                error = str(refused)
            except ExchangeError as failure:
                error = str(failure)
                continue
            except (LineError, DriveError) as failure:
                error = str(failure)
                break
            else:
                if text is None:
                    return
                error = text
        told = f"NOT STOPPED: {error} Stop it at the machine."
        self._say(one.session, Phase.FAILED, told, one.ordered)


@dataclass(frozen=True, slots=True)
class _UnderWay:
    """A stop that was begun."""

    stop: MotorStop
    worker: LineWorker
    times: int
    """How often the drive had been armed then."""

    def goes_out(self, session: DriveSession, order: OrderId) -> bool:
        """Whether it does all that another stop of the drive would do now.

        Its words are on their way still, and nothing was written since: that needs arming.
        """
        same = self.stop.session is session and self.stop.wanted == order
        waits = not self.worker.done() and not self.stop.sent
        return same and waits and self.times == session.arming.times
