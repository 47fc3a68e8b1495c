"""State charts by family of drives, and their functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from tui.drive.profile.schema import Parameter

from ..body import Body
from ..plant.fault_history import OwnFault
from ..plant.motor import MotorDemand, Stop
from ..rules import ChartKind
from .altivar21 import Altivar21Chart
from .drivecom import DrivecomChart
from .leroy import LeroySomerChart
from .own import OwnChart


class PlayedChart(Protocol):
    """Simulation of a family's state chart for its drive."""

    def power_up(self) -> None: ...
    def run(self, hz: float, /) -> None: ...
    def refer(self, hz: float, /) -> None: ...
    def halt(self) -> None: ...
    def follow(self) -> None: ...
    def written(self, parameter: Parameter, /) -> None: ...
    def trip(self, stop: Stop, /) -> None: ...
    def reset_fault(self) -> None: ...
    def raises(self) -> OwnFault | None: ...
    def order(self) -> MotorDemand: ...
    def show(self) -> None: ...
    @property
    def running(self) -> bool: ...
    @property
    def keys(self) -> Mapping[str, Callable[[], str]]: ...


CHARTS: Mapping[ChartKind, Callable[[Body], PlayedChart]] = {
    "drivecom": DrivecomChart,
    "altivar21": Altivar21Chart,
    "leroy-somer": LeroySomerChart,
    "own": OwnChart,
}
