"""Simulated drives on a simulated line, served over a pseudo-terminal, a port or TCP."""

from .bench import Bench, BenchResult
from .bench_commands import BENCH, BenchCommand, BenchState
from .drive import SimulatedDrive
from .errors import SimulatorError
from .plc import PlcOnLine, plc_cycle
from .server.client_settings import ClientSettings
from .server.endpoints import ByteStream
from .simulation import Simulation
from .spec import DriveSpec, LineTiming, parse_drives
from .troubles import TROUBLES, FaultRates, Habits, troubles_of

__all__ = [
    "BENCH",
    "TROUBLES",
    "Bench",
    "BenchCommand",
    "BenchResult",
    "BenchState",
    "ByteStream",
    "ClientSettings",
    "DriveSpec",
    "FaultRates",
    "Habits",
    "LineTiming",
    "PlcOnLine",
    "SimulatedDrive",
    "Simulation",
    "SimulatorError",
    "parse_drives",
    "plc_cycle",
    "troubles_of",
]
