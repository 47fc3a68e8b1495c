"""Simulated drives on a simulated line, served over a pseudo-terminal, a port or TCP."""

from .drive import SimulatedDrive
from .errors import SimulatorError
from .plc import PlcOnLine, plc_cycle
from .server.client_settings import ClientSettings
from .server.stream import ByteStream
from .simulation import Simulation, check_inputs, set_inputs
from .spec import DriveSpec, LineTiming, parse_drives
from .troubles import TROUBLES, FaultRates, Habits, troubles_of

__all__ = [
    "TROUBLES",
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
    "check_inputs",
    "parse_drives",
    "plc_cycle",
    "set_inputs",
    "troubles_of",
]
