"""A whole profile file."""

from __future__ import annotations

from .base import Table
from .block import Block
from .channel import Channels
from .chart import Chart, CommandExample, ReferenceWay, TeachableReference
from .control_source import ControlSource
from .identification import Erratum, Identification, ProfileHead, Source
from .link import (
    Addresses,
    Connector,
    ExceptionCode,
    Function,
    LineRule,
    LinkSettings,
    PortCounters,
    ReadShapes,
)
from .memory import MemoryOrders
from .monitoring import CommunicationFault, Faults, Monitoring
from .parameter import Enumeration, Parameter, ParameterGroup
from .start_up import StartUpStep
from .wiring import Wiring


class ProfileData(Table, frozen=True, kw_only=True):
    """A whole profile file."""

    profile: ProfileHead
    sources: list[Source] = []
    errata: list[Erratum] = []
    identification: Identification = Identification()
    link: LinkSettings
    addresses: Addresses = Addresses()
    functions: list[Function]
    port_counters: list[PortCounters] = []
    reading: ReadShapes = ReadShapes()
    blocks: list[Block] = []
    exceptions: list[ExceptionCode] = []
    charts: list[Chart] = []
    command_examples: list[CommandExample] = []
    references: list[ReferenceWay] = []
    teachable_references: list[TeachableReference] = []
    faults: Faults = Faults()
    monitoring: Monitoring
    channels: Channels = Channels()
    control_sources: list[ControlSource] = []
    communication_fault: CommunicationFault | None = None
    memory: MemoryOrders = MemoryOrders()
    start_up: list[StartUpStep] = []
    connectors: list[Connector] = []
    line_rules: list[LineRule] = []
    wiring: Wiring = Wiring()
    groups: list[ParameterGroup] = []
    enumerations: list[Enumeration] = []
    parameters: list[Parameter]
