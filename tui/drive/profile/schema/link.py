"""The drive on the line: link settings, slave addresses, functions, exceptions and wiring."""

from __future__ import annotations

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
)

PastLimit = Literal["exception", "silence"]


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


class LinkSettings(Table, frozen=True, kw_only=True):
    """Factory line settings of the drive, and their parameters."""

    baud: int
    format: Annotated[str, Meta(pattern=r"^8[NEO][12]$")]
    formats: list[str] = []
    bauds: list[int] = []
    end_of_frame_characters: DecimalText = "3.5"
    turnaround_ms: DecimalText = "5"
    """Turnaround a simulated drive shows, in ms."""
    settings: list[LinkSetting] = []
    at_factory: str = ""
    """Why a new drive does not answer, and what to set on its keypad; sentences."""
    note: str = ""
    source: str = ""


class ProfileFrame(Table, frozen=True, kw_only=True):
    """A request and its reply as bytes, with checksums, and the values that they contain."""

    sent: str
    """Bytes in hexadecimal, such as `01 03 21 02 00 02 6F F7`."""
    answered: str
    """Bytes of the reply in hexadecimal."""
    means: list[str]
    """Values that were read or written, as they are shown: `2103H = 50.00 Hz`."""
    source: str
    """The id of a source and the place in it."""


class FurtherServer(Table, frozen=True, kw_only=True):
    """A further Modbus server in the same drive, with its own address."""

    parameter: str
    name: str
    note: str = ""


class Addresses(Table, frozen=True, kw_only=True):
    """Slave addresses that a drive of this family accepts."""

    first: DeviceAddress = 1
    last: DeviceAddress = 247
    factory: DeviceAddress = 1
    broadcast: DeviceAddress | None = 0
    zero_digit_is_group: bool = False
    """True if an address with a zero digit (10, 20, 105) calls a group of drives."""
    off: int | None = None
    """Raw address that switches the drive's server off."""
    servers: list[FurtherServer] = []
    note: str = ""
    source: str = ""


class Function(Table, frozen=True, kw_only=True):
    """A Modbus function the drive supports, and its limits."""

    code: Annotated[int, Meta(ge=1, le=127)]
    name: str
    max_read: ReadCount | None = None
    max_write: WriteCount | None = None
    broadcast: bool = False
    past_limit: PastLimit = "exception"
    past_limit_exception: ExceptionByte = 3
    subfunctions: list[WordAddress] = []
    note: str = ""
    source: str = ""


class PortCounters(Table, frozen=True, kw_only=True):
    """Frame counters of the drive at one of its ports, in its own parameters."""

    name: str
    frames: str
    """Parameter that counts frames to the drive's address, good and damaged, modulo 65536."""
    checksum_errors: str
    """Parameter that counts frames with a wrong checksum; stays at 65535."""
    source: str = ""


class ReadShapes(Table, frozen=True, kw_only=True):
    """Forms of a read that the drive answers."""

    single_words_only: bool = False
    """True if only one word, or a declared block, can be read."""
    unknown_word: WordAddress | None = None
    """Word that stands for an unknown or protected parameter in a longer read."""
    unknown_exception: ExceptionByte | None = 2
    """Exception for a read of unknown words only; absent if the manual names none."""
    low_word_first: bool = True
    """Word order of 32-bit values, unless a parameter overrides it."""
    gaps_readable: bool = False
    """True if a read can span addresses without a parameter."""
    note: str = ""
    source: str = ""


class ExceptionCode(Table, frozen=True, kw_only=True):
    """Meaning of an exception code in this family."""

    code: ExceptionByte
    name: str
    meaning: str
    remedy: str = ""


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
