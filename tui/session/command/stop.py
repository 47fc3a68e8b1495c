"""Stopping motors: from any thread, before everything else on the line, seen to its end.

The first frame goes out behind at most the one exchange in flight. What became of it is then
read from the drive: an answer alone stops no motor.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial

from tui.bus.errors import DeviceException, ExchangeError, LineError, RequestRefused
from tui.bus.line import Line, Priority, Worker
from tui.drive.chart import state_of
from tui.drive.errors import DriveError
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    choose,
    last_word,
    nearest_stop,
    order_target,
    stop_conditions,
    stop_in_any,
    with_options,
)
from tui.drive.profile.schema import Chart, Order, OrderId
from tui.drive.values import from_words

from ..connect.limits import limits_of
from ..drive import DriveSession
from ..drive_state import STATE_FRESH
from ..events import EventLog
from ..image import Raw
from ..journal import Journal
from ..read.reader import Reader
from ..settings.write import Writer

log = logging.getLogger(__name__)

STANDING = frozenset({"starting", "blocked", "ready", "stopped", "stopping", "fault"})
"""Kinds of state in which a motor at 0 Hz is stopped: nothing enables it."""

STOP_TRIES = 5
SEEN_FOR = 60.0
"""Seconds for which a stop is followed; a ramp may take that long."""
STANDSTILL_POLL_INTERVAL = 0.15
TAKES_EFFECT = 1.5
"""Seconds within which a drive must show that it obeys."""


class Phase(StrEnum):
    """How far a stop has come."""

    SENDING = "sending"
    STOPPING = "stopping"
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class StopReport:
    """What became of a stop so far; ordered at `time`, and so since `since` (monotonic)."""

    device: int
    phase: Phase
    text: str
    time: float
    since: float


@dataclass(frozen=True, slots=True)
class StopSummary:
    """One stop of one or more drives, for a person."""

    reports: list[StopReport]

    @property
    def ended(self) -> bool:
        """Whether nothing more is awaited."""
        return all(one.phase in (Phase.STOPPED, Phase.FAILED) for one in self.reports)

    @property
    def failed(self) -> bool:
        """Whether some drive could not be stopped from here."""
        return any(one.phase is Phase.FAILED for one in self.reports)

    @property
    def head(self) -> str:
        """What it has come to."""
        if self.failed:
            which = ", ".join(str(r.device) for r in self.reports if r.phase is Phase.FAILED)
            return f"NOT STOPPED from here: device {which}. Stop it at the machine."
        return "STOPPED by the stop key." if self.ended else "STOP is being carried out."

    @property
    def text(self) -> str:
        """Each drive's part."""
        ordered = sorted(self.reports, key=lambda one: (one.phase is not Phase.FAILED, one.device))
        return " · ".join(f"{one.device}: {one.text}" for one in ordered)


class Stopper:
    """Stops drives of one line; `stop` may be called from any thread and returns at once."""

    def __init__(self, line: Line, journal: Journal, events: EventLog | None = None) -> None:
        self._line = line
        self._events = events
        self._journal = journal
        self._reports: dict[int, StopReport] = {}
        self._under_way: dict[int, _UnderWay] = {}
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
        ordered = time.monotonic()
        wanted = list(sessions)
        for session in wanted:
            session.work.stop(by)
            if session.starts is not None:
                session.starts.withdraw(session)
        if len(wanted) > 1:
            self._line.spawn(lambda: self._broadcast(wanted, order), "stop all")
        with self._lock:
            for session in wanted:
                self._begin(session, order, ordered)

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
        one = _Stop(session, writer, order, ordered, self._say)
        worker = self._line.spawn(partial(self._stop, one), f"stop {device}")
        self._under_way[device] = _UnderWay(one, worker, session.arming.times)

    def wait(self, sessions: Iterable[DriveSession], seconds: float) -> StopSummary:
        """Wait from another thread until these stops have ended, or the time is up."""
        devices = {session.device for session in sessions}
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
        since = before.since if same and before is not None else time.monotonic()
        report = StopReport(session.device, phase, text, ordered, since)
        self._reports = {**self._reports, session.device: report}
        if not same:
            if self._events is not None:
                kind = "failed" if phase is Phase.FAILED else "stop"
                self._events.add(kind, f"{phase.capitalize()}: {text}", session.device)
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

    async def _stop(self, one: _Stop) -> None:
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


Say = Callable[[DriveSession, Phase, str, float], None]


@dataclass(slots=True)
class _Stop:
    """One stop of one drive: its word chosen by what the drive tells now, sent, followed."""

    session: DriveSession
    writer: Writer
    order: OrderId
    ordered: float
    say: Say
    wanted: OrderId = field(init=False)
    """The way to stop that was asked for."""
    sent: bool = False
    """Whether its words have gone out."""
    reader: Reader = field(init=False)
    held: dict[str, Raw] = field(default_factory=dict)
    """What command words held before they were written here: option bits are kept from it."""

    def __post_init__(self) -> None:
        self.reader = Reader(self.session)
        self.wanted = self.order

    async def carry_out(self) -> str | None:
        """Choose, send and follow; returns why the motor does not stop, or nothing."""
        chart, chosen = await self._chosen()
        await self._send(chart, chosen)
        return await self._follow(chart, chosen)

    async def _chosen(self) -> tuple[Chart, Order]:
        """The words that stop this drive now; what decides is read anew where it may differ."""
        profile = self.session.profile
        deciding = [chart.when.parameter for chart in profile.data.charts if chart.when]
        try:
            await self._read_anew(deciding)
            chart = chart_in_force(profile, self._sure(deciding))
            if chart is not None:
                self.order = nearest_stop(chart, self.order)
                await self._read_anew(stop_conditions(chart, self.order))
        except ExchangeError as failure:
            # blind: by the word that stops whatever the drive is in
            log.warning("stop of device %s without a look: %s", self.session.device, failure)
            known = self._sure(deciding)
            chart = chart_in_force(profile, known)
            if chart is None:
                return stop_in_any(profile, known)
        if chart is None:
            return stop_in_any(profile, {})
        return chart, choose(chart, self.order, self._sure(stop_conditions(chart, self.order)))

    async def _read_anew(self, codes: Iterable[str]) -> None:
        wanted = list(dict.fromkeys(codes))
        unsure = [code for code in wanted if code not in self._sure(wanted)]
        if unsure:
            await self.reader.read(unsure, priority=Priority.STOP)

    def _sure(self, codes: Iterable[str]) -> dict[str, int]:
        """What is surely held now: just read, or not to be changed since the motor has run."""
        session, image = self.session, self.session.image
        fresh, trusted = image.fresh(STATE_FRESH), image.trusted
        turns = session.state(STATE_FRESH).kind in ("running", "stopping")
        found = {}
        for code in codes:
            held = image.get(code)
            if code not in trusted or held is None:
                continue
            since = session.profile[code].access == "rw-stopped" and held.time > session.rest_seen
            if code in fresh or (turns and since):
                found[code] = trusted[code]
        return found

    async def _send(self, chart: Chart, order: Order) -> None:
        session = self.session
        parameter = order_target(session.profile, chart, order)
        if (held := session.image.get(parameter.code)) is not None:
            self.held[parameter.code] = held
        kept = {code: one.raw for code, one in self.held.items() if one.raw is not None}
        for word in with_options(chart, order, kept):
            raw = from_words(parameter, [word])
            why = f"stopped: {order.name}"
            await self.writer.write(
                parameter, raw, why=why, priority=Priority.STOP, read_back=False
            )
        self.sent = True

    async def _follow(self, chart: Chart, order: Order) -> str | None:
        """See the motor stop; returns why it does not, or nothing."""
        progress, before = time.monotonic(), None
        ending = last_word(chart, order)
        while (now := time.monotonic()) - self.ordered < SEEN_FOR:
            kind, hertz = await self._motion(chart)
            if not hertz and kind in STANDING:
                self.say(self.session, Phase.STOPPED, f"stopped{self._instead()}", self.ordered)
                self.session.stir()
                return None
            if hertz == 0 and kind == "running" and ending is not None:
                # at 0 Hz and enabled by the very word that has stopped it
                await self._send(chart, ending)
                progress, ending = time.monotonic(), None
                continue
            if kind != "running" or (None not in (hertz, before) and (hertz or 0) < (before or 0)):
                progress = now
            if now - progress > TAKES_EFFECT:
                return self._why_not(hertz)
            before = hertz
            speed = f", {hertz:g} Hz" if hertz else ""
            text = f"{order.name}{speed}{self._instead()}"
            self.say(self.session, Phase.STOPPING, text, self.ordered)
            await asyncio.sleep(STANDSTILL_POLL_INTERVAL)
        return "it still turns after a minute."

    def _instead(self) -> str:
        """Which way to stop the drive lacks, where another took its place."""
        if self.order == self.wanted:
            return ""
        wanted, way = self.wanted.replace("-", " "), self.order.replace("-", " ")
        return f" (it has no {wanted}: {'ramp stop' if way == 'stop' else way})"

    def _why_not(self, hertz: float | None) -> str:
        """What still enables a drive that does not obey."""
        state = self.session.state(STATE_FRESH)
        who = "from its terminals or keypad" if state.local else state.channel
        if hertz == 0:
            by = who or "from elsewhere"
            return f"it stands at 0 Hz and is still enabled {by}: a reference turns it at once."
        return f"it answers and runs on; it is commanded {who or 'from elsewhere'}."

    async def _motion(self, chart: Chart) -> tuple[str, float | None]:
        """The kind of state and the output frequency in Hz, read now."""
        session = self.session
        frequency = session.profile.quantity("output_frequency")
        # the word that was sent, too: the next one keeps its option bits
        codes = [
            chart.status,
            *(code for code in self.held if self.session.image.get(code) is None),
        ]
        if frequency is not None:
            codes.append(frequency.code)
        readings = await self.reader.read(codes, priority=Priority.OPERATOR_READ)
        number = readings[frequency.code].number if frequency else None
        word = readings[chart.status].raw
        kind = state_of(chart, word).kind if word is not None else "unknown"
        return kind, abs(number) if number is not None else None


@dataclass(frozen=True, slots=True)
class _UnderWay:
    """A stop that was begun."""

    stop: _Stop
    worker: Worker
    times: int
    """How often the drive had been armed then."""

    def goes_out(self, session: DriveSession, order: OrderId) -> bool:
        """Whether it does all that another stop of the drive would do now.

        Its words are on their way still, and nothing was written since: that needs arming.
        """
        same = self.stop.session is session and self.stop.wanted == order
        waits = not self.worker.done() and not self.stop.sent
        return same and waits and self.times == session.arming.times
