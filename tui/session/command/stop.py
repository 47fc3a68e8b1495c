"""Stops of motors: from any thread, before everything else on the line, followed to standstill.

The first frame waits for one exchange in progress at most. The result is then read from the drive,
because an acknowledgment does not prove standstill. Several drives are stopped in two waves: first
each is sent the word for its last known state; then the drives are read, and stops are repeated.

After an internal error `LastStop` sends the stop.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Iterable, Mapping
from functools import partial

from tui.bus.api import ModbusLine, Priority
from tui.bus.errors import (
    DeviceException,
    ExchangeError,
    LineClosed,
    LineError,
    LineLost,
    RequestRefused,
    strip_outcome_note,
)
from tui.drive.errors import DriveError
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    choose,
    order_target,
)
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId
from tui.drive.words import registers_of_word
from tui.safety import STOP_TRIES

from ..carry_on import carried_on
from ..connect.limits import limits_of
from ..drive import DriveSession
from ..events import EventLog
from ..journal import Journal
from ..settings.write import Writer
from .last_known import is_likely_to_run
from .last_stop import LastStop, end_work
from .motor_stop import STANDSTILL_POLL_INTERVAL, FirstWave, MotorStop
from .stop_report import (
    NOT_STOPPING,
    Phase,
    StopReport,
    StopSummary,
    message_text,
    not_stopped,
)
from .under_way import UnderWay, watch_first_frames

STOP_WAITS = "The stop waits for the line."

log = logging.getLogger(__name__)

NO_ANSWER_NOW = 2
"""Urgency of a drive that does not answer: after all others."""


def _now(session: DriveSession) -> float:
    """Return the time by the drive's clock; by the system's if that raises an error."""
    try:
        return session.clock.monotonic()
    except Exception:
        return time.monotonic()


def _urgency(session: DriveSession) -> int:
    """Return the place in the order: running or commanded motors first, silent drives last."""
    try:
        if session.line.device_state(session.device).answers is False:
            return NO_ANSWER_NOW
        return 0 if is_likely_to_run(session) else 1
    except Exception:
        log.exception("device %s has no place among the stops", session.device)
        return 1


class Stopper:
    """Stops drives of one line; `stop` may be called from any thread and returns at once."""

    def __init__(self, line: ModbusLine, journal: Journal, events: EventLog | None = None) -> None:
        self._line = line
        self._events = events
        self._journal = journal
        self._reports: dict[int, StopReport] = {}
        self._under_way: dict[int, UnderWay] = {}
        self._last = LastStop(line, journal, self._say)
        self._own: dict[int, tuple[DriveSession, DriveSession]] = {}
        """By device, a session with a contradicted profile, and one of the drive's own family."""
        self._quiet: dict[int, float] = {}
        """By device, the time of a stop that leaves a message only if it fails."""
        self._lock = threading.Lock()

    @property
    def reports(self) -> Mapping[int, StopReport]:
        """Last report of each drive, by device."""
        return dict(self._reports)

    def stop(
        self,
        sessions: Iterable[DriveSession],
        order: OrderId = "stop",
        by: str = "the stop key",
        *,
        given: bool = False,
        quiet: bool = False,
    ) -> None:
        """Stop drives; end their work and their arming. Raises LineClosed.

        `given` is True if all programs on the line already know of the stop. A `quiet` stop leaves
        a message only if it fails. A stop whose word still waits is not restarted; otherwise a key
        that is held down would send none.
        """
        wanted = list(sessions)
        ordered = _now(wanted[0]) if wanted else 0.0
        if quiet:
            self._quiet |= {session.device: ordered for session in wanted}
        # first, because it cancels earlier commands of other programs
        if not given:
            carried_on(lambda: self._line.facts.give_stop([item.device for item in wanted], by))
        for session in wanted:
            carried_on(partial(end_work, session, by))
        wave = None
        if len(wanted) > 1:
            wanted.sort(key=_urgency)
            wave = FirstWave(item.device for item in wanted if _urgency(item) < NO_ANSWER_NOW)
        closed: LineClosed | None = None
        begun: list[UnderWay] = []
        for session in wanted:
            try:
                own = self._by_its_own(session)
                with self._lock:
                    begun += self._begin(own, order, ordered, wave)
            except LineClosed as error:
                closed = error
            except Exception as error:
                self._last.send(session, ordered, error)
        if closed is not None:
            raise closed
        carried_on(partial(watch_first_frames, begun, self._line.timing, self._last.send))
        if wave is not None:
            with_wave = [work.stop.session for work in begun]
            rest = {item.device for item in wanted} - {entry.device for entry in with_wave}
            behind = partial(self._behind_wave, wave, rest, with_wave, order)
            carried_on(lambda: self._line.spawn(behind, "stop all"))

    def send_prepared(self, session: DriveSession, error: Exception) -> None:
        """Stop a drive by its prepared frames, after an internal error on the way to `stop`."""
        try:
            end_work(session, "the stop key")
        except Exception:
            log.exception("the work on device %s", session.device)
            session.work.stops += 1
        self._last.send(session, time.monotonic(), error)

    def _by_its_own(self, session: DriveSession) -> DriveSession:
        """Return a session with the profile of the family that the drive reports.

        A word that stops the family of a wrong profile may start the drive's own.
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

    def _begin(
        self, session: DriveSession, order: OrderId, ordered: float, wave: FirstWave | None
    ) -> list[UnderWay]:
        """Begin a stop of one drive, unless the same one still waits to be sent."""
        device = session.device
        before = self._under_way.get(device)
        if before is not None:
            if before.goes_out(session, order):
                return []
            before.stop.over = True  # this one sends what that one has not
            before.worker.cancel()
        self._say(session, Phase.SENDING, STOP_WAITS, ordered)
        writer = Writer(session, self._journal, None)
        stop = MotorStop(session, writer, order, ordered, self._say, wave=wave)
        worker = self._line.spawn(partial(self._stop, stop), f"stop {device}")
        begun = self._under_way[device] = UnderWay(stop, worker, session.arming.times)
        return [begun]

    def wait(self, sessions: Iterable[DriveSession], seconds: float) -> StopSummary:
        """Wait in another thread until these stops have ended, at most so many seconds."""
        # a thread waits by the real clock, even if the drives have another one
        wanted, end = {session.device for session in sessions}, time.monotonic() + seconds
        while (summary := self._over(wanted)) is None and time.monotonic() < end:
            time.sleep(STANDSTILL_POLL_INTERVAL)
        return summary or self._summary(wanted)

    async def ended(self, sessions: Iterable[DriveSession], seconds: float) -> StopSummary:
        """Wait in any loop until these stops have ended, at most so many seconds."""
        wanted, end = {session.device for session in sessions}, time.monotonic() + seconds
        while True:
            if (summary := self._over(wanted)) is not None or time.monotonic() > end:
                return summary or self._summary(wanted)
            await asyncio.sleep(STANDSTILL_POLL_INTERVAL)

    def _over(self, devices: set[int]) -> StopSummary | None:
        """Return the summary of these drives once all their stops have ended, else None."""
        summary = self._summary(devices)
        return summary if len(summary.reports) == len(devices) and summary.ended else None

    def _summary(self, devices: set[int]) -> StopSummary:
        return StopSummary([report for device, report in self.reports.items() if device in devices])

    def _say(self, session: DriveSession, phase: Phase, text: str, ordered: float) -> None:
        """Report the progress of a stop; an error in the report does not affect the stop."""
        carried_on(lambda: self._report(session, phase, text, ordered))

    def _report(self, session: DriveSession, phase: Phase, text: str, ordered: float) -> None:
        before = self._reports.get(session.device)
        same = before is not None and (before.phase, before.time) == (phase, ordered)
        since = before.since if same and before is not None else _now(session)
        report = StopReport(session.device, phase, text, ordered, since)
        self._reports[session.device] = report  # two threads may report, of two drives
        if not same:
            failed = phase in NOT_STOPPING
            if self._events is not None and (failed or self._quiet.get(session.device) != ordered):
                kind = "failed" if failed else "stop"
                self._events.add(kind, message_text(phase, text), session.device)
            log.info("stop of device %s: %s, %s", session.device, phase, text)

    async def _behind_wave(
        self, wave: FirstWave, rest: set[int], sessions: list[DriveSession], order: OrderId
    ) -> None:
        """Send a broadcast after the first wave; drives of the `rest` are not part of the wave."""
        for device in rest:
            wave.passed(device)
        await wave.over()
        await self._broadcast(sessions, order)

    async def _broadcast(self, sessions: list[DriveSession], order: OrderId) -> None:
        """Broadcast the stop words that cannot start a drive of any family on the line."""
        sent: set[tuple[int, tuple[int, ...]]] = set()
        for session in sessions:
            raws = session.image.trusted
            try:
                chart = chart_in_force(session.profile, raws)
                found = choose(chart, order, raws) if chart else None
            except OrderRefused:
                continue
            if chart is None or found is None or not found.broadcast:
                continue
            target = order_target(session.profile, chart, found)
            for word in found.words:
                place = (target.place, registers_of_word(target, word))
                if place not in sent:
                    sent.add(place)
                    limits = limits_of(session.profile)
                    await self._line.broadcast(*place, limits=limits, priority=Priority.STOP)

    async def _stop(self, stop: MotorStop) -> None:
        try:
            await self._carry_out(stop)
        except Exception as error:
            self._last.send(stop.session, stop.ordered, error, taken=stop.taken)
        finally:
            stop.over = True

    async def _carry_out(self, stop: MotorStop) -> None:
        error = ""
        for _ in range(STOP_TRIES):
            try:
                text = await stop.carry_out()
            except LineLost:
                raise
            except RequestRefused as refused:
                error = str(refused)
                break
            except (OrderRefused, DeviceException) as refused:
                error = str(refused)
            except ExchangeError as failure:
                error = strip_outcome_note(failure)
                carried_on(stop.tell_silent)
                continue
            except (LineError, DriveError) as failure:
                error = str(failure)
                break
            else:
                if text is None:
                    return
                error = text
        self._say(stop.session, Phase.FAILED, not_stopped(error), stop.ordered)
