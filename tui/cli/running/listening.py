"""`listen` at work: traffic of a monitored line, and its end."""

from __future__ import annotations

import time

from tui.bus.listening_line import ListeningLine
from tui.session.capture_file import CaptureFile
from tui.session.listening.families import Families
from tui.session.listening.hearing import Hearing
from tui.session.listening.listener import DecodedExchange
from tui.wire.heard.splitting import HeardFrame

from ..shared.errors import USAGE, Failure
from ..shared.listen_outputs import HeardOutput


class HearingRun:
    """Passes traffic to an output and a file, and summarizes it."""

    def __init__(
        self,
        line: ListeningLine,
        families: Families,
        output: HeardOutput,
        file: CaptureFile | None = None,
    ) -> None:
        self._output = output
        self._file = file
        self._wall = time.time() - time.monotonic()
        """Offset from the monotonic clock to seconds since 1970."""
        self._hearing = Hearing(line, families, self._tell, self._keep)

    @property
    def text(self) -> str:
        """Summary of the traffic and of the files, in a sentence."""
        tally = self._hearing.listener.tally
        text = f"Heard {tally.exchanges} exchanges in {tally.frames} frames"
        if self._file is None:
            return f"{text}."
        return f"{text}; {self._file.packets} packets written to {self._file.path}."

    def run(self, seconds: float | None, every: float | None) -> None:
        """Listen for so long, or until Ctrl-C. Raises LineLost, and Failure for the file."""
        begun = time.monotonic()
        until = float("inf") if seconds is None else begun + seconds
        next_sum = float("inf") if every is None else begun + every
        while (now := time.monotonic()) < until:
            if now >= next_sum:
                self._sum_up(now)
                next_sum += every or 0.0
            left = min(until, next_sum) - now
            self._hearing.take(*self._hearing.read(left))

    def end(self) -> None:
        """Report open requests, and the summary."""
        now = time.monotonic()
        self._hearing.end(now)
        self._sum_up(now)

    def _tell(self, exchange: DecodedExchange) -> None:
        self._output.exchange(exchange, exchange.exchange.time + self._wall)

    def _sum_up(self, now: float) -> None:
        self._output.summary(self._hearing.summary(now), now + self._wall)

    def _keep(self, frame: HeardFrame, request: bool | None) -> None:
        """Write a frame to the file, if there is one."""
        if self._file is None:
            return
        wall = frame.ended + self._wall
        try:
            if request is None:
                self._file.add_noise(frame.data, wall)
            else:
                self._file.add_frame(frame.device, frame.pdu, wall, request=request)
        except OSError as error:
            text = f"{self._file.path} cannot be written: {error.strerror or error}."
            raise Failure(text, USAGE) from error
