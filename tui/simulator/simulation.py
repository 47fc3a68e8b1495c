"""A simulated line at work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import TracebackType

from tui.drive.profile import Profile

from .drive import SimulatedDrive
from .endpoints import ByteStream
from .spec import DriveSpec, FaultRates, LineTiming


class Simulation:
    """Simulated drives on one line, with the ways to reach it."""

    def __init__(
        self,
        drives: Sequence[DriveSpec],
        *,
        timing: LineTiming | None = None,
        faults: FaultRates | None = None,
        seed: int = 0,
        profiles: Mapping[str, Profile] | None = None,
    ) -> None:
        raise NotImplementedError

    def __enter__(self) -> Simulation:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Start the simulated time."""

    def stop(self) -> None:
        """End every way to reach the line and the simulated time."""

    def serve_pty(self, link: str | None = None) -> str:
        """Serve the line on a pseudo-terminal; returns the path to open."""
        raise NotImplementedError

    def serve_tcp(self, host: str = "127.0.0.1", port: int = 0) -> tuple[str, int]:
        """Serve the drives over Modbus TCP; returns host and port."""
        raise NotImplementedError

    def serve_rtu_tcp(self, host: str = "127.0.0.1", port: int = 0) -> tuple[str, int]:
        """Serve the line's bytes over TCP; returns host and port."""
        raise NotImplementedError

    def serve_stream(self, stream: ByteStream) -> None:
        """Serve the line on an opened port."""
        raise NotImplementedError

    def drive(self, address: int) -> SimulatedDrive:
        """The drive that has this address now."""
        raise NotImplementedError

    def unplug(self) -> None:
        """Pull the plug of every endpoint."""
        raise NotImplementedError

    def replug(self) -> None:
        """Put the plug back."""
        raise NotImplementedError
