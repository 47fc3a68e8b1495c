"""Simulated drives on a simulated line, served over a pseudo-terminal, a port or TCP."""

from .drive import SimulatedDrive
from .errors import SimulatorError
from .input_lines import check_inputs, set_inputs
from .plc import PlcOnLine, plc_cycle
from .server.client_settings import ClientSettings
from .server.endpoints import ByteStream
from .simulation import Simulation
from .spec import DriveSpec, FaultRates, LineTiming, parse_drives

__all__ = [
    "ByteStream",
    "ClientSettings",
    "DriveSpec",
    "FaultRates",
    "LineTiming",
    "PlcOnLine",
    "SimulatedDrive",
    "Simulation",
    "SimulatorError",
    "check_inputs",
    "parse_drives",
    "plc_cycle",
    "set_inputs",
]
