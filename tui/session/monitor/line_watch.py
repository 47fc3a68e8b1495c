"""Keep-alive reads and state checks for every drive found on a line, monitored or not.

Some drives trip if communication stops (communication timeout). While this program is attached,
the keeper reads them at least three times in each timeout, before polls and an operator's requests.
Further reads show the state of the drives in a list, and the load of each motor.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

from tui.bus.api import Contact, LineWorker, ModbusLine, Priority, contact_of
from tui.bus.errors import LineError, LineLost
from tui.drive.channel import channel_codes
from tui.drive.chart import ENABLED_KINDS, watched_codes
from tui.drive.orders import deciding_codes
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.drive.shown import number_of
from tui.safety import READS_PER_TIMEOUT, WARNED_AT_SHARE

from ..connect.identify import DriveIdentity
from ..drive import DriveSession
from ..drive_state import DriveState, drive_state
from ..read.order_check import check_byte_order
from ..read.presence import UNKNOWN_TIMEOUT, alive_read
from ..read.reader import Reader
from ..reading import reading_of
from ..shown import Shown
from ..timeout_report import TimeoutWatch
from .alarms import FaultOnsets
from .identity_watch import IdentityWatch
from .look import Look, last_that_brought
from .monitor import Monitor
from .timeout import TimeoutWarning, has_begun, read_timeout
from .trend import readout_parameter


def _limit(profile: Profile) -> str:
    """Return the upper limit of the current: a number, or the code of its parameter."""
    current = profile.quantity("motor_current")
    values = profile.data.monitoring.values
    return next((v.high for v in values if current and v.parameter == current.code), "")


def unread_limit(session: DriveSession) -> list[str]:
    """Return the code of the rated current if it was neither read nor refused yet."""
    code, image = _limit(session.profile), session.image
    if session.profile.get(code) is None or code in image.raws or code in image.refused:
        return []
    return [code]


def share_of_limit(session: DriveSession, current: Shown | None) -> float | None:
    """Return the motor current divided by its limit; None if one of them is not known."""
    limit = _limit_number(session)
    if current is None or not limit:
        return None
    number = reading_of(current).number
    return None if number is None else number / limit


def _limit_number(session: DriveSession) -> float | None:
    profile, raws = session.profile, session.image.raws
    limit = _limit(profile)
    parameter = profile.get(limit)
    if parameter is None:
        try:
            return float(limit)
        except ValueError:
            return None
    raw = raws.get(parameter.code)
    if raw is None:
        return None
    number = number_of(profile, parameter, raw, raws)
    return None if number is None else float(number)


log = logging.getLogger(__name__)

GLANCE_QUANTITIES: tuple[Quantity, ...] = (
    "output_frequency",
    "frequency_reference",
    "motor_current",
)
MAY_TURN = frozenset({"running", "unknown"})
"""Kinds of state in which a motor that this program commanded may turn."""
GLANCE = 3.0
"""Seconds between two checks of a drive without a running monitor."""
GLANCE_EACH = 0.15
"""Least seconds for each drive of the line, if there are many."""
LEARN_AGAIN = 20.0
"""Seconds after which a drive's timeout and reaction are read again: someone may change them."""
SHORTEST = 0.02
OLDEST = 12.0
"""Age of a value in seconds, above which it shows no state; only a replay has such values."""
EARLY = 0.25
"""Seconds after which a check follows a request to read the whole drive, at most."""


@dataclass(slots=True)
class _Kept:
    session: DriveSession
    monitor: Monitor
    reader: Reader
    since: float
    watch: TimeoutWatch | None = None
    learned: float | None = None
    workers: tuple[LineWorker, ...] = ()


class RecordedChecks(Protocol):
    """Checks of a drive in a record; times are those of the record."""

    def checks(self, until: float) -> Iterable[Look]:
        """Return those that follow the last point of the drive's curve, up to a time."""

    def rest(self, now: float, period: float) -> float:
        """Return the seconds to the check about a period later; the period without one."""


class LineWatch:
    """Keeps drives alive and checks their states, in workers of the line's loop."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._kept: dict[int, _Kept] = {}
        self._changing = threading.RLock()
        """Held while a drive is added or removed, and while its keep-alive read changes."""
        self._looks: dict[int, Look] = {}
        self.onsets = FaultOnsets()
        self.least_period = GLANCE
        """Least seconds between two checks of a drive without a running monitor."""
        self.on_identified: Callable[[DriveSession, DriveIdentity], None] = lambda *_: None
        self.recorded: dict[int, RecordedChecks] = {}
        """By device, in a replay: its curves have these instead of its own checks."""

    @property
    def looks(self) -> Mapping[int, Look]:
        """The last check of each drive, by device."""
        return dict(self._looks)

    def watch(self, device: int) -> TimeoutWatch | None:
        """Return a drive's communication timeout; None if it is unknown or off."""
        kept = self._kept.get(device)
        return self._watch(kept) if kept else None

    def _watch(self, kept: _Kept) -> TimeoutWatch | None:
        if (watch := kept.watch) is None:
            return None
        begun = has_begun(kept.session) or self._runs_by_the_line(kept)
        return replace(watch, active=watch.acts and begun)

    def _runs_by_the_line(self, kept: _Kept) -> bool:
        """Return True if the motor runs by a command over the line, from any master."""
        state, _ = self._last_seen(kept)
        return state is not None and state.motion == "running" and not state.local

    def pending_timeouts(self) -> dict[int, TimeoutWatch]:
        """Return the drives that react when polling stops, by device; a trip counts at rest too."""
        found = {device: self.watch(device) for device in self._kept}
        return {
            device: watch
            for device, watch in found.items()
            if watch is not None and watch.active and (watch.trips or self.runs(device))
        }

    def unread(self) -> list[DriveSession]:
        """Return the drives whose timeout was not read yet."""
        return [
            kept.session
            for kept in self._kept.values()
            if kept.learned is None and kept.session.profile.data.communication_fault is not None
        ]

    def under_command(self) -> list[DriveSession]:
        """Return the drives that this program commanded and whose motors may still turn."""
        return [
            kept.session
            for kept in self._kept.values()
            if kept.session.commanded and self._may_turn(kept)
        ]

    def runs(self, device: int) -> bool:
        """Return True if a motor ran in its last known state."""
        state, _ = self._last_seen(self._kept[device])
        return state is not None and state.motion == "running"

    def turns(self, device: int) -> bool | None:
        """Return True if a drive may turn its motor, by its newest state; None if not known."""
        kept = self._kept.get(device)
        state = self._last_seen(kept)[0] if kept is not None else None
        kind = state.motion if state is not None else "unknown"
        return None if kind == "unknown" else kind in ENABLED_KINDS

    def _may_turn(self, kept: _Kept) -> bool:
        """Return True if a motor runs, or its state is unknown or older than the last command."""
        state, seen = self._last_seen(kept)
        ordered = kept.session.commanded_at
        if state is None or (ordered is not None and seen <= ordered):
            return True
        return state.motion in MAY_TURN

    def _last_seen(self, kept: _Kept) -> tuple[DriveState | None, float]:
        """Return a drive's latest state, from its monitor or a check, and its time (monotonic)."""
        look, latest = self._looks.get(kept.session.device), kept.monitor.latest
        state, seen = (look.state, look.time) if look else (None, 0.0)
        if latest is not None and latest.time > seen and not latest.error:
            return latest.state, latest.time
        return state, seen

    @property
    def states(self) -> dict[int, DriveState]:
        """The latest known state of each drive, by device."""
        seen = {device: self._last_seen(kept)[0] for device, kept in self._kept.items()}
        for device, look in self._looks.items():
            if seen.get(device) is None and look.before is not None:
                # a drive that is lost for a moment still has its fault
                seen[device] = look.before.state
        return {device: state for device, state in seen.items() if state is not None}

    def warnings(self) -> list[TimeoutWarning]:
        """Return the drives whose silence is near or beyond their communication timeout."""
        found = []
        for device, kept in self._kept.items():
            watch = self._watch(kept)
            if watch is None or not watch.active or device in self._line.facts.paused:
                continue  # a pause on purpose is reported by the program that tests the timeout
            silent = kept.session.clock.monotonic() - self._heard(kept)
            if silent > WARNED_AT_SHARE * watch.timeout:
                found.append(TimeoutWarning(device, kept.session.profile, silent, watch))
        return found

    def _heard(self, kept: _Kept) -> float:
        heard = self._line.device_state(kept.session.device).heard
        return kept.session.clock.line_time(heard) if heard else kept.since

    def keep(self, session: DriveSession, monitor: Monitor) -> None:
        """Keep a drive alive, and check its state whenever its monitor is not running."""
        device = session.device
        kept = _Kept(session, monitor, Reader(session), session.clock.monotonic())
        with self._changing:
            if (before := self._kept.get(device)) is not None:
                self._let_go(before)
                if before.session is session:
                    kept.watch, kept.learned = before.watch, before.learned
            self._kept = {**self._kept, device: kept}
            # before the timeout is known, too: reads of missing words may take seconds
            self._keep_alive(kept, UNKNOWN_TIMEOUT)
        again, identity = partial(self._again, kept), IdentityWatch(session, self.on_identified)
        kept.workers = (
            self._line.spawn(partial(again, self._learn), f"learner {device}"),
            self._line.spawn(partial(again, self._glance, early=True), f"line_watch {device}"),
            self._line.spawn(partial(again, identity.step), f"identity {device}"),
        )

    def recall(self, device: int, look: Look) -> None:
        """Take a check of a record, as the last one of a drive."""
        if look.state is not None:
            self.onsets.recall(device, look.state, look.time)
        self._looks = {**self._looks, device: look}

    def stop(self) -> None:
        """Stop all checks and keep-alive reads."""
        with self._changing:
            for kept in self._kept.values():
                self._let_go(kept)
            self._kept = {}
        self._looks = {}

    def _let_go(self, kept: _Kept) -> None:
        for worker in kept.workers:
            worker.cancel()
        self._line.facts.keep_alives.let_go(kept.session.device)

    def _keep_alive(self, kept: _Kept, timeout: float | None) -> None:
        """Set the keep-alive read for a timeout in seconds; None removes it."""
        read = alive_read(kept.session, timeout) if timeout is not None else None
        if read is None:
            self._line.facts.keep_alives.let_go(kept.session.device)
        else:
            self._line.facts.keep_alives.keep(read)

    async def _again(
        self, kept: _Kept, step: Callable[[_Kept], Awaitable[float]], *, early: bool = False
    ) -> None:
        """Repeat a step forever; it returns the seconds until the next call.

        With `early` the next call comes soon after a full read of the drive is requested, for
        example at the end of a stop.
        """
        while True:
            try:
                rest = await step(kept)
            except LineError as error:
                if isinstance(error, LineLost):
                    kept.session.byte_order.forget()
                rest = self._after_failure(kept)
            except Exception:
                # an error with one drive must not end the checks of the others
                log.exception("looking after device %s failed", kept.session.device)
                rest = GLANCE
            rest = max(SHORTEST, rest)
            requested = kept.session.full_reads_requested
            while rest > 0 and not (early and kept.session.full_reads_requested != requested):
                part = min(rest, EARLY) if early and self.least_period == GLANCE else rest
                await kept.session.clock.sleep(part)
                rest -= part

    @staticmethod
    def _after_failure(kept: _Kept) -> float:
        timeout = kept.watch.timeout if kept.watch else 4 * READS_PER_TIMEOUT
        return min(1.0, timeout / READS_PER_TIMEOUT / 2)

    async def _glance(self, kept: _Kept) -> float:
        """Read a drive's state, unless its monitor is running; return seconds to the next call."""
        if kept.monitor.running:
            self._take_monitored(kept)
            return GLANCE / 10
        profile, device = kept.session.profile, kept.session.device
        state, error, readings = None, "", {}
        contact: Contact = "answers"
        try:
            codes = [*_state_codes(profile), *_glance_codes(profile), *unread_limit(kept.session)]
            reported = channel_codes(profile)
            codes += [code for code in reported if profile[code].access == "r"]
            readings = await kept.reader.read(codes, priority=Priority.POLL)
            # settings are read with the timeout only: they change at standstill only
            settings = {
                c: reading for c in reported if (reading := kept.session.image.get(c)) is not None
            }
            now = kept.session.clock.monotonic()
            readings = {code: item.aged(now, OLDEST) for code, item in readings.items()}
            state = drive_state(profile, settings | readings)
            self.onsets.note(device, state, kept.session.clock.wall())
        except LineError as fault:
            error, contact = str(fault), contact_of(fault)
        timeout = watch.timeout if (watch := self._watch(kept)) and watch.active else None
        if self._kept.get(device) is kept:
            before = last_that_brought(self._looks.get(device)) if error else None
            look = Look(
                state, error, kept.session.clock.monotonic(), timeout, readings, before, contact
            )
            self._looks = {**self._looks, device: look}
            recorded = self.recorded.get(device)
            for check in (look,) if recorded is None else recorded.checks(look.time):
                kept.monitor.add_to_trend(check)
            if recorded is not None and kept.learned is not None:
                return recorded.rest(look.time, self.glance_period)
        return self.glance_period if kept.learned is not None else GLANCE / 10

    def _take_monitored(self, kept: _Kept) -> None:
        """Take the last values of a monitor as a check: it may be the last one with a reply."""
        latest, device = kept.monitor.latest, kept.session.device
        if latest is None or latest.error or latest.state.kind == "unknown":
            return
        watch = self._watch(kept)
        timeout = watch.timeout if watch is not None and watch.active else None
        look = Look(latest.state, "", latest.time, timeout, latest.readings)
        if self._kept.get(device) is kept:
            self._looks = {**self._looks, device: look}

    @property
    def glance_period(self) -> float:
        """Seconds between two checks of a drive.

        Longer if many drives share the line, so that the checks do not load it.
        """
        return max(self.least_period, GLANCE_EACH * len(self._kept))

    async def _learn(self, kept: _Kept) -> float:
        """Check the byte order, then read the drive's timeout and its reaction."""
        await check_byte_order(kept.reader, Priority.POLL)
        found = await read_timeout(kept.reader, Priority.POLL, deciding_codes(kept.session.profile))
        kept.session.timeout = found
        kept.watch, kept.learned = found.watch, kept.session.clock.monotonic()
        unknown = None if found.known else UNKNOWN_TIMEOUT
        with self._changing:
            if self._kept.get(kept.session.device) is kept:
                self._keep_alive(kept, found.watch.timeout if found.watch else unknown)
        # reads of a replay cost nothing, and the program of the record had times of its own
        return GLANCE if kept.session.device in self.recorded else LEARN_AGAIN


def _glance_codes(profile: Profile) -> list[str]:
    """Return the codes of the values that a list of drives shows with the state."""
    found = (readout_parameter(profile, quantity) for quantity in GLANCE_QUANTITIES)
    return [parameter.code for parameter in found if parameter is not None]


def _state_codes(profile: Profile) -> list[str]:
    codes = watched_codes(profile)
    if profile.data.faults.parameter:
        codes.append(profile.data.faults.parameter)
    return list(dict.fromkeys(codes))
