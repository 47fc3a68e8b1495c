"""Line monitored in a thread of its own, for a screen that reads it periodically."""

from __future__ import annotations

import logging
import threading
from collections.abc import Mapping
from contextlib import ExitStack

from tui.bus.errors import LineError
from tui.bus.link import Link
from tui.bus.trace import Frame, Trace
from tui.drive.profile.profile import Profile
from tui.wire.observed.splitting import ObservedFrame

from ..connect.address_prober import known_profiles
from .families import Families, remembered_families
from .listener import DecodedExchange
from .place import PlaceToListen, line_to_listen
from .port_listener import PortListener
from .summary import ListeningSummary

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
