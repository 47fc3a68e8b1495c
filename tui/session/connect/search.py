"""Search for drives on a line, with its progress and retries."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from tui.bus.api import IdentificationObjects, LineCounters, ModbusLine, Priority, Reply
from tui.bus.errors import LineClosed, LineError, LineLost, NoAnswer
from tui.bus.expectation import IDENTIFY
from tui.drive.finding import PresenceProbe
from tui.drive.sentences import counted

from ..clock import REAL_CLOCK
from .address_prober import AddressProber, probers_of
from .identify import ScanResult, find_drive

REST = 2.0
"""Pause of a search during regular polling, as a multiple of the time lost at an empty address."""
SECOND_WAIT = 0.1
"""Seconds within which a reply begins when silent addresses are tried again."""
LATE_WAIT = 0.3
"""Seconds after the last request in which late replies are accepted: some drives can be set to
answer after 250 ms."""

LEFT_ALONE = "left alone"
"""Source of the knowledge about a drive whose polling a program has paused."""

Rests = Callable[[float], Awaitable[None]]
Found = Callable[[ScanResult], Awaitable[None]]


class Search:
    """Search that probes each address in turn at the lowest priority, and silent ones twice.

    An empty address costs its request and the longest turnaround of the profiles. A device whose
    reply arrives later is still detected, and gets another request with a longer wait; unless
    `once`, so do all other addresses. A `patient` search waits as long as the line does: before a
    stop, and for drives simulated in this process, which are late if it is. `between` is called
    before each address, and may end the search by an exception. Progress may be read from any event
    loop.
    """

    def __init__(
        self,
        devices: Iterable[int],
        rests: Rests = REAL_CLOCK.sleep,
        *,
        once: bool = False,
        patient: bool = False,
        between: Callable[[], None] = lambda: None,
        now: Callable[[], float] = REAL_CLOCK.monotonic,
    ) -> None:
        self.devices = tuple(devices)
        self.of = len(self.devices)
        """Number of addresses in this round."""
        self.requested = 0
        """Number of addresses already requested."""
        self.at: int | None = None
        """The address that is being probed."""
        self.again = False
        """True while silent addresses are tried again."""
        self.answered: frozenset[int] = frozenset()
        self.ended = ""
        """`done`, `stopped`, or empty while it runs."""
        self.stops_found = False
        """Set by a stop of all during the search: it stops each drive that it finds. Any thread."""
        self._probed = 0
        """Number of addresses that the first round has probed."""
        self.cost = 0.0
        """Seconds that an empty address costs; 0 before the first request."""
        self._cost_again = 0.0
        self._silent = _SilentTimes()
        self._rests, self._now = rests, now
        self._once, self._patient, self._between = once, patient, between

    @property
    def goes_on(self) -> bool:
        """True while the search runs."""
        return not self.ended

    @property
    def is_stopping(self) -> bool:
        """True while it stops each drive that it finds."""
        return self.goes_on and self.stops_found

    @property
    def unprobed(self) -> tuple[int, ...]:
        """Addresses that were not probed yet: a drive there is not known, and not stopped."""
        return self.devices[self._probed :]

    @property
    def left(self) -> float:
        """Estimated seconds left if no further device answers; 0 before the first request.

        Uses the line's waits, or the measured times of silent addresses in this round if these are
        longer, as during polling. Retries are included.
        """
        if self.ended or not self.cost:
            return 0.0
        still = self.of - self.requested
        if self.again:
            return still * max(self._cost_again, self._silent.mean)
        first = still * max(self.cost, self._silent.mean)
        if self._once:
            return first
        return first + LATE_WAIT + (self._silent.times + still) * self._cost_again

    @property
    def text(self) -> str:
        """Progress as a short text."""
        found = len(self.answered)
        if self.ended:
            return f"{self.ended}, {found or 'none'} found"
        far = f"{self.requested} of {counted(self.of, '1 address', '{count} addresses')}"
        return f"{far} again" if self.again else f"{far}, {found or 'none'} found"

    async def run(self, line: ModbusLine, found: Found) -> None:
        """Run the search; calls `found` for every address that is not silent.

        A fault at one address does not end it. Raises LineClosed and LineLost.
        """
        try:
            if await self._refused_at_once(line, found):
                self.ended = "done"
                return
            wait = line.timing.scan_timeout
            how = await asyncio.to_thread(probers_of, line.link, wait, patient=self._patient)
            self.cost = how.cost
            self._cost_again = _cost_again(how, line)
            first = partial(self._round, line, how, found)
            silent = await first(self.devices, Priority.BACKGROUND, how.within)
            if silent and how.within is not None:
                await self._rests(LATE_WAIT)  # the last replies may be late as well
            late = [device for device in silent if line.device_state(device).answers]
            self.again = bool(silent)
            if late:
                longest = line.timing.patient_timeout
                slow = replace(how, patience=longest)
                await self._round(line, slow, found, late, Priority.PATIENT, longest)
            if not self._once and (rest := [number for number in silent if number not in late]):
                within = None if how.within is None else max(SECOND_WAIT, how.within)
                await first(rest, Priority.PATIENT, within)
            self.ended = "done"
        finally:
            self.ended = self.ended or "stopped"
            self.at = None

    async def _refused_at_once(self, line: ModbusLine, found: Found) -> bool:
        """Return True if the only device of the search has identified itself.

        It is requested before the profiles are read: reading them takes longer than most drives
        take to answer.
        """
        if len(self.devices) != 1 or self.devices[0] in line.facts.paused:
            return False
        (device,) = self.devices
        self._between()
        self.requested, self.at = 1, device
        first_probe = (PresenceProbe(None),)
        try:
            result = await find_drive(
                line, device, first_probe, priority=Priority.BACKGROUND, within=None
            )
        except (LineClosed, LineLost):
            raise
        except LineError:
            return False
        if result.identity is None or not (result.identity.reference or result.identity.profile):
            return False
        self.answered, self._probed = frozenset(self.devices), 1
        await found(result)
        return True

    async def _round(
        self,
        line: ModbusLine,
        how: AddressProber,
        found: Found,
        devices: Sequence[int],
        priority: Priority,
        within: float | None,
    ) -> list[int]:
        """Probe these addresses; return the silent ones."""
        self.requested, self.of, self._silent = 0, len(devices), _SilentTimes()
        silent: list[int] = []
        asks = _Considerate(line, self._rest)
        for number, device in enumerate(devices, start=1):
            self._probed = max(self._probed, number - 1)
            self._between()
            self.requested, self.at, began = number, device, self._now()
            if paused := line.facts.paused.get(device):
                # polling is paused on purpose: the drive is present, not silent
                self.answered |= {device}
                await found(ScanResult(device, None, paused[1], LEFT_ALONE))
                continue
            try:
                result = await find_drive(
                    asks,
                    device,
                    how.probes,
                    priority=priority,
                    within=within,
                    patience=how.patience,
                )
            except NoAnswer:
                silent.append(device)
                self._silent = self._silent.with_one_more(self._now() - began)
                continue
            except (LineClosed, LineLost):
                raise
            except LineError as fault:
                result = ScanResult(device, None, str(fault))
            self.answered |= {device}
            await found(result)
        self._probed = len(self.devices)
        return silent

    async def _rest(self, seconds: float) -> None:
        """Pause for regular polling, unless motors may run that are still to be found."""
        if not self.stops_found:
            await self._rests(seconds)


class _SilentTimes(NamedTuple):
    """Times taken by the empty addresses of a round, in seconds."""

    times: int = 0
    seconds: float = 0.0

    @property
    def mean(self) -> float:
        """Mean seconds of an empty address; 0 if there was none."""
        return self.seconds / self.times if self.times else 0.0

    def with_one_more(self, seconds: float) -> _SilentTimes:
        """Return the times with one more."""
        return _SilentTimes(self.times + 1, self.seconds + seconds)


def _cost_again(how: AddressProber, line: ModbusLine) -> float:
    """Seconds that the retry of a silent address costs."""
    if how.within is None:
        return line.timing.patient_timeout * len(how.probes)
    longer = max(SECOND_WAIT, how.within) - how.within
    return how.cost + longer * len(how.probes)


class _Considerate:
    """A line on which regular polling keeps its rate while empty addresses are probed.

    Each unanswered request delays a poll cycle: at most one falls into each cycle, and most cycles
    have none.
    """

    def __init__(self, line: ModbusLine, rests: Rests) -> None:
        self._line = line
        self._rests = rests

    @property
    def counters(self) -> LineCounters:
        """As the line's own."""
        return self._line.counters

    async def identify(
        self,
        device: int,
        *,
        priority: Priority,
        within: float | None = None,
        function: int = IDENTIFY,
    ) -> IdentificationObjects:
        """As the line's own."""
        try:
            return await self._line.identify(
                device, priority=priority, within=within, function=function
            )
        except NoAnswer:
            await self._rest(priority, within)
            raise

    async def read(
        self,
        device: int,
        address: int,
        count: int = 1,
        *,
        priority: Priority,
        within: float | None = None,
    ) -> Reply:
        """As the line's own."""
        try:
            return await self._line.read(device, address, count, priority=priority, within=within)
        except NoAnswer:
            await self._rest(priority, within)
            raise

    async def _rest(self, priority: Priority, within: float | None) -> None:
        if self._line.pace.busy:
            timing = self._line.timing
            patient = priority is Priority.PATIENT
            waited = timing.patient_timeout if patient else timing.scan_timeout
            await self._rests(
                REST * min(waited if within is None else within, timing.first_timeout)
            )
