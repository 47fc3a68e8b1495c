"""One parameter: its address, decoding of its raw value, and write access."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from tui.wire.frames import BIT_READS, wire_place

from .base import (
    BitNumber,
    Confidence,
    DecimalText,
    Effective,
    Identifier,
    LongBitNumber,
    LongWord,
    SignedDecimalText,
    Table,
    WordAddress,
)

WordType = Literal["uint16", "int16", "uint32", "int32", "float32", "ascii"]
Access = Literal["r", "rw", "rw-stopped", "w"]
ReadFunction = Literal[1, 2, 3, 4]
Storage = Literal["ram", "eeprom", "ram-until-saved", "unknown"]


class Enumeration(Table, frozen=True, kw_only=True):
    """Named raw values shared by several parameters; keys are raw values in decimal."""

    id: Identifier
    values: dict[str, str]


class WordState(Table, frozen=True, kw_only=True):
    """The values of some bits of a word."""

    mask: LongWord
    value: LongWord
    """The value of those bits."""


class Bit(Table, frozen=True, kw_only=True):
    """One named bit of a word."""

    bit: LongBitNumber
    name: str
    off: str = ""
    on: str = ""
    alarm: bool = False
    """True if a set bit is an alarm."""
    counts: WordState | None = None
    """Required values of other bits of the word for this bit to be valid."""
    note: str = ""


class ScaleBy(Table, frozen=True, kw_only=True):
    """A scale that depends on another parameter's raw value (ramps on Inr)."""

    parameter: str
    scales: dict[str, DecimalText]
    absent: DecimalText | None = None
    """Scale if the drive reports that it has no such parameter; absent: unknown."""


class FullScale(Table, frozen=True, kw_only=True):
    """So many counts are the value of another parameter, in its unit (16384 at 3-03)."""

    counts: Annotated[int, Meta(ge=1, le=0x7FFFFFFF)]
    """Raw value that means the value of the other parameter."""
    parameter: str
    """The parameter that contains the full scale, such as a limit or the nameplate."""


class FactoryBy(Table, frozen=True, kw_only=True):
    """A factory setting that depends on another parameter's raw value (HSP on bFr)."""

    parameter: str
    raws: dict[str, int]


class Multiple(Table, frozen=True, kw_only=True):
    """A multiple of another parameter, in the unit of this one, truncated to a whole count.

    For example, limits and factory settings that depend on the drive's rated current.
    """

    parameter: str
    times: SignedDecimalText = "1"
    raws: dict[str, int] = {}
    """Instead of a multiple: this one's raw value by that of the other, such as the model's code.
    A value that is not listed sets no limit."""
    plus: SignedDecimalText = "0"
    """Added to the product, in the same unit: `100 - tA1` is times -1, plus 100."""


class Grounds(Table, frozen=True, kw_only=True):
    """Source of a fact that differs from the source of its row."""

    source: str
    """The id of a source and the place in it."""
    confidence: Confidence


class UnitBy(Table, frozen=True, kw_only=True):
    """A unit given by bits of another parameter (counters of energy and time)."""

    parameter: str
    shift: Annotated[int, Meta(ge=0, le=15)]
    mask: Annotated[int, Meta(ge=1, le=0xFFFF)]
    """Mask applied after the shift."""
    units: dict[str, str]


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
"""Meaning of a parameter across families."""


class ParameterGroup(Table, frozen=True, kw_only=True):
    """Kind of a group's parameters if they are not settings."""

    name: str
    """Name as in `group` of the parameters."""
    holds: Literal["settings", "commands", "measurements"] = "settings"
    address: str = ""
    """Rule for the wire address of its parameters without one: `256 * menu + item`."""
    eeprom_address: str = ""
    """Rule for the EEPROM address of its settings without one: `16#5000 + number`."""
    needs_factory: str = ""
    """A word that shows the fitted option. The group is valid only while that word has its factory
    value, and is not written otherwise."""


class Parameter(Table, frozen=True, kw_only=True):
    """One word (or pair of words) of a drive."""

    code: str
    name: str
    number: str
    """Address as the manual writes it: W9001, 16#FD00, 1.05."""
    address: WordAddress
    eeprom_address: WordAddress | None = None
    """Address of its copy in EEPROM; `address` is then the one in RAM. Both hold whole words."""
    function: ReadFunction = 3
    """The function that reads it: 3; 4 for an input register, 1 for coils, 2 for discrete inputs.
    Inputs are never written."""
    type: WordType = "uint16"
    words: Annotated[int, Meta(ge=1, le=32)] = 1
    """Registers of a text (`ascii`), two characters each; a text is only read. Of coils or
    discrete inputs, how many form the word: the first one is bit 0."""
    low_byte_first: bool = False
    """True if the first character of each register of a text is its low byte."""
    low_word_first: bool = True
    """Word order of a 32-bit value; absent: as in `reading`."""
    mask: Annotated[int, Meta(ge=1, le=0xFFFF)] = 0xFFFF
    """Bits of the word that belong to this parameter, after the shift; a write keeps the others."""
    shift: BitNumber = 0
    """Bits by which the word is first shifted right."""
    sure_up_to: int | None = None
    """Highest raw value with a certain meaning; higher ones are marked `?`."""
    unit: str = ""
    scale: SignedDecimalText = "1"
    offset: SignedDecimalText = "0"
    """Value at a raw value of 0, in the unit: -40 for a temperature that counts from there."""
    scale_by: ScaleBy | None = None
    full_scale: FullScale | None = None
    """Full scale from another parameter of the same unit; instead of `scale`."""
    unit_by: UnitBy | None = None
    base: str = ""
    """Base of a percentage, if known."""
    rating: str = ""
    """Parameter that gives 100 % in a physical unit, if the value is a percentage."""
    min: int | None = None
    max: int | None = None
    min_from: str = ""
    max_from: str = ""
    """Parameters that limit this one further (LSP..HSP)."""
    min_of: Multiple | None = None
    max_of: Multiple | None = None
    """Limits as a multiple of another parameter (0.2 times the drive's rated current)."""
    limit_grounds: Grounds | None = None
    """Source of the limits if it differs from the row's."""
    factory: int | None = None
    factory_text: str = ""
    """Factory setting in words, if it depends on the rating or the market."""
    factory_by: FactoryBy | None = None
    """Factory setting that depends on another parameter; `factory` applies to the factory state."""
    factory_of: Multiple | None = None
    factory_grounds: Grounds | None = None
    """Source of the factory setting if it differs from the row's."""
    set_by_drive: bool = False
    """True if the drive changes it (auto-tuning); never reported as changed by a user."""
    enumeration: str = ""
    values: dict[str, str] = {}
    """Names of raw values; for a number, of special values only."""
    bits: list[Bit] = []
    reserved: list[LongBitNumber] = []
    """Bits that must never be written as 1."""
    access: Access
    storage: Storage = "unknown"
    effective: Effective = "at-once"
    group: str
    holds: Literal["command"] | None = None
    """`command` for a command, whatever its group contains."""
    resets_others: Annotated[int, Meta(ge=0, le=9)] = 0
    """Above 0 if writing it changes other settings: 1 is written before 2, both before others."""
    rated: bool = False
    """True if its value belongs to one rating of drive and motor, or to one model."""
    quantity: Quantity | None = None
    """Meaning of the parameter across families; at most one parameter per quantity."""
    forbidden: str = ""
    """Reason why Drive Panel never writes it, if it must not."""
    note: str = ""
    source: str
    confidence: Confidence

    @property
    def is_register(self) -> bool:
        """True if it is in holding registers, which function 3 reads."""
        return self.function == 3

    @property
    def is_bits(self) -> bool:
        """True if it consists of coils or discrete inputs."""
        return self.function in BIT_READS

    @property
    def place(self) -> int:
        """Its address as one number in all address spaces; that of a register is unchanged."""
        return wire_place(self.function, self.address)

    @property
    def scale_source(self) -> str:
        """Code of the parameter on which the scale depends; empty if the scale is fixed."""
        if self.full_scale is not None:
            return self.full_scale.parameter
        return self.scale_by.parameter if self.scale_by is not None else ""
