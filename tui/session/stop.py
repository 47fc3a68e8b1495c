"""Stopping motors: from any thread, before everything else on the line, seen to its end.

The first frame goes out behind at most the one exchange in flight. What became of it is then
read from the drive: an answer alone stops no motor.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

from tui.bus.errors import DeviceException, ExchangeError, LineError, RequestRefused
from tui.bus.line import Line, Priority, Worker
from tui.drive.chart import read_chart
from tui.drive.errors import DriveError
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    choose,
    deciding_codes,
    target,
    with_options,
)
from tui.drive.schema import Chart, Order, OrderId
from tui.drive.values import from_words

from .drive_session import DriveSession
from .journal import Journal
from .limits import limits_of
from .writing import Writer

log = logging.getLogger(__name__)

FRESH = 1.0
"""Seconds for which a state counts as that of now."""
TRIES = 5
SEEN_FOR = 60.0
"""Seconds for which a stop is followed; a ramp may take that long."""
LOOK = 0.15
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

    def __init__(self, line: Line, journal: Journal) -> None:
        self._line = line
        self._journal = journal
        self._reports: dict[int, StopReport] = {}
        self._workers: dict[int, Worker] = {}

    @property
    def reports(self) -> Mapping[int, StopReport]:
        """The last report of each drive, by device."""
        return self._reports

    def stop(self, sessions: Iterable[DriveSession], order: OrderId = "stop") -> None:
        """Order drives to stop. Raises LineClosed."""
        ordered = time.monotonic()
        wanted = list(sessions)
        if len(wanted) > 1:
            self._line.spawn(lambda: self._broadcast(wanted, order), "stop all")
        for session in wanted:
            if (before := self._workers.get(session.device)) is not None:
                before.cancel()
            session.orders.cancel()
            self._say(session, Phase.SENDING, "stop is being sent", ordered)
            work = partial(self._stop, session, order, ordered)
            self._workers[session.device] = self._line.spawn(work, f"stop {session.device}")

    def wait(self, sessions: Iterable[DriveSession], seconds: float) -> StopSummary:
        """Wait from another thread until these stops have ended, or the time is up."""
        devices = {session.device for session in sessions}
        end = time.monotonic() + seconds
        while True:
            reports = [one for device, one in self._reports.items() if device in devices]
            summary = StopSummary(reports)
            if (len(reports) == len(devices) and summary.ended) or time.monotonic() > end:
                return summary
            time.sleep(LOOK)

    def _say(self, session: DriveSession, phase: Phase, text: str, ordered: float) -> None:
        before = self._reports.get(session.device)
        same = before is not None and (before.phase, before.time) == (phase, ordered)
        since = before.since if same and before is not None else time.monotonic()
        report = StopReport(session.device, phase, text, ordered, since)
        self._reports = {**self._reports, session.device: report}
        if not same:
            log.info("stop of device %s: %s, %s", session.device, phase, text)

    async def _broadcast(self, sessions: list[DriveSession], order: OrderId) -> None:
        """Reach at once all drives of families whose word can start none that hears it."""
        sent: set[tuple[int, int]] = set()
        for session in sessions:
            try:
                chart = chart_in_force(session.profile, session.monitor.known.raws())
                found = choose(chart, order, session.monitor.known.raws()) if chart else None
            except OrderRefused:
                continue
            if chart is None or found is None or not found.broadcast:
                continue
            address = target(session.profile, chart, found).address
            for word in found.words:
                if (address, word) not in sent:
                    sent.add((address, word))
                    limits = limits_of(session.profile)
                    await self._line.broadcast(
                        address, [word & 0xFFFF], limits=limits, priority=Priority.STOP
                    )

    async def _stop(self, session: DriveSession, order: OrderId, ordered: float) -> None:
        error = "it did not answer"
        for _ in range(TRIES):
            try:
                chart, chosen = await self._order(session, order)
                await self._send(session, chart, chosen)
                text = await self._follow(session, chosen, ordered)
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
        self._say(
            session,
            Phase.FAILED,
            f"NOT STOPPED: {error} Stop it at the machine.",
            ordered,
        )

    async def _order(self, session: DriveSession, order: OrderId) -> tuple[Chart, Order]:
        """The words that stop this drive now; reads what it depends on where that is not known."""
        known, profile = session.monitor.known, session.profile
        chart = chart_in_force(profile, known.raws())
        if chart is None:
            for code in deciding_codes(profile):
                await self._read(session, code)
            chart = chart_in_force(profile, known.raws())
        if chart is None:
            raise OrderRefused("How this drive is commanded is not known.")
        by_state = any(one.states for one in chart.orders if one.id == order)
        if by_state and chart.status not in known.raws(FRESH):
            # what stops a motor in one state may do something else in another
            await self._read(session, chart.status)
        return chart, choose(chart, order, known.raws())

    async def _read(self, session: DriveSession, code: str) -> None:
        try:
            reply = await self._line.read(
                session.device, session.profile[code].address, 1, priority=Priority.STOP
            )
        except DeviceException:
            return
        session.monitor.known.put(code, reply.words[0])

    async def _send(self, session: DriveSession, chart: Chart, order: Order) -> None:
        parameter = target(session.profile, chart, order)
        writer = Writer(session, self._journal)
        for word in with_options(chart, order, session.monitor.known.raws()):
            raw = from_words(parameter, [word])
            why = f"stopped: {order.name}"
            await writer.write(parameter, raw, why=why, priority=Priority.STOP, read_back=False)

    async def _follow(self, session: DriveSession, order: Order, ordered: float) -> str | None:
        """See the motor stop; returns why it does not, or nothing."""
        sent = time.monotonic()
        fastest = None
        while (now := time.monotonic()) - ordered < SEEN_FOR:
            kind, hertz = await self._motion(session)
            if not hertz and (hertz is not None or kind not in ("running", "stopping")):
                self._say(session, Phase.STOPPED, "stopped", ordered)
                session.monitor.refresh()
                return None
            slower = hertz is not None and fastest is not None and hertz < fastest
            if kind == "running" and not slower and now - sent > TAKES_EFFECT:
                return "it answers and runs on; it is commanded from elsewhere."
            if hertz is not None:
                fastest = max(hertz, fastest or 0.0)
            speed = f", {hertz:g} Hz" if hertz else ""
            self._say(session, Phase.STOPPING, f"{order.name}{speed}", ordered)
            await asyncio.sleep(LOOK)
        return "it still turns after a minute."

    async def _motion(self, session: DriveSession) -> tuple[str, float | None]:
        """The kind of state and the output frequency in Hz, read now."""
        profile, known = session.profile, session.monitor.known
        chart = chart_in_force(profile, known.raws())
        frequency = profile.quantity("output_frequency")
        codes = [chart.status] if chart else []
        if frequency is not None:
            codes.append(frequency.code)
        readings = await session.monitor.reader.read(codes, priority=Priority.OPERATOR_READ)
        known.note(readings)
        number = readings[frequency.code].number if frequency else None
        kind = read_chart(profile, known.raws()).kind
        return kind, abs(number) if number is not None else None
