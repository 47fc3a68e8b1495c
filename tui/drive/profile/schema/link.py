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


class FurtherServer(Table, frozen=True, kw_only=True):
    """A further Modbus server in the same drive, at an address of its own."""

    parameter: str
    name: str
    note: str = ""


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
    """Frames to the drive's address, right and damaged ones, modulo 65536."""
    checksum_errors: str
    """Those with a wrong checksum; stays at 65535."""
    source: str = ""


class ReadShapes(Table, frozen=True, kw_only=True):
    """Which shapes of a read the drive answers."""

    single_words_only: bool = False
    """True where only one word, or a block declared below, can be read."""
    unknown_word: WordAddress | None = None
    """Word that stands for an unknown or protected parameter inside a longer read."""
    unknown_exception: ExceptionByte | None = 2
    """Exception for a read of unknown words only; absent where the manual names none."""
    low_word_first: bool = True
    """Order of the two words of 32-bit values, where a parameter does not say otherwise."""
    gaps_readable: bool = False
    """True where a read may run over addresses that carry no parameter."""
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
