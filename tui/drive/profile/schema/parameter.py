"""One parameter: its address, decoding of its raw value, and write access."""

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
    Quantity,
    SignedDecimalText,
    Table,
    WordAddress,
    about,
)

WordType = Literal["uint16", "int16", "uint32", "int32", "float32", "ascii"]
Access = Literal["r", "rw", "rw-stopped", "w"]
ReadFunction = Literal[1, 2, 3, 4]
Storage = Literal["ram", "eeprom", "ram-until-saved", "unknown"]


class Enumeration(Table, frozen=True, kw_only=True):
    """Named raw values shared by several parameters; keys are raw values in decimal."""

    id: Identifier
    values: Annotated[dict[str, str], about("Names by raw value, in decimal.")]


class WordState(Table, frozen=True, kw_only=True):
    """The values of some bits of a word."""

    mask: LongWord
    value: Annotated[LongWord, about("The value of those bits.")]


class Bit(Table, frozen=True, kw_only=True):
    """One named bit of a word."""

    bit: LongBitNumber
    name: str
    off: Annotated[str, about("Meaning of 0.")] = ""
    on: Annotated[str, about("Meaning of 1.")] = ""
    alarm: Annotated[bool, about("True if a set bit is an alarm.")] = False
    counts: Annotated[
        WordState | None,
        about("Required values of other bits of the word for this bit to be valid."),
    ] = None
    note: str = ""


class ScaleBy(Table, frozen=True, kw_only=True):
    """A scale that depends on another parameter's raw value (ramps on Inr)."""

    parameter: str
    scales: Annotated[
        dict[str, DecimalText],
        about("Scales by the other parameter's raw value, in decimal."),
    ]
    absent: Annotated[
        DecimalText | None,
        about("Scale if the drive reports that it has no such parameter; absent: unknown."),
    ] = None


class FullScale(Table, frozen=True, kw_only=True):
    """So many counts are the value of another parameter, in its unit (16384 at 3-03)."""

    counts: Annotated[
        int,
        Meta(ge=1, le=0x7FFFFFFF),
        about("Raw value that means the value of the other parameter."),
    ]
    parameter: Annotated[
        str,
        about("The parameter that contains the full scale, such as a limit or the nameplate."),
    ]


class FactoryBy(Table, frozen=True, kw_only=True):
    """A factory setting that depends on another parameter's raw value (HSP on bFr)."""

    parameter: str
    raws: Annotated[
        dict[str, int],
        about("Factory settings by the other parameter's raw value, in decimal."),
    ]


class Multiple(Table, frozen=True, kw_only=True):
    """A multiple of another parameter, in the unit of this one, truncated to a whole count.

    For example, limits and factory settings that depend on the drive's rated current.
    """

    parameter: str
    times: Annotated[
        SignedDecimalText, about("Factor for that parameter, a decimal in quotes.")
    ] = "1"
    raws: Annotated[
        dict[str, int],
        about(
            "Instead of a multiple: this one's raw value by that of the other, such as "
            "the model's code. A value that is not listed sets no limit."
        ),
    ] = {}
    plus: Annotated[
        SignedDecimalText,
        about("Added to the product, in the same unit: `100 - tA1` is times -1, plus 100."),
    ] = "0"


class Grounds(Table, frozen=True, kw_only=True):
    """Source of a fact that differs from the source of its row."""

    source: Annotated[str, about("The id of a source and the place in it.")]
    confidence: Confidence


class UnitBy(Table, frozen=True, kw_only=True):
    """A unit given by bits of another parameter (counters of energy and time)."""

    parameter: str
    shift: Annotated[int, Meta(ge=0, le=15)]
    mask: Annotated[int, Meta(ge=1, le=0xFFFF), about("Mask applied after the shift.")]
    units: Annotated[dict[str, str], about("Units by the value of those bits, in decimal.")]


class ParameterGroup(Table, frozen=True, kw_only=True):
    """Kind of a group's parameters if they are not settings."""

    name: Annotated[str, about("Name as in `group` of the parameters.")]
    holds: Annotated[
        Literal["settings", "commands", "measurements"],
        about("Content of the group: settings, commands or measurements."),
    ] = "settings"
    address: Annotated[
        str,
        about("Rule for the wire address of its parameters without one: `256 * menu + item`."),
    ] = ""
    eeprom_address: Annotated[
        str,
        about("Rule for the EEPROM address of its settings without one: `16#5000 + number`."),
    ] = ""
    needs_factory: Annotated[
        str,
        about(
            "A word that shows the fitted option. The group is valid only while that "
            "word has its factory value, and is not written otherwise."
        ),
    ] = ""


class Parameter(Table, frozen=True, kw_only=True):
    """One word (or pair of words) of a drive."""

    code: str
    name: Annotated[str, about("Short name without a unit.")]
    number: Annotated[str, about("Address as the manual writes it: W9001, 16#FD00, 1.05.")]
    address: Annotated[
        WordAddress,
        about("Wire address, as in a frame, or a rule for it: 10 * number - 1."),
    ]
    eeprom_address: Annotated[
        WordAddress | None,
        about(
            "Address of its copy in EEPROM; `address` is then the one in RAM. Both "
            "hold whole words."
        ),
    ] = None
    function: Annotated[
        ReadFunction,
        about(
            "The function that reads it: 3; 4 for an input register, 1 for coils, 2 "
            "for discrete inputs. Inputs are never written."
        ),
    ] = 3
    type: Annotated[WordType, about("Number of words, and signed or unsigned.")] = "uint16"
    words: Annotated[
        int,
        Meta(ge=1, le=32),
        about(
            "Registers of a text (`ascii`), two characters each; a text is only read. "
            "Of coils or discrete inputs, how many form the word: the first one is bit "
            "0."
        ),
    ] = 1
    low_byte_first: Annotated[
        bool,
        about("True if the first character of each register of a text is its low byte."),
    ] = False
    low_word_first: Annotated[
        bool, about("Word order of a 32-bit value; absent: as in `reading`.")
    ] = True
    mask: Annotated[
        int,
        Meta(ge=1, le=0xFFFF),
        about(
            "Bits of the word that belong to this parameter, after the shift; a write "
            "keeps the others."
        ),
    ] = 0xFFFF
    shift: Annotated[BitNumber, about("Bits by which the word is first shifted right.")] = 0
    sure_up_to: Annotated[
        int | None,
        about("Highest raw value with a certain meaning; higher ones are marked `?`."),
    ] = None
    unit: Annotated[str, about("Unit.")] = ""
    scale: Annotated[SignedDecimalText, about("Value of one count, a decimal in quotes.")] = "1"
    offset: Annotated[
        SignedDecimalText,
        about(
            "Value at a raw value of 0, in the unit: -40 for a temperature that counts from there."
        ),
    ] = "0"
    scale_by: Annotated[ScaleBy | None, about("Scale that depends on another parameter.")] = None
    full_scale: Annotated[
        FullScale | None,
        about("Full scale from another parameter of the same unit; instead of `scale`."),
    ] = None
    unit_by: Annotated[UnitBy | None, about("Unit that depends on another parameter.")] = None
    base: Annotated[str, about("Base of a percentage, if known.")] = ""
    rating: Annotated[
        str,
        about("Parameter that gives 100 % in a physical unit, if the value is a percentage."),
    ] = ""
    min: Annotated[int | None, about("Lowest raw value.")] = None
    max: Annotated[int | None, about("Highest raw value.")] = None
    min_from: Annotated[str, about("Parameter that gives a lower limit.")] = ""
    max_from: Annotated[str, about("Parameters that limit this one further.")] = ""
    min_of: Annotated[
        Multiple | None, about("Lowest value as a multiple of another parameter.")
    ] = None
    max_of: Annotated[
        Multiple | None,
        about("Limits as a multiple of another parameter (0.2 times the drive's rated current)."),
    ] = None
    limit_grounds: Annotated[
        Grounds | None, about("Source of the limits if it differs from the row's.")
    ] = None
    factory: Annotated[int | None, about("Raw value of the factory setting.")] = None
    factory_text: Annotated[
        str,
        about("Factory setting in words, if it depends on the rating or the market."),
    ] = ""
    factory_by: Annotated[
        FactoryBy | None,
        about(
            "Factory setting that depends on another parameter; `factory` applies to "
            "the factory state."
        ),
    ] = None
    factory_of: Annotated[
        Multiple | None, about("Factory setting as a multiple of another parameter.")
    ] = None
    factory_grounds: Annotated[
        Grounds | None,
        about("Source of the factory setting if it differs from the row's."),
    ] = None
    set_by_drive: Annotated[
        bool,
        about("True if the drive changes it (auto-tuning); never reported as changed by a user."),
    ] = False
    enumeration: Annotated[
        str, about("Id of the enumeration with the names of its raw values.")
    ] = ""
    values: Annotated[
        dict[str, str],
        about("Names of raw values; for a number, of special values only."),
    ] = {}
    bits: Annotated[list[Bit], about("Bits of a bit word.")] = []
    reserved: Annotated[list[LongBitNumber], about("Bits that must never be written as 1.")] = []
    access: Annotated[
        Access,
        about("Access: r, rw, rw-stopped (written only with the motor stopped) or w."),
    ]
    storage: Annotated[Storage, about("Memory in which the drive stores it.")] = "unknown"
    effective: Annotated[Effective, about("When a written value takes effect.")] = "at-once"
    group: Annotated[str, about("Menu in which it is shown.")]
    holds: Annotated[
        Literal["command"] | None,
        about("`command` for a command, whatever its group contains."),
    ] = None
    resets_others: Annotated[
        int,
        Meta(ge=0, le=9),
        about(
            "Above 0 if writing it changes other settings: 1 is written before 2, both "
            "before others."
        ),
    ] = 0
    rated: Annotated[
        bool,
        about("True if its value belongs to one rating of drive and motor, or to one model."),
    ] = False
    quantity: Annotated[
        Quantity | None,
        about("Meaning of the parameter across families; at most one parameter per quantity."),
    ] = None
    forbidden: Annotated[str, about("Reason why Drive Panel never writes it, if it must not.")] = ""
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
