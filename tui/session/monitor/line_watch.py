"""Looking after every drive found on a line, watched or not.

Some drives watch the line and trip when it falls silent (communication timeout). The holder of the
line reads them as long as this program is on it, at least three times in each timeout, before polls
and before an operator's own requests. Other requests show the state of the drives in a list.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, replace

from tui.bus.api import Contact, LineWorker, ModbusLine, Priority, contact_of
from tui.bus.errors import LineError, LineLost
from tui.drive.channel import channel_codes
from tui.drive.chart import ENABLED_KINDS, watched_codes
from tui.drive.orders import deciding_codes
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.safety import READS_PER_TIMEOUT, WARNED_AT_SHARE

from ..drive import DriveSession
from ..drive_state import DriveState, drive_state
from ..read.order_check import check_byte_order
from ..read.presence import UNKNOWN_TIMEOUT, alive_read
from ..read.reader import Reader
from ..timeout_report import TimeoutWatch
from .alarms import FaultOnsets
from .load import unread_limit
from .look import Look, last_that_brought
from .monitor import Monitor
from .timeout import TimeoutWarning, has_begun, read_timeout

log = logging.getLogger(__name__)

GLANCE_QUANTITIES: tuple[Quantity, ...] = (
    "output_frequency",
    "frequency_reference",
    "motor_current",
)
MAY_TURN = frozenset({"running", "unknown"})
"""Kinds of state in which a motor that was commanded from here is not left alone unasked."""
GLANCE = 3.0
"""Seconds between two looks at a drive that no monitor watches."""
GLANCE_EACH = 0.15
"""Seconds of that for each drive of the line."""
LEARN_AGAIN = 20.0
"""Seconds after which a drive's timeout and reaction are read again: they may be changed."""
SHORTEST = 0.02


@dataclass(slots=True)
class _Kept:
    session: DriveSession
    monitor: Monitor
    reader: Reader
    since: float
    watch: TimeoutWatch | None = None
    learned: float | None = None
    workers: tuple[LineWorker, ...] = ()


class LineWatch:
    """Asks each kept drive often enough, in workers of the line's loop."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._kept: dict[int, _Kept] = {}
        self._changing = threading.RLock()
        """Held while a drive comes or goes, and while it is kept alive."""
        self._looks: dict[int, Look] = {}
        self.onsets = FaultOnsets()

    @property
    def looks(self) -> Mapping[int, Look]:
        """The last look at each drive, by device."""
        return dict(self._looks)

    def watch(self, device: int) -> TimeoutWatch | None:
        """A drive's watch over the line, once it is known and not off."""
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

    def left_alone(self) -> dict[int, TimeoutWatch]:
        """Drives that react to their communication timeout when polling stops, at rest too."""
        found = {device: self.watch(device) for device in self._kept}
        return {
            device: watch
            for device, watch in found.items()
            if watch is not None and watch.active and (watch.trips or self.runs(device))
        }

    def unread(self) -> list[DriveSession]:
        """Drives whose timeout was not read yet: what they do left alone is not known."""
        return [
            kept.session
            for kept in self._kept.values()
            if kept.learned is None and kept.session.profile.data.communication_fault is not None
        ]

    def under_command(self) -> list[DriveSession]:
        """Drives that this program commanded and whose motors are not surely at standstill."""
        return [
            kept.session
            for kept in self._kept.values()
            if kept.session.commanded and self._may_turn(kept)
        ]

    def runs(self, device: int) -> bool:
        """Return True if a motor runs, as far as anybody saw it last."""
        state, _ = self._last_seen(self._kept[device])
        return state is not None and state.motion == "running"

    def turns(self, device: int) -> bool | None:
        """Return True if a drive may turn its motor, by its newest state; None if not known."""
        kept = self._kept.get(device)
        state = self._last_seen(kept)[0] if kept is not None else None
        kind = state.motion if state is not None else "unknown"
        return None if kind == "unknown" else kind in ENABLED_KINDS

    def _may_turn(self, kept: _Kept) -> bool:
        """Return True if a motor runs, or may: not seen since the last order, or not understood."""
        state, seen = self._last_seen(kept)
        ordered = kept.session.commanded_at
        if state is None or (ordered is not None and seen <= ordered):
            return True
        return state.motion in MAY_TURN

    def _last_seen(self, kept: _Kept) -> tuple[DriveState | None, float]:
        """The newest state of a drive, by its own monitor or by a look; and when that was."""
        look, latest = self._looks.get(kept.session.device), kept.monitor.latest
        state, seen = (look.state, look.time) if look else (None, 0.0)
        if latest is not None and latest.time > seen and not latest.error:
            return latest.state, latest.time
        return state, seen

    @property
    def states(self) -> dict[int, DriveState]:
        """The newest state of each drive that was seen at all, by device."""
        seen = {device: self._last_seen(kept)[0] for device, kept in self._kept.items()}
        for device, look in self._looks.items():
            if seen.get(device) is None and look.before is not None:
                # a drive that is not heard for a moment is not one without its fault
                seen[device] = look.before.state
        return {device: state for device, state in seen.items() if state is not None}

    def warnings(self) -> list[TimeoutWarning]:
        """Drives that are about to act on their timeout, or have, for want of an answer."""
        found = []
        for device, kept in self._kept.items():
            watch = self._watch(kept)
            if watch is None or not watch.active:
                continue
            silent = kept.session.clock.monotonic() - self._heard(kept)
            if silent > WARNED_AT_SHARE * watch.timeout:
                found.append(TimeoutWarning(device, kept.session.profile, silent, watch))
        return found

    def _heard(self, kept: _Kept) -> float:
        heard = self._line.device_state(kept.session.device).heard
        return kept.session.clock.line_time(heard) if heard else kept.since

    def keep(self, session: DriveSession, monitor: Monitor) -> None:
        """Look after a drive from now on; its monitor, while it runs, spares the looks."""
        device = session.device
        kept = _Kept(session, monitor, Reader(session), session.clock.monotonic())
        with self._changing:
            if device in self._kept:
                self._let_go(self._kept[device])
            self._kept = {**self._kept, device: kept}
            # until it is learnt, too: words that the drive does not have may take seconds
            self._keep_alive(kept, UNKNOWN_TIMEOUT)
        kept.workers = (
            self._line.spawn(lambda: self._again(kept, self._learn), f"learner {device}"),
            self._line.spawn(lambda: self._again(kept, self._glance), f"line_watch {device}"),
        )

    def stop(self) -> None:
        """Let every drive go."""
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
        """Have a drive kept from its timeout; None if it has none."""
        read = alive_read(kept.session, timeout) if timeout is not None else None
        if read is None:
            self._line.facts.keep_alives.let_go(kept.session.device)
        else:
            self._line.facts.keep_alives.keep(read)

    async def _again(self, kept: _Kept, step: Callable[[_Kept], Awaitable[float]]) -> None:
        """Do a step for good; it says how many seconds later it is due again."""
        while True:
            try:
                rest = await step(kept)
            except LineError as error:
                if isinstance(error, LineLost):
                    kept.session.byte_order.forget()
                rest = self._after_failure(kept)
            except Exception:
                # what goes wrong with one drive must not leave the others alone
                log.exception("looking after device %s failed", kept.session.device)
                rest = GLANCE
            await kept.session.clock.sleep(max(SHORTEST, rest))

    @staticmethod
    def _after_failure(kept: _Kept) -> float:
        timeout = kept.watch.timeout if kept.watch else 4 * READS_PER_TIMEOUT
        return min(1.0, timeout / READS_PER_TIMEOUT / 2)

    async def _glance(self, kept: _Kept) -> float:
        """Look at a drive's state, unless its monitor does."""
        if kept.monitor.running:
            return GLANCE / 10
        profile, device = kept.session.profile, kept.session.device
        state, error, readings = None, "", {}
        contact: Contact = "answers"
        try:
            codes = [*_state_codes(profile), *_glance_codes(profile), *unread_limit(kept.session)]
            reported = channel_codes(profile)
            codes += [code for code in reported if profile[code].access == "r"]
            readings = await kept.reader.read(codes, priority=Priority.POLL)
            # settings are read with the timeout: another channel is set up at rest only
            settings = {
                c: reading for c in reported if (reading := kept.session.image.get(c)) is not None
            }
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
        return self.glance_period if kept.learned is not None else GLANCE / 10

    @property
    def glance_period(self) -> float:
        """Seconds between two looks at a drive.

        Longer where many drives share the line, so that looks leave it to the others.
        """
        return max(GLANCE, GLANCE_EACH * len(self._kept))

    async def _learn(self, kept: _Kept) -> float:
        """Read the drive's timeout and its reaction; before that, how its words arrive."""
        await check_byte_order(kept.reader, Priority.POLL)
        found = await read_timeout(kept.reader, Priority.POLL, deciding_codes(kept.session.profile))
        kept.session.timeout = found
        kept.watch, kept.learned = found.watch, kept.session.clock.monotonic()
        unknown = None if found.known else UNKNOWN_TIMEOUT
        with self._changing:
            if self._kept.get(kept.session.device) is kept:
                self._keep_alive(kept, found.watch.timeout if found.watch else unknown)
        return LEARN_AGAIN


def _glance_codes(profile: Profile) -> list[str]:
    """Return the codes that a list of drives shows beside a motor's state."""
    found = (profile.quantity(quantity) for quantity in GLANCE_QUANTITIES)
    return [parameter.code for parameter in found if parameter is not None]


def _state_codes(profile: Profile) -> list[str]:
    codes = watched_codes(profile)
    if profile.data.faults.parameter:
        codes.append(profile.data.faults.parameter)
    return list(dict.fromkeys(codes))
