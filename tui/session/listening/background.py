"""A line that is only monitored: step by step, or in a thread for a screen."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from tui.bus.errors import LineError
from tui.bus.link import Link, SerialLink, character_time, parse_link, silence
from tui.bus.listening_line import ListeningLine
from tui.bus.trace import Frame, Trace
from tui.drive.profile.profile import Profile
from tui.drive.read_plan import WireTiming
from tui.wire.observed.splitting import ObservedFrame

from ..clock import REAL_CLOCK, Clock
from ..connect.address_prober import known_profiles
from ..connect.line_key import SIMULATED_PREFIX
from ..connect.share_place import share_place, this_program
from .families import Families, remembered_families
from .listener import DecodedExchange, LineListener, OnFrame
from .summary import ListeningSummary, summary_of


class CannotListen(LineError):
    """The line cannot be monitored for other masters' traffic."""


@dataclass(frozen=True, slots=True)
class PlaceToListen:
    """Open line, and the action once monitoring is ready."""

    line: ListeningLine
    begin: Callable[[], None] = lambda: None


@contextmanager
def line_to_listen(text: str, program: str) -> Iterator[PlaceToListen]:
    """Open the line of a text for monitoring, for a program of that name.

    Raises CannotListen unless it is a serial line, LinkSyntaxError, and the errors of
    ListeningLine.
    """
    if text.casefold().startswith(SIMULATED_PREFIX):
        with _simulated(text, program) as place:
            yield place
        return
    link = parse_link(text)
    if not isinstance(link, SerialLink):
        raise CannotListen(
            f"{text} is not a serial port. Other masters cannot be monitored over a network. To see"
            " the traffic of a line that is open in Drive Panel, use the Frames screen."
        )
    with ListeningLine(link, share_place(text), this_program(program)) as line:
        yield PlaceToListen(line)


@contextmanager
def _simulated(text: str, program: str) -> Iterator[PlaceToListen]:
    """Simulated drives with a master that polls them once monitoring is ready."""
    from tui.simulator import PlcOnLine, Simulation, parse_drives, plc_cycle

    with Simulation(parse_drives(text[len(SIMULATED_PREFIX) :])) as simulation:
        cycle = plc_cycle([(drive.address, drive.profile) for drive in simulation.drives])
        master = PlcOnLine(simulation, cycle)
        try:
            link = SerialLink(master.path)
            with ListeningLine(link, None, this_program(program)) as line:
                yield PlaceToListen(line, master.start)
        finally:
            master.stop()


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


LISTENED_FRAMES = 1000
READ_WITHIN = 0.1
"""Seconds within which monitoring ends after a request."""
SUMMED_UP_EVERY = 1.0
"""Seconds for which a summary is reused: it needs one read plan per drive."""

log = logging.getLogger(__name__)


class BackgroundListener:
    """Monitored line, opened by `open`; every attribute may be read from any thread.

    `named` gives profiles by device, with None as the key for all others.
    """

    def __init__(
        self, text: str, program: str, named: Mapping[int | None, Profile] | None = None
    ) -> None:
        self.text = text
        self._program, self._named = program, named
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._stack = ExitStack()
        self._thread: threading.Thread | None = None
        self._trace = Trace(LISTENED_FRAMES)
        self._summed: tuple[float, ListeningSummary] | None = None
        self.trouble = ""
        """Error that ended monitoring; empty while it runs or after `close`."""

    def open(self) -> None:
        """Open the line and start monitoring; reads files. Raises as `line_to_listen` does."""
        with ExitStack() as opening:
            place: PlaceToListen = opening.enter_context(line_to_listen(self.text, self._program))
            self.link: Link = place.line.link
            self._families = Families(
                known_profiles(), self._named, remembered_families(place.line.link)
            )
            self._port_listener = PortListener(place.line, self._families, _forget, self._keep)
            place.begin()
            self._stack = opening.pop_all()
        self._thread = threading.Thread(target=self._listen, name="listening", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Release the port; may be called twice."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()
        self._stack.close()

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The last frames, oldest first: requests are `out`, replies `in`, of any sender."""
        return self._trace.frames()

    def summary(self) -> ListeningSummary:
        """Return the summary; at most a second old."""
        with self._lock:
            now = self._port_listener.clock.monotonic()
            if self._summed is None or now - self._summed[0] > SUMMED_UP_EVERY:
                self._summed = now, self._port_listener.summary(now)
            return self._summed[1]

    def profile(self, device: int) -> Profile | None:
        """Return the profile at present assumed for a drive."""
        with self._lock:
            family = self._families.family(device)
        return family.profile if family is not None else None

    def raws(self, device: int) -> Mapping[str, int]:
        """Return the last observed raw value of each parameter of a drive."""
        with self._lock:
            tally = self._port_listener.listener.tally.drives.get(device)
            return dict(tally.raws) if tally is not None else {}

    def _listen(self) -> None:
        try:
            while not self._over.is_set():
                data, now = self._port_listener.read(READ_WITHIN)
                with self._lock:
                    self._port_listener.take(data, now)
        except LineError as error:
            self.trouble = str(error)
        except Exception as error:
            log.exception("listening to %s failed", self.text)
            self.trouble = f"Listening failed: {error}"

    def _keep(self, frame: ObservedFrame, request: bool | None) -> None:
        note = "noise" if request is None else ""
        self._trace.add(frame.ended, "out" if request else "in", frame.data, note)


def _forget(_: DecodedExchange) -> None:
    """Ignore an exchange: its frames are reported, and it is counted."""
