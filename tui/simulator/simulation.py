"""Running simulated line: its drives, its time and its endpoints."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Mapping, Sequence

from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile

from .drive import SimulatedDrive
from .errors import SimulatorError
from .ghost import GhostDrive
from .server.client_settings import ClientSettings
from .server.conversation import Conversation, RtuConversation, SimulatedLine, TcpConversation
from .server.endpoints import ByteStream, Endpoint, PtyEndpoint, StreamEndpoint, TcpEndpoint
from .server.faults import FaultPlan
from .spec import DriveSpec, LineTiming
from .troubles import FaultRates, Habits

TICK = 0.05
"""Time in s between two steps of the drives if no request arrives."""


class Simulation:
    """Simulated drives on one line, with their endpoints.

    The drives' time passes from `start` to `stop`, in a thread of its own; every endpoint has a
    thread too. `profiles` replaces the installed profiles, by id; `clock` is the drives' time, in
    s. With `any_settings`, the baud and stop bits of a client of a pseudo-terminal do not matter.
    `ghosts` are recorded drives on the same line.
    Raises SimulatorError for two drives with one address, UnknownProfile, UnknownParameter.
    """

    def __init__(
        self,
        drives: Sequence[DriveSpec],
        *,
        timing: LineTiming | None = None,
        faults: FaultRates | None = None,
        habits: Habits | None = None,
        seed: int = 0,
        profiles: Mapping[str, Profile] | None = None,
        clock: Callable[[], float] = time.monotonic,
        any_settings: bool = False,
        ghosts: Sequence[GhostDrive] = (),
    ) -> None:
        self._any_settings = any_settings
        self.timing = timing or LineTiming()
        addresses = [spec.address for spec in drives] + [ghost.address for ghost in ghosts]
        twice = next((a for a in addresses if addresses.count(a) > 1), None)
        if twice is not None:
            raise SimulatorError(f"Two simulated drives have address {twice}; give each its own.")
        own = profiles or {}
        self.line = SimulatedLine(
            [
                SimulatedDrive(
                    own.get(spec.profile) or load(spec.profile),
                    spec,
                    timing=self.timing,
                    seed=seed,
                )
                for spec in drives
            ],
            self.timing,
            clock,
            ghosts,
        )
        self.faults = FaultPlan(faults or FaultRates(), seed, habits or Habits())
        self._endpoints: list[Endpoint] = []
        self._ticker: threading.Thread | None = None
        self._stopping = threading.Event()

    def __enter__(self) -> Simulation:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        """Start the drives' time; does nothing if it is running."""
        if self._ticker is None:
            self._stopping.clear()
            self.line.start()
            self._ticker = threading.Thread(target=self._tick, name="simulated time", daemon=True)
            self._ticker.start()

    def _tick(self) -> None:
        # one drive at a time: a request that comes then waits for one step at most
        count = len(self.drives)
        for place in itertools.cycle(range(max(1, count))):
            if self._stopping.wait(TICK / max(1, count)):
                return
            if count:
                self.line.advance_drive(place)

    def stop(self) -> None:
        """Stop all endpoints and the simulated time."""
        for endpoint in self._endpoints:
            endpoint.unplug()
        self._endpoints.clear()
        if self._ticker is not None:
            self._stopping.set()
            self._ticker.join()
            self._ticker = None
            self.line.running = False

    def serve_pty(self, link: str | None = None) -> str:
        """Serve the line on a pseudo-terminal; returns the path to open.

        That path is a symbolic link, made at `link` if given, removed at the end. It begins with
        the settings of the first drive. Raises SimulatorError if the system has no pseudo-terminals
        or the path is in use.
        """
        first = self.drives[0].station.own(self.timing) if self.drives else self.timing
        endpoint = PtyEndpoint(self._rtu, link, first, any_settings=self._any_settings)
        self._add(endpoint)
        return endpoint.path

    def serve_tcp(self, host: str = "127.0.0.1", port: int = 0) -> tuple[str, int]:
        """Serve the drives over Modbus TCP, by unit; returns host and port.

        Raises SimulatorError if the port is not available.
        """
        endpoint = TcpEndpoint(
            lambda: TcpConversation(self.line, self.faults),
            host,
            port,
            self.faults.habits.idle_close,
        )
        self._add(endpoint)
        return endpoint.address

    def serve_rtu_tcp(self, host: str = "127.0.0.1", port: int = 0) -> tuple[str, int]:
        """Serve the line's bytes over TCP; returns host and port.

        Raises SimulatorError if the port is not available.
        """
        endpoint = TcpEndpoint(self._rtu_unseen, host, port, self.faults.habits.idle_close)
        self._add(endpoint)
        return endpoint.address

    def serve_stream(self, stream: ByteStream) -> None:
        """Serve the line on an opened port, which is closed at the end."""

        def paced() -> Conversation:
            return RtuConversation(self.line, self.faults, paced=True)

        self._add(StreamEndpoint(paced, stream))

    def _rtu(self, client: Callable[[], ClientSettings] | None) -> Conversation:
        return RtuConversation(self.line, self.faults, client=client)

    def _rtu_unseen(self) -> Conversation:
        return self._rtu(None)

    def _add(self, endpoint: Endpoint) -> None:
        self.start()
        endpoint.plug()
        self._endpoints.append(endpoint)

    def drive(self, address: int) -> SimulatedDrive:
        """Return the drive with this address at present; raises SimulatorError."""
        return self.line.drive(address)

    @property
    def only_drive(self) -> SimulatedDrive:
        """Return the only drive of the line; raises SimulatorError if there are several."""
        if len(self.drives) != 1:
            known = ", ".join(str(drive.address) for drive in self.drives)
            raise SimulatorError(
                f"Say which drive: its address and a colon first. It has: {known}."
            )
        return self.drives[0]

    @property
    def drives(self) -> tuple[SimulatedDrive, ...]:
        """All drives of the line."""
        return self.line.drives

    def unplug(self) -> None:
        """Unplug every endpoint: terminals and connections close."""
        for endpoint in self._endpoints:
            endpoint.unplug()

    def replug(self) -> None:
        """Plug every endpoint in again: links and TCP ports are the same as before."""
        for endpoint in self._endpoints:
            endpoint.plug()
