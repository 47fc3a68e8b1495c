"""`listen` at work: the line that is meant, what comes of it, and its end."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import click

from tui.bus.link import SerialLink, character_time, parse_link, silence
from tui.bus.listening_line import ListeningLine
from tui.drive.read_plan import WireTiming
from tui.session.capture_file import CaptureFile
from tui.session.connect.line_key import SIMULATED_PREFIX
from tui.session.connect.share_place import share_place, this_program
from tui.session.listening.families import Families
from tui.session.listening.listener import LineListener, ToldExchange
from tui.session.listening.summary import summary_of
from tui.wire.heard.splitting import HeardFrame

from ..shared.errors import USAGE, Failure
from ..shared.listen_outputs import HeardOutput

PROGRAM_NAME = "listen"


@dataclass(frozen=True, slots=True)
class PlaceToListen:
    """An opened line, and what is to be done once all is ready for what comes."""

    line: ListeningLine
    begin: Callable[[], None] = lambda: None


@contextmanager
def line_to_listen(text: str) -> Iterator[PlaceToListen]:
    """The line that is meant, opened. Raises UsageError for one that is no serial line."""
    if text.casefold().startswith(SIMULATED_PREFIX):
        with _simulated(text) as place:
            yield place
        return
    link = parse_link(text)
    if not isinstance(link, SerialLink):
        raise click.UsageError(
            f"{text}: listening needs a serial port. Over a network nobody hears what others say;"
            " the Frames screen shows what goes over a line of this program."
        )
    with ListeningLine(link, share_place(text), this_program(PROGRAM_NAME)) as line:
        yield PlaceToListen(line)


@contextmanager
def _simulated(text: str) -> Iterator[PlaceToListen]:
    """Simulated drives with a master that asks them, as soon as it is listened to."""
    from tui.simulator import PlcOnLine, Simulation, parse_drives, plc_cycle

    with Simulation(parse_drives(text[len(SIMULATED_PREFIX) :])) as simulation:
        cycle = plc_cycle([(drive.address, drive.profile) for drive in simulation.drives])
        master = PlcOnLine(simulation, cycle)
        try:
            link = SerialLink(master.path)
            with ListeningLine(link, None, this_program(PROGRAM_NAME)) as line:
                yield PlaceToListen(line, master.start)
        finally:
            master.stop()


class HearingRun:
    """Takes what comes, hands it to an output and a file, and sums it up."""

    def __init__(
        self,
        line: ListeningLine,
        families: Families,
        output: HeardOutput,
        file: CaptureFile | None = None,
    ) -> None:
        self._line = line
        self._output = output
        self._file = file
        link = line.link
        self._timing = WireTiming(character_time(link), silence(link))
        self._wall = time.time() - time.monotonic()
        """What makes a time since 1970 of one of the monotonic clock."""
        self._listener = LineListener(
            families,
            time.monotonic(),
            character=line.character,
            silence=line.silence,
            frame_heard=self._keep,
        )

    @property
    def text(self) -> str:
        """What was heard and written, in a sentence."""
        tally = self._listener.tally
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
            data = self._line.read(min(self._listener.pause, left))
            now = time.monotonic()
            self._tell(self._listener.take(data, now) if data else self._listener.idle(now))

    def end(self) -> None:
        """Tell what is still open, and what it came to."""
        now = time.monotonic()
        self._tell(self._listener.end(now))
        self._sum_up(now)

    def _tell(self, exchanges: list[ToldExchange]) -> None:
        for one in exchanges:
            self._output.exchange(one, one.exchange.time + self._wall)

    def _sum_up(self, now: float) -> None:
        self._output.summary(summary_of(self._listener, now, self._timing), now + self._wall)

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
