"""The drive on the line: link settings, slave addresses, functions, exceptions and wiring."""

from typing import Annotated, Literal

from msgspec import Meta

from .base import (
    DecimalText,
    DeviceAddress,
    ExceptionByte,
    RawWord,
    ReadCount,
    Table,
    WordAddress,
    WriteCount,
    about,
)

PastLimit = Literal["exception", "silence"]


class LinkChoice(Table, frozen=True, kw_only=True):
    """One raw value of a link setting and what it means on the line."""

    raw: RawWord
    text: Annotated[str, about("Text for display.")]
    baud: Annotated[int | None, about("Baud rate in bit/s.")] = None
    format: Annotated[
        Annotated[str, Meta(pattern=r"^8[NEO][12]$")] | None,
        about("Data bits, parity and stop bits."),
    ] = None
    parity: Annotated[Literal["N", "E", "O"] | None, about("Parity.")] = None
    note: str = ""


class LinkSetting(Table, frozen=True, kw_only=True):
    """A parameter of the drive that sets its side of the line."""

    parameter: str
    role: Annotated[
        Literal["address", "baud", "format", "parity", "protocol", "timeout", "delay"],
        about("Line property set by the parameter."),
    ]
    factory: Annotated[RawWord | None, about("Raw value of the factory setting.")] = None
    choices: Annotated[list[LinkChoice], about("Raw values and their meaning on the line.")] = []
    note: str = ""


class LinkSettings(Table, frozen=True, kw_only=True):
    """Factory line settings of the drive, and their parameters."""

    baud: Annotated[int, about("Factory baud rate in bit/s; used if a LINE gives none.")]
    format: Annotated[
        str,
        Meta(pattern=r"^8[NEO][12]$"),
        about("Factory data bits, parity and stop bits; used if a LINE gives none."),
    ]
    formats: Annotated[list[str], about("Formats that the drive supports.")] = []
    bauds: Annotated[list[int], about("Baud rates that the drive supports.")] = []
    end_of_frame_characters: Annotated[
        DecimalText, about("Inter-frame gap that ends a frame, in characters.")
    ] = "3.5"
    turnaround_ms: Annotated[DecimalText, about("Turnaround a simulated drive shows, in ms.")] = "5"
    settings: Annotated[
        list[LinkSetting], about("Parameters of the drive that set its line settings.")
    ] = []
    at_factory: Annotated[
        str,
        about("Why a new drive does not answer, and what to set on its keypad; sentences."),
    ] = ""
    note: str = ""
    source: str = ""


class ProfileFrame(Table, frozen=True, kw_only=True):
    """A request and its reply as bytes, with checksums, and the values that they contain."""

    sent: Annotated[str, about("Bytes in hexadecimal, such as `01 03 21 02 00 02 6F F7`.")]
    answered: Annotated[str, about("Bytes of the reply in hexadecimal.")]
    means: Annotated[
        list[str],
        about("Values that were read or written, as they are shown: `2103H = 50.00 Hz`."),
    ]
    source: Annotated[str, about("The id of a source and the place in it.")]


class FurtherServer(Table, frozen=True, kw_only=True):
    """A further Modbus server in the same drive, with its own address."""

    parameter: str
    name: str
    note: str = ""


class Addresses(Table, frozen=True, kw_only=True):
    """Slave addresses that a drive of this family accepts."""

    first: Annotated[DeviceAddress, about("Lowest slave address.")] = 1
    last: Annotated[DeviceAddress, about("Highest slave address.")] = 247
    factory: Annotated[DeviceAddress, about("Factory slave address.")] = 1
    broadcast: Annotated[
        DeviceAddress | None, about("Broadcast address, received by every drive.")
    ] = 0
    zero_digit_is_group: Annotated[
        bool,
        about("True if an address with a zero digit (10, 20, 105) calls a group of drives."),
    ] = False
    off: Annotated[int | None, about("Raw address that switches the drive's server off.")] = None
    servers: Annotated[list[FurtherServer], about("Further Modbus servers in the same drive.")] = []
    note: str = ""
    source: str = ""


class Function(Table, frozen=True, kw_only=True):
    """A Modbus function the drive supports, and its limits."""

    code: Annotated[int, Meta(ge=1, le=127), about("Modbus function code.")]
    name: str
    max_read: Annotated[ReadCount | None, about("Maximum number of words per read.")] = None
    max_write: Annotated[WriteCount | None, about("Maximum number of words per write.")] = None
    broadcast: Annotated[bool, about("True if the drive accepts it as a broadcast.")] = False
    past_limit: Annotated[
        PastLimit, about("Reaction of the drive to a request above its limit.")
    ] = "exception"
    past_limit_exception: Annotated[
        ExceptionByte, about("Exception code returned for such a request.")
    ] = 3
    subfunctions: Annotated[
        list[WordAddress], about("Sub-functions of function 8 that the drive supports.")
    ] = []
    note: str = ""
    source: str = ""


class PortCounters(Table, frozen=True, kw_only=True):
    """Frame counters of the drive at one of its ports, in its own parameters."""

    name: Annotated[str, about("Name of the port for display.")]
    frames: Annotated[
        str,
        about(
            "Parameter that counts frames to the drive's address, good and damaged, modulo 65536."
        ),
    ]
    checksum_errors: Annotated[
        str, about("Parameter that counts frames with a wrong checksum; stays at 65535.")
    ]
    source: str = ""


class ReadShapes(Table, frozen=True, kw_only=True):
    """Forms of a read that the drive answers."""

    single_words_only: Annotated[
        bool, about("True if only one word, or a declared block, can be read.")
    ] = False
    unknown_word: Annotated[
        WordAddress | None,
        about("Word that stands for an unknown or protected parameter in a longer read."),
    ] = None
    unknown_exception: Annotated[
        ExceptionByte | None,
        about("Exception for a read of unknown words only; absent if the manual names none."),
    ] = 2
    low_word_first: Annotated[
        bool, about("Word order of 32-bit values, unless a parameter overrides it.")
    ] = True
    gaps_readable: Annotated[
        bool, about("True if a read can span addresses without a parameter.")
    ] = False
    note: str = ""
    source: str = ""


class ExceptionCode(Table, frozen=True, kw_only=True):
    """Meaning of an exception code in this family."""

    code: Annotated[ExceptionByte, about("Exception code.")]
    name: str
    meaning: Annotated[str, about("Meaning in this family.")]
    remedy: str = ""


class Pin(Table, frozen=True, kw_only=True):
    """One pin of a connector."""

    pin: Annotated[str, about("Pin number.")]
    signal: Annotated[str, about("Signal of the pin.")]
    note: str = ""


class Connector(Table, frozen=True, kw_only=True):
    """A connector of the drive and its pins."""

    name: str
    pins: Annotated[list[Pin], about("Pins of the connector.")]
    warnings: Annotated[list[str], about("Warnings for the connector.")] = []
    source: str = ""


class LineRule(Table, frozen=True, kw_only=True):
    """A rule for the wiring of the line."""

    subject: Annotated[str, about("Subject of the rule.")]
    rule: Annotated[str, about("The rule, as a sentence.")]
    source: str = ""
