"""A whole profile file, with its blocks, control sources, memory commands and first steps."""

from typing import Annotated, Literal

from msgspec import Meta

from .base import (
    Confidence,
    Effective,
    Identifier,
    RawWord,
    ReadCount,
    Table,
    When,
    WordAddress,
    about,
)
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

    step: Annotated[str, about("Short name of the step.")]
    text: Annotated[str, about("Decision or task for the technician at the machine.")]
    parameters: Annotated[
        list[str], about("Codes in the order in which they are set or checked.")
    ] = []
    action: Annotated[
        Literal["", "auto-tune", "save", "first-run", "take-control"],
        about("Action of the step besides setting values."),
    ] = ""
    stopped_only: Annotated[bool, about("True if the motor must be at standstill.")] = False
    note: str = ""
    source: str
    confidence: Annotated[
        Confidence | Literal["practice"],
        about(
            "Certainty that the step belongs here; `practice` is general practice, "
            "from no document."
        ),
    ]


class Predecessor(Table, frozen=True, kw_only=True):
    """A family that this one replaces, with the table of settings that mean the same in both.

    Values are carried over in engineering units and by name. Settings that it does not map are
    reported, and never written.
    """

    profile: Annotated[Identifier, about("Id of the profile of that family.")]
    same_codes: Annotated[bool, about("True if settings with the same code mean the same.")] = False
    codes: Annotated[dict[str, str], about("Codes of this family by code of the predecessor.")] = {}
    unlike: Annotated[
        dict[str, str],
        about("Reason by code of the predecessor, for settings that are not carried over."),
    ] = {}
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
    raw: Annotated[RawWord, about("The value, or the bits that are set while the others are kept.")]
    bit: Annotated[
        bool, about("True if `raw` contains bits and the word's other bits are kept.")
    ] = False
    does: Annotated[str, about("Exact effect, shown for confirmation.")]
    at_rest_mask: Annotated[
        RawWord, about("Bits of the extended status word that must be 0 beforehand.")
    ] = 0
    keeps_value: Annotated[
        bool,
        about("True if the word keeps the written value and does not show completion."),
    ] = False
    done: Annotated[
        When | None,
        about("Condition that shows completion, if the word itself does not."),
    ] = None
    groups: Annotated[
        str,
        about("A word that selects the groups of settings; nothing happens while it is 0."),
    ] = ""
    source: str = ""


class EnterWord(Table, frozen=True, kw_only=True):
    """A word that must follow a written setting, for the drive to use it."""

    parameter: str
    raw: RawWord
    when: Annotated[When | None, about("Condition under which it is needed; absent: always.")] = (
        None
    )
    source: str = ""


class Eeprom(Table, frozen=True, kw_only=True):
    """Endurance of a drive's EEPROM."""

    writes: Annotated[
        Annotated[int, Meta(ge=1)] | None,
        about("Number of writes that it lasts for; absent if no document states it."),
    ] = None
    also_saved_by: Annotated[
        list[When],
        about("Words besides `save` that store all settings when they get these values."),
    ] = []
    source: str = ""
    confidence: Confidence = "manual"


class MemoryOrders(Table, frozen=True, kw_only=True):
    """Commands to a drive's memory; unknown ones are omitted."""

    enter: Annotated[
        EnterWord | None, about("Written after each setting, before it is read back.")
    ] = None
    save: Annotated[MemoryOrder | None, about("Command that saves the settings.")] = None
    factory: Annotated[MemoryOrder | None, about("Command that restores the factory settings.")] = (
        None
    )
    eeprom: Annotated[Eeprom, about("Life of the EEPROM, and further words that save.")] = Eeprom()
    busy_mask: Annotated[
        RawWord,
        about("Bits of the extended status word that are 1 while the EEPROM is written."),
    ] = 0


class Setting(Table, frozen=True, kw_only=True):
    """A parameter and its required raw value."""

    parameter: str
    value: Annotated[RawWord, about("Required raw value.")]


class Way(Table, frozen=True, kw_only=True):
    """Source of the command or the reference, or the selection between two."""

    sources: Annotated[
        list[str],
        Meta(min_length=1, max_length=2),
        about("One source, or two: without the switch and with it."),
    ]
    switch: Annotated[str, about("Switch between two sources, in words.")] = ""


class ControlSource(Table, frozen=True, kw_only=True):
    """A configuration of command source and reference source."""

    id: Identifier
    name: str
    command: Annotated[Way, about("Source of the command.")]
    reference: Annotated[Way, about("Source of the reference.")]
    settings: Annotated[list[Setting], about("Settings that select it, in write order.")]
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
    direction: Annotated[
        Literal["read", "write"], about("Direction of the block: read or written.")
    ]
    address: Annotated[WordAddress, about("Wire address of the first word.")]
    min_words: Annotated[ReadCount, about("Minimum number of words per access.")] = 1
    max_words: Annotated[ReadCount, about("Maximum number of words per access.")]
    slots: Annotated[list[str], about("Parameters that select the content of each slot, in order.")]
    values: Annotated[
        list[str],
        about("Parameters that carry the values, if they are separate parameters."),
    ] = []
    selects_by: Annotated[
        Literal["choice", "address"],
        about("Content of a slot: a number from `choices`, or a wire address."),
    ]
    choices: Annotated[list[BlockChoice], about("Parameter for each number in a slot.")] = []
    fixed_start: Annotated[
        bool,
        about("True if a read must begin at `address`; otherwise any part can be read."),
    ] = False
    write_when: Annotated[
        Literal["any", "stopped"],
        about("When slots can be written: any time, or only with the motor stopped."),
    ] = "any"
    effective: Annotated[Effective, about("When a changed slot takes effect.")] = "at-once"
    note: str = ""
    source: str = ""


class ProfileData(Table, frozen=True, kw_only=True):
    """A whole profile file."""

    profile: Annotated[ProfileHead, about("Head of the file; must be the first table.")]
    sources: Annotated[list[Source], about("Documents from which the facts were taken.")] = []
    errata: Annotated[list[Erratum], about("Errors in the manuals.")] = []
    identification: Annotated[Identification, about("Recognition of the drive.")] = Identification()
    link: Annotated[LinkSettings, about("Factory line settings and their parameters.")]
    addresses: Annotated[Addresses, about("Slave addresses.")] = Addresses()
    functions: Annotated[list[Function], about("Modbus functions and their limits.")]
    port_counters: Annotated[
        list[PortCounters], about("Parameters that count frames, by port.")
    ] = []
    reading: Annotated[ReadShapes, about("Reads that the drive answers.")] = ReadShapes()
    blocks: Annotated[list[Block], about("Indirect blocks and communication scanners.")] = []
    exceptions: Annotated[list[ExceptionCode], about("Meaning of exception codes.")] = []
    frames: Annotated[list[ProfileFrame], about("Example frames that the drive answers.")] = []
    charts: Annotated[list[Chart], about("State charts and their commands.")] = []
    command_examples: Annotated[
        list[CommandExample], about("Complete command words and their effects.")
    ] = []
    references: Annotated[
        list[ReferenceWay], about("Ways to give the drive its frequency or speed.")
    ] = []
    teachable_references: Annotated[
        list[TeachableReference],
        about("Words that can take the reference once their scale is learned."),
    ] = []
    faults: Annotated[Faults, about("Fault registers and the meaning of faults.")] = Faults()
    monitoring: Annotated[Monitoring, about("Monitored values.")]
    channels: Annotated[
        Channels, about("Words that show the active command and reference channels.")
    ] = Channels()
    control_sources: Annotated[
        list[ControlSource], about("Configurations of command and reference source.")
    ] = []
    signal_paths: Annotated[
        list[SignalPath],
        about("Switches between the sources of command and reference and the motor."),
    ] = []
    communication_fault: Annotated[
        CommunicationFault | None, about("The drive's communication monitoring.")
    ] = None
    memory: Annotated[
        MemoryOrders, about("Words that save settings or restore factory settings.")
    ] = MemoryOrders()
    start_up: Annotated[
        list[StartUpStep], about("First commissioning in order, one table per step.")
    ] = []
    predecessors: Annotated[
        list[Predecessor],
        about("Families that this one replaces, and settings that mean the same."),
    ] = []
    connectors: Annotated[list[Connector], about("Connectors and their pins.")] = []
    line_rules: Annotated[list[LineRule], about("Rules for the wiring.")] = []
    wiring: Annotated[Wiring, about("Facts to know before touching the line or the drive.")] = (
        Wiring()
    )
    schematics: Annotated[
        list[LineSchematic], about("Schematics of the line, with their limits.")
    ] = []
    parts: Annotated[list[CablingPart], about("Parts for the line, by catalog number.")] = []
    masters: Annotated[list[CablingMaster], about("Cables from the master to the line.")] = []
    keypad_functions: Annotated[
        list[KeypadFunction],
        about("Functions of the keypad without an address on the line."),
    ] = []
    groups: Annotated[list[ParameterGroup], about("Content of groups that hold no settings.")] = []
    enumerations: Annotated[
        list[Enumeration], about("Names of raw values that several parameters share.")
    ] = []
    parameters: Annotated[
        list[Parameter], about("Parameters, one table each; must be last in the file.")
    ]

    @property
    def status_codes(self) -> tuple[str, ...]:
        """Codes of the words that show the state in any chart."""
        return tuple(dict.fromkeys(code for chart in self.charts for code in chart.status_codes))
