"""The form of a profile file: plain data, checked strictly while it is decoded.

Every struct is one table of the TOML file. Raw values are words as the line carries them,
scales are decimal strings so that no float ever stands between a word and its value.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct

WordAddress = Annotated[int, Meta(ge=0, le=0xFFFF)]
RawWord = Annotated[int, Meta(ge=-0x8000, le=0xFFFF)]
DeviceAddress = Annotated[int, Meta(ge=0, le=255)]
DecimalText = Annotated[str, Meta(pattern=r"^[0-9]+(\.[0-9]+)?$")]
Identifier = Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_-]*$")]
BitNumber = Annotated[int, Meta(ge=0, le=15)]

Confidence = Literal["manual", "manual+public", "public-x2", "public", "analogy", "unverified"]
"""How surely a fact is known, best first; below `public` it is shown as unverified."""

WordType = Literal["uint16", "int16", "uint32", "int32"]
Access = Literal["r", "rw", "rw-stopped", "w"]
Storage = Literal["ram", "eeprom", "ram-until-saved", "unknown"]
Effective = Literal["at-once", "after-reset"]
PastLimit = Literal["exception", "silence"]
StateKind = Literal[
    "starting", "blocked", "ready", "stopped", "running", "stopping", "fault", "unknown"
]


class Table(Struct, frozen=True, forbid_unknown_fields=True):
    """One table of a profile: frozen, and an unknown key in it is an error."""


class Source(Table, frozen=True, kw_only=True):
    """A document that facts were taken from."""

    id: Identifier
    title: str
    note: str = ""


class Erratum(Table, frozen=True, kw_only=True):
    """A place where a manual is wrong or contradicts itself, and what this profile follows."""

    place: str
    printed: str
    right: str
    why: str = ""


class Head(Table, frozen=True, kw_only=True):
    """The first table of a profile, all that a listing reads."""

    id: Identifier
    name: str
    vendor: str
    version: str
    summary: str = ""


class IdentificationObject(Table, frozen=True, kw_only=True):
    """One object of the answer to function 43/14."""

    id: Annotated[int, Meta(ge=0, le=255)]
    meaning: Literal["vendor", "reference", "version", "name"]
    example: str = ""
    """What a simulated drive answers."""


class Model(Table, frozen=True, kw_only=True):
    """A model known by a code word of the drive, with its rating."""

    code: int
    reference: str = ""
    voltage: str = ""
    power_kw: str = ""
    variant: str = ""
    class_b: bool = False


class Identification(Table, frozen=True, kw_only=True):
    """How a drive of this family is recognised."""

    reference_prefixes: list[str] = []
    """Beginnings of object 1 (reference) that belong to this family."""
    objects: list[IdentificationObject] = []
    conformity: int = 1
    highest_read_device_id: Annotated[int, Meta(ge=1, le=4)] = 1
    exception_has_mei_byte: bool = False
    """True where a refused function 43 is answered with the MEI byte before the code."""
    model_parameter: str = ""
    class_parameter: str = ""
    class_bit: BitNumber | None = None
    models: list[Model] = []
    note: str = ""
    source: str = ""


class LinkChoice(Table, frozen=True, kw_only=True):
    """One raw value of a link setting and what it means on the line."""

    raw: RawWord
    text: str
    baud: int | None = None
    format: Annotated[str, Meta(pattern=r"^8[NEO][12]$")] | None = None
    parity: Literal["N", "E", "O"] | None = None
    note: str = ""


class LinkSetting(Table, frozen=True, kw_only=True):
    """A parameter of the drive that sets its side of the line."""

    parameter: str
    role: Literal["address", "baud", "format", "parity", "protocol", "timeout", "delay"]
    factory: RawWord | None = None
    choices: list[LinkChoice] = []
    note: str = ""


class Link(Table, frozen=True, kw_only=True):
    """Line settings of the drive as it leaves the factory, and the parameters behind them."""

    baud: int
    format: Annotated[str, Meta(pattern=r"^8[NEO][12]$")]
    formats: list[str] = []
    bauds: list[int] = []
    end_of_frame_characters: DecimalText = "3.5"
    turnaround_ms: DecimalText = "5"
    """Turnaround a simulated drive shows, in ms."""
    settings: list[LinkSetting] = []
    note: str = ""
    source: str = ""


class Addresses(Table, frozen=True, kw_only=True):
    """Slave addresses a drive of this family takes."""

    first: DeviceAddress = 1
    last: DeviceAddress = 247
    factory: DeviceAddress = 1
    broadcast: DeviceAddress | None = 0
    zero_digit_is_group: bool = False
    """True where an address with a zero digit (10, 20, 105) calls a group of drives."""
    off: int | None = None
    """Raw address at which the drive's server is switched off."""
    servers: list[Server] = []
    note: str = ""
    source: str = ""


class Server(Table, frozen=True, kw_only=True):
    """A further Modbus server in the same drive, at an address of its own."""

    parameter: str
    name: str
    note: str = ""


class Function(Table, frozen=True, kw_only=True):
    """A Modbus function the drive supports, and its limits."""

    code: Annotated[int, Meta(ge=1, le=127)]
    name: str
    max_read: Annotated[int, Meta(ge=1, le=125)] | None = None
    max_write: Annotated[int, Meta(ge=1, le=123)] | None = None
    broadcast: bool = False
    past_limit: PastLimit = "exception"
    past_limit_exception: int = 3
    subfunctions: list[int] = []
    note: str = ""
    source: str = ""


class Reading(Table, frozen=True, kw_only=True):
    """Which shapes of a read the drive answers."""

    single_words_only: bool = False
    """True where only one word, or a block declared below, can be read."""
    unknown_word: WordAddress | None = None
    """Word that stands for an unknown or protected parameter inside a longer read."""
    unknown_exception: int | None = 2
    """Exception for a read of unknown words only; absent where the manual names none."""
    gaps_readable: bool = False
    """True where a read may run over addresses that carry no parameter."""
    note: str = ""
    source: str = ""


class BlockChoice(Table, frozen=True, kw_only=True):
    """A raw selector value of an indirect block and the parameter it stands for."""

    raw: RawWord
    parameter: str


class Block(Table, frozen=True, kw_only=True):
    """An indirect block or a table of the communication scanner."""

    id: Identifier
    name: str
    direction: Literal["read", "write"]
    address: WordAddress
    min_words: int = 1
    max_words: int
    slots: list[str]
    """Parameters that select what stands in each place, in order."""
    values: list[str] = []
    """Parameters that carry the values, where they are parameters of their own."""
    selects_by: Literal["choice", "address"]
    choices: list[BlockChoice] = []
    fixed_start: bool = False
    """True where a read must begin at `address`; else any part of it may be read."""
    write_when: Literal["any", "stopped"] = "any"
    effective: Effective = "at-once"
    note: str = ""
    source: str = ""


class ExceptionCode(Table, frozen=True, kw_only=True):
    """What an exception code means on this family."""

    code: Annotated[int, Meta(ge=1, le=255)]
    name: str
    meaning: str
    remedy: str = ""


class Enumeration(Table, frozen=True, kw_only=True):
    """Named raw values shared by several parameters; keys are raw values in decimal."""

    id: Identifier
    values: dict[str, str]


class Bit(Table, frozen=True, kw_only=True):
    """One named bit of a word."""

    bit: BitNumber
    name: str
    off: str = ""
    on: str = ""
    alarm: bool = False
    """True where a set bit is an alarm."""
    note: str = ""


class ScaleBy(Table, frozen=True, kw_only=True):
    """A scale that follows another parameter's raw value (ramps after Inr)."""

    parameter: str
    scales: dict[str, DecimalText]
    absent: DecimalText | None = None
    """Scale where the drive says that it has no such parameter; without it the scale is unknown."""


class UnitBy(Table, frozen=True, kw_only=True):
    """A unit told by some bits of another parameter (counters of energy and time)."""

    parameter: str
    shift: Annotated[int, Meta(ge=0, le=15)]
    mask: Annotated[int, Meta(ge=1, le=0xFFFF)]
    """Mask of the value after it was shifted down."""
    units: dict[str, str]


class Parameter(Table, frozen=True, kw_only=True):
    """One word (or pair of words) of a drive."""

    code: str
    name: str
    number: str
    """Address as the manual writes it: W9001, 16#FD00, 1.05."""
    address: WordAddress
    type: WordType = "uint16"
    low_word_first: bool = True
    """Order of the two words of a 32-bit value."""
    unit: str = ""
    scale: DecimalText = "1"
    scale_by: ScaleBy | None = None
    unit_by: UnitBy | None = None
    base: str = ""
    """What a percentage is a percentage of, as far as it is known."""
    rating: str = ""
    """Parameter that carries 100 % in a physical unit, where the value is a percentage."""
    min: int | None = None
    max: int | None = None
    min_from: str = ""
    max_from: str = ""
    """Parameters that limit this one further (LSP..HSP)."""
    factory: int | None = None
    factory_text: str = ""
    """Factory setting in words where it depends on the rating or the market."""
    enumeration: str = ""
    values: dict[str, str] = {}
    """Names of raw values; of special ones where the parameter is a number."""
    bits: list[Bit] = []
    reserved: list[BitNumber] = []
    """Bits that must never be written as 1."""
    access: Access
    storage: Storage = "unknown"
    effective: Effective = "at-once"
    group: str
    quantity: Quantity | None = None
    """What the parameter means across families; at most one parameter a quantity."""
    forbidden: str = ""
    """Why the panel never writes it, where it must not."""
    note: str = ""
    source: str
    confidence: Confidence


Quantity = Literal[
    "command_word",
    "command_word_2",
    "extended_command_word",
    "status_word",
    "status_word_2",
    "status_word_3",
    "extended_status_word",
    "alarm_word",
    "life_alarm_word",
    "output_frequency",
    "frequency_reference",
    "ramp_output",
    "speed",
    "speed_reference",
    "motor_current",
    "motor_voltage",
    "mains_voltage",
    "dc_bus",
    "torque",
    "power",
    "input_power",
    "drive_thermal",
    "motor_thermal",
    "motor_load",
    "drive_load",
    "energy",
    "run_hours",
    "power_on_hours",
    "fault",
    "fault_history_1",
    "fault_history_2",
    "fault_history_3",
    "fault_history_4",
    "fault_history_5",
    "fault_history_6",
    "fault_history_7",
    "fault_history_8",
    "digital_inputs",
    "digital_outputs",
    "analogue_input_1",
    "analogue_input_2",
    "command_channel",
    "reference_channel",
    "command_frequency",
    "command_speed",
    "acceleration",
    "deceleration",
    "acceleration_2",
    "deceleration_2",
    "ramp_increment",
    "high_speed",
    "low_speed",
    "max_frequency",
    "rated_frequency",
    "rated_voltage",
    "rated_current",
    "rated_speed",
    "motor_poles",
    "drive_current",
    "thermal_current",
    "switching_frequency",
    "access_level",
    "control_profile",
    "save_settings",
    "line_address",
    "line_baud",
    "line_format",
    "line_timeout",
    "line_fault_reaction",
    "preset_speed_1",
    "preset_speed_2",
    "preset_speed_3",
    "preset_speed_4",
    "preset_speed_5",
    "preset_speed_6",
    "preset_speed_7",
    "stop_type",
    "drive_reference",
    "software_version",
]
"""What a parameter means across families: the same name, the same thing."""


class State(Table, frozen=True, kw_only=True):
    """A state of the drive, recognised in a status word; the first that fits counts."""

    id: Identifier
    name: str
    kind: StateKind
    mask: WordAddress
    value: WordAddress


class Transition(Table, frozen=True, kw_only=True):
    """A command that takes the drive from one state to another."""

    number: str = ""
    source: Identifier
    target: Identifier
    command: RawWord | None = None
    """Command word that makes it; absent where the drive goes by itself."""
    edge_bit: BitNumber | None = None
    name: str = ""


class When(Table, frozen=True, kw_only=True):
    """A condition on another parameter's raw value."""

    parameter: str
    values: list[int]


class DirectionBit(Table, frozen=True, kw_only=True):
    """A status bit that tells the direction of rotation."""

    parameter: str
    bit: BitNumber
    reverse: Literal[0, 1] = 1


class StatusBit(Table, frozen=True, kw_only=True):
    """A status bit with a meaning of its own and the value at which it holds."""

    parameter: str
    bit: BitNumber
    value: Literal[0, 1] = 1


class ChannelBits(Table, frozen=True, kw_only=True):
    """Some bits of a word that tell who commands the drive."""

    parameter: str
    shift: Annotated[int, Meta(ge=0, le=15)]
    mask: Annotated[int, Meta(ge=1, le=0xFFFF)]
    """Mask of the value after it was shifted down."""
    names: dict[str, str]


OrderId = Literal[
    "forward",
    "reverse",
    "stop",
    "quick-stop",
    "freewheel",
    "emergency-stop",
    "dc-braking",
    "reset",
    "take-control",
    "hand-back",
]


class Order(Table, frozen=True, kw_only=True):
    """What a person may order of a drive, as the words that are written one after another.

    Of several orders with one id the first counts whose states and conditions hold.
    """

    id: OrderId
    name: str
    words: list[RawWord]
    parameter: str = ""
    """Where the words go; the chart's command word where empty."""
    states: list[Identifier] = []
    """States in which it may be given; any where empty."""
    when: list[When] = []
    """Raw values that must be known and hold."""
    broadcast: bool = False
    """True where its word can start no motor on any drive that hears it."""
    note: str = ""
    confidence: Confidence = "manual"


class Interlock(Table, frozen=True, kw_only=True):
    """What must hold before an order that can move the motor is sent."""

    parameter: str
    mask: WordAddress = 0xFFFF
    values: list[int]
    """Raw values, behind the mask, with which it may be given."""
    orders: list[OrderId] = []
    """Orders that it holds for; those that run or brake where empty."""
    when: list[When] = []
    """Raw values with which it counts at all."""
    text: str
    """What is wrong otherwise, as a sentence."""
    remedy: str = ""


class OptionChoice(Table, frozen=True, kw_only=True):
    """One setting of an option: the bits behind its mask, and their name."""

    bits: WordAddress
    name: str


class CommandOption(Table, frozen=True, kw_only=True):
    """Bits of a command word that stay as they are from order to order."""

    id: Identifier
    name: str
    parameter: str
    mask: WordAddress
    choices: list[OptionChoice]
    stopped_only: bool = False
    note: str = ""
    confidence: Confidence = "manual"


class Chart(Table, frozen=True, kw_only=True):
    """A state chart: how the status word tells the state, and how commands change it."""

    id: Identifier
    name: str
    kind: Literal["drivecom", "io", "altivar21", "leroy-somer"]
    when: When | None = None
    """Where it applies; absent: always, or where no other does."""
    status: str
    command: str = ""
    states: list[State]
    transitions: list[Transition] = []
    orders: list[Order] = []
    interlocks: list[Interlock] = []
    options: list[CommandOption] = []
    direction: DirectionBit | None = None
    reached: StatusBit | None = None
    alarm: StatusBit | None = None
    local: StatusBit | None = None
    channel: ChannelBits | None = None
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"


class CommandExample(Table, frozen=True, kw_only=True):
    """A whole command word with what it does, for the person who reads words."""

    word: WordAddress
    does: str
    note: str = ""
    confidence: Confidence = "manual"


class Reference(Table, frozen=True, kw_only=True):
    """A way to give the drive its frequency or speed."""

    parameter: str
    kind: Literal["frequency", "speed"]
    signed: bool = False
    feedback: str = ""
    note: str = ""


class FaultCode(Table, frozen=True, kw_only=True):
    """A fault of the drive."""

    raw: Annotated[int, Meta(ge=0, le=0xFFFF)]
    code: str
    name: str
    cause: str = ""
    remedy: str = ""


class Faults(Table, frozen=True, kw_only=True):
    """Where faults are read and what their codes mean."""

    parameter: str = ""
    """The parameter that holds the present or last fault."""
    shows_last: bool = False
    """True where it keeps the last fault after the fault is gone."""
    history: list[str] = []
    stored: list[list[str]] = []
    """What the drive keeps of the moment of each fault of its history, in the same order."""
    codes: list[FaultCode] = []
    none: int = 0
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"


class MonitoringValue(Table, frozen=True, kw_only=True):
    """One value of the monitoring set."""

    parameter: str
    rate: Literal["fast", "slow", "on-change"] = "fast"
    """When it is read: in every cycle, in every tenth, or when the state has changed."""
    low: str = ""
    """Lower end of its bar, in its unit."""
    high: str = ""
    """Upper end of its bar, in its unit, or the code of a parameter that holds it."""


class SpeedFormula(Table, frozen=True, kw_only=True):
    """Speed in rpm from the raw output frequency and the motor's poles."""

    frequency: str
    poles: str
    result: str = ""
    note: str = ""


class Monitoring(Table, frozen=True, kw_only=True):
    """What is watched: the values, in the order of a print-out."""

    values: list[MonitoringValue]
    speed_from: SpeedFormula | None = None
    note: str = ""


class Reaction(Table, frozen=True, kw_only=True):
    """What the drive does when the line has gone silent."""

    raw: RawWord
    code: str = ""
    name: str
    does: str
    trips: bool
    motor_keeps_running: bool = False
    never_set: bool = False
    """True where it makes a lost line go unnoticed: it is set at the keypad, or not at all."""


class CommunicationFault(Table, frozen=True, kw_only=True):
    """The drive's watch over the line."""

    timeout: str
    off: int | None = None
    """Raw time-out at which the watch is off."""
    reaction: str = ""
    reactions: list[Reaction] = []
    starts: str
    """When the watch begins, in words."""
    needs_write: bool = False
    """True where it begins only after a command or reference was written."""
    fault: int | None = None
    warnings: list[str] = []
    note: str = ""
    source: str = ""


class Setting(Table, frozen=True, kw_only=True):
    """A parameter and the raw value that it is to hold."""

    parameter: str
    value: RawWord


class Way(Table, frozen=True, kw_only=True):
    """Where the command or the reference comes from, and what chooses between two sources."""

    sources: Annotated[list[str], Meta(min_length=1, max_length=2)]
    """One source, or two: that without the switch and that with it."""
    switch: str = ""


class ControlSource(Table, frozen=True, kw_only=True):
    """A configuration of who commands the drive and who gives its reference."""

    id: Identifier
    name: str
    command: Way
    reference: Way
    settings: list[Setting]
    """What makes it, in the order in which it is written."""
    note: str = ""
    source: str = ""


class Pin(Table, frozen=True, kw_only=True):
    """One pin of a connector."""

    pin: str
    signal: str
    note: str = ""


class Connector(Table, frozen=True, kw_only=True):
    """A connector of the drive and its pins."""

    name: str
    pins: list[Pin]
    warnings: list[str] = []
    source: str = ""


class LineRule(Table, frozen=True, kw_only=True):
    """A rule for the wiring of the line."""

    subject: str
    rule: str
    source: str = ""


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
    connectors: list[Connector] = []
    line_rules: list[LineRule] = []
    enumerations: list[Enumeration] = []
    parameters: list[Parameter]
