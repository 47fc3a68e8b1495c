"""Step-by-step monitoring of an open line, with a summary."""

from __future__ import annotations

from collections.abc import Callable

from tui.bus.link import character_time, silence
from tui.bus.listening_line import ListeningLine
from tui.drive.read_plan import WireTiming

from ..clock import REAL_CLOCK, Clock
from .families import Families
from .listener import DecodedExchange, LineListener, OnFrame
from .summary import ListeningSummary, summary_of

OnExchange = Callable[[DecodedExchange], None]


class PortListener:
    """Monitored line; times are those of its clock."""

    def __init__(
        self,
        line: ListeningLine,
        families: Families,
        reported: OnExchange,
        on_frame: OnFrame = lambda _frame, _request: None,
        clock: Clock = REAL_CLOCK,
    ) -> None:
        self.clock = clock
        self._line, self._report = line, reported
        self._timing = WireTiming(character_time(line.link), silence(line.link))
        self.listener = LineListener(
            families,
            self.clock.monotonic(),
            character=line.character,
            silence=line.silence,
            on_frame=on_frame,
        )

    def read(self, wait: float) -> tuple[bytes, float]:
        """Return the bytes of the next `wait` seconds, and their time. Raises LineLost."""
        data = self._line.read(min(self.listener.pause, wait))
        return data, self.clock.monotonic()

    def take(self, data: bytes, now: float) -> None:
        """Report the exchanges completed by the bytes read, or by a pause without bytes."""
        found = self.listener.take(data, now) if data else self.listener.idle(now)
        for exchange in found:
            self._report(exchange)

    def end(self, now: float) -> None:
        """Report open requests."""
        for exchange in self.listener.end(now):
            self._report(exchange)

    def summary(self, now: float) -> ListeningSummary:
        """Return the present result."""
        return summary_of(self.listener, now, self._timing)
