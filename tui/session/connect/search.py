"""A search for drives on a line: how far it is, and who is asked once more."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Sequence

from tui.bus.api import IdentificationObjects, ModbusLine, Priority, Reply
from tui.bus.errors import LineClosed, LineError, LineLost, NoAnswer

from ..clock import REAL_CLOCK
from .identify import ScanResult, identify_drive

REST = 2.0
"""A search beside regular polls rests so many times as long as it waited in vain."""

Rests = Callable[[float], Awaitable[None]]


class Search:
    """Asks each address in turn, behind everything else; those that stay silent once more.

    Any loop may look at how far it is.
    """

    def __init__(self, devices: Iterable[int], rests: Rests = REAL_CLOCK.sleep) -> None:
        self.devices = tuple(devices)
        self.of = len(self.devices)
        """How many addresses are asked in this round."""
        self.asked = 0
        """How many of them are being asked or were."""
        self.at: int | None = None
        """The address that is being asked."""
        self.again = False
        """Whether it asks those a second time that were silent."""
        self.answered: frozenset[int] = frozenset()
        self.ended = ""
        """`done`, `stopped`, or empty while it goes on."""
        self._rests = rests

    @property
    def goes_on(self) -> bool:
        """Whether it has not ended."""
        return not self.ended

    @property
    def text(self) -> str:
        """How far it is, in few words."""
        found = f"{len(self.answered)} found"
        if self.ended:
            return f"{self.ended}, {found}"
        return f"{self.asked} of {self.of} again" if self.again else self._first_round(found)

    def _first_round(self, found: str) -> str:
        return f"{self.asked} of {self.of}, {found}"

    async def run(self, line: ModbusLine, found: Callable[[ScanResult], Awaitable[None]]) -> None:
        """Search; `found` hears of every address that is not silent.

        What is wrong with one address ends nothing. Raises LineClosed and LineLost.
        """
        try:
            silent = await self._round(line, self.devices, Priority.BACKGROUND, found)
            if silent:
                self.again = True
                await self._round(line, silent, Priority.PATIENT, found)
            self.ended = "done"
        finally:
            self.ended = self.ended or "stopped"
            self.at = None

    async def _round(
        self,
        line: ModbusLine,
        devices: Sequence[int],
        priority: Priority,
        found: Callable[[ScanResult], Awaitable[None]],
    ) -> list[int]:
        """Ask these addresses; returns those that were silent."""
        self.asked, self.of = 0, len(devices)
        silent: list[int] = []
        asks = _Considerate(line, self._rests)
        for number, device in enumerate(devices, start=1):
            self.asked, self.at = number, device
            try:
                result = ScanResult(device, await identify_drive(asks, device, priority=priority))
            except NoAnswer:
                silent.append(device)
                continue
            except (LineClosed, LineLost):
                raise
            except LineError as fault:
                result = ScanResult(device, None, str(fault))
            self.answered |= {device}
            await found(result)
        return silent


class _Considerate:
    """A line on which who polls keeps its rate while empty addresses are asked.

    Each wait in vain holds a cycle up: at most one falls into a cycle, and most have none.
    """

    def __init__(self, line: ModbusLine, rests: Rests) -> None:
        self._line = line
        self._rests = rests

    async def identify(self, device: int, *, priority: Priority) -> IdentificationObjects:
        """As the line's own."""
        try:
            return await self._line.identify(device, priority=priority)
        except NoAnswer:
            await self._rest(priority)
            raise

    async def read(self, device: int, address: int, count: int = 1, *, priority: Priority) -> Reply:
        """As the line's own."""
        try:
            return await self._line.read(device, address, count, priority=priority)
        except NoAnswer:
            await self._rest(priority)
            raise

    async def _rest(self, priority: Priority) -> None:
        if self._line.pace.busy:
            timing = self._line.timing
            patient = priority is Priority.PATIENT
            waited = timing.patient_timeout if patient else timing.scan_timeout
            await self._rests(REST * min(waited, timing.first_timeout))
