"""A whole profile file, with its blocks, control sources, memory commands and first steps."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, Effective, Identifier, RawWord, ReadCount, Table, When, WordAddress
from .channel import Channels
from .chart import Chart, CommandExample, ReferenceWay, TeachableReference
from .identification import Erratum, Identification, ProfileHead, Source
from .link import (
    Addresses,
    Connector,
    ExceptionCode,
    Function,
    LineRule,
    LinkSettings,
    PortCounters,
    ProfileFrame,
    ReadShapes,
)
from .monitoring import CommunicationFault, Faults, Monitoring
from .parameter import Enumeration, Parameter, ParameterGroup
from .signal_path import SignalPath
from .wiring import CablingMaster, CablingPart, KeypadFunction, LineSchematic, Wiring


class StartUpStep(Table, frozen=True, kw_only=True):
    """One step of a first commissioning; the steps are in their order.

    Their parameters, in this order, are the group Commissioning of the editor.
    """

    step: str
    """Short name of the step."""
    text: str
    """Decision or task for the technician at the machine."""
    parameters: list[str] = []
    """Codes in the order in which they are set or checked."""
    action: Literal["", "auto-tune", "save", "first-run", "take-control"] = ""
    """Action of the step besides setting values."""
    stopped_only: bool = False
    note: str = ""
    source: str
    confidence: Confidence | Literal["practice"]
    """Certainty that the step belongs here; `practice` is general practice, from no document."""


class Predecessor(Table, frozen=True, kw_only=True):
    """A family that this one replaces, with the table of settings that mean the same in both.

    Values are carried over in engineering units and by name. Settings that it does not map are
    reported, and never written.
    """

    profile: Identifier
    """Id of the profile of that family."""
    same_codes: bool = False
    """True if settings with the same code mean the same."""
    codes: dict[str, str] = {}
    """Codes of this family by code of the predecessor."""
    unlike: dict[str, str] = {}
    """Reason by code of the predecessor, for settings that are not carried over."""
    note: str = ""
    source: str
    confidence: Confidence

    def counterpart(self, code: str) -> str:
        """Return this family's code for a setting of the predecessor; empty without one."""
        if code in self.unlike:
            return ""
        return self.codes.get(code, code if self.same_codes else "")


class MemoryOrder(Table, frozen=True, kw_only=True):
    """A word that saves settings or restores factory settings."""

    parameter: str
    raw: RawWord
    """The value, or the bits that are set while the others are kept."""
    bit: bool = False
    """True if `raw` contains bits and the word's other bits are kept."""
    does: str
    """Exact effect, shown for confirmation."""
    at_rest_mask: RawWord = 0
    """Bits of the extended status word that must be 0 beforehand."""
    keeps_value: bool = False
    """True if the word keeps the written value and does not show completion."""
    done: When | None = None
    """Condition that shows completion, if the word itself does not."""
    groups: str = ""
    """A word that selects the groups of settings; nothing happens while it is 0."""
    source: str = ""


class EnterWord(Table, frozen=True, kw_only=True):
    """A word that must follow a written setting, for the drive to use it."""

    parameter: str
    raw: RawWord
    when: When | None = None
    """Condition under which it is needed; absent: always."""
    source: str = ""


class Eeprom(Table, frozen=True, kw_only=True):
    """Endurance of a drive's EEPROM."""

    writes: Annotated[int, Meta(ge=1)] | None = None
    """Number of writes that it lasts for; absent if no document states it."""
    also_saved_by: list[When] = []
    """Words besides `save` that store all settings when they get these values."""
    source: str = ""
    confidence: Confidence = "manual"


class MemoryOrders(Table, frozen=True, kw_only=True):
    """Commands to a drive's memory; unknown ones are omitted."""

    enter: EnterWord | None = None
    """Written after each setting, before it is read back."""
    save: MemoryOrder | None = None
    factory: MemoryOrder | None = None
    eeprom: Eeprom = Eeprom()
    """Life of the EEPROM, and further words that save."""
    busy_mask: RawWord = 0
    """Bits of the extended status word that are 1 while the EEPROM is written."""


class Setting(Table, frozen=True, kw_only=True):
    """A parameter and its required raw value."""

    parameter: str
    value: RawWord


class Way(Table, frozen=True, kw_only=True):
    """Source of the command or the reference, or the selection between two."""

    sources: Annotated[list[str], Meta(min_length=1, max_length=2)]
    """One source, or two: without the switch and with it."""
    switch: str = ""


class ControlSource(Table, frozen=True, kw_only=True):
    """A configuration of command source and reference source."""

    id: Identifier
    name: str
    command: Way
    reference: Way
    settings: list[Setting]
    """Settings that select it, in write order."""
    note: str = ""
    source: str = ""


class BlockChoice(Table, frozen=True, kw_only=True):
    """Raw selector value of an indirect block and its parameter."""

    raw: RawWord
    parameter: str


class Block(Table, frozen=True, kw_only=True):
    """An indirect block or a table of the communication scanner."""

    id: Identifier
    name: str
    direction: Literal["read", "write"]
    address: WordAddress
    min_words: ReadCount = 1
    max_words: ReadCount
    slots: list[str]
    """Parameters that select the content of each slot, in order."""
    values: list[str] = []
    """Parameters that carry the values, if they are separate parameters."""
    selects_by: Literal["choice", "address"]
    choices: list[BlockChoice] = []
    fixed_start: bool = False
    """True if a read must begin at `address`; otherwise any part can be read."""
    write_when: Literal["any", "stopped"] = "any"
    effective: Effective = "at-once"
    note: str = ""
    source: str = ""


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
    frames: list[ProfileFrame] = []
    charts: list[Chart] = []
    command_examples: list[CommandExample] = []
    references: list[ReferenceWay] = []
    teachable_references: list[TeachableReference] = []
    faults: Faults = Faults()
    monitoring: Monitoring
    channels: Channels = Channels()
    control_sources: list[ControlSource] = []
    signal_paths: list[SignalPath] = []
    communication_fault: CommunicationFault | None = None
    memory: MemoryOrders = MemoryOrders()
    start_up: list[StartUpStep] = []
    predecessors: list[Predecessor] = []
    connectors: list[Connector] = []
    line_rules: list[LineRule] = []
    wiring: Wiring = Wiring()
    schematics: list[LineSchematic] = []
    parts: list[CablingPart] = []
    masters: list[CablingMaster] = []
    keypad_functions: list[KeypadFunction] = []
    groups: list[ParameterGroup] = []
    enumerations: list[Enumeration] = []
    parameters: list[Parameter]

    @property
    def status_codes(self) -> tuple[str, ...]:
        """Codes of the words that show the state in any chart."""
        return tuple(dict.fromkeys(code for chart in self.charts for code in chart.status_codes))
