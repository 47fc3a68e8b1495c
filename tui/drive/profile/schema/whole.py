"""A whole profile file."""

from __future__ import annotations

from .base import Table
from .block import Block
from .chart import Chart, CommandExample, Reference
from .control_source import ControlSource
from .identification import Erratum, Head, Identification, Source
from .link import (
    Addresses,
    Connector,
    ExceptionCode,
    Function,
    LineRule,
    Link,
    Reading,
)
from .memory import Memory
from .monitoring import CommunicationFault, Faults, Monitoring
from .parameter import Enumeration, Parameter


class ProfileData(Table, frozen=True, kw_only=True):
    """A whole profile file."""

    profile: Head
    sources: list[Source] = []
    errata: list[Erratum] = []
    identification: Identification = Identification()
    link: Link
    addresses: Addresses = Addresses()
    functions: list[Function]
    reading: Reading = Reading()
    blocks: list[Block] = []
    exceptions: list[ExceptionCode] = []
    charts: list[Chart] = []
    command_examples: list[CommandExample] = []
    references: list[Reference] = []
    faults: Faults = Faults()
    monitoring: Monitoring
    control_sources: list[ControlSource] = []
    communication_fault: CommunicationFault | None = None
    memory: Memory = Memory()
    connectors: list[Connector] = []
    line_rules: list[LineRule] = []
    enumerations: list[Enumeration] = []
    parameters: list[Parameter]
