"""Monitored values of a drive, its faults, and its communication monitoring."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, Identifier, RawWord, Table, When, WordAddress
from .chart import StatusBit
from .fault_help import FaultHelp


class MonitoringValue(Table, frozen=True, kw_only=True):
    """One value of the monitoring set."""

    parameter: str
    rate: Literal["fast", "slow", "on-change"] = "fast"
    """Read in every cycle, in every tenth, or when the state has changed."""
    low: str = ""
    """Lower end of the bar, in the value's unit."""
    high: str = ""
    """Upper end of the bar, in the value's unit, or the code of a parameter that contains it."""


class SpeedFormula(Table, frozen=True, kw_only=True):
    """Speed in rpm from the raw output frequency and the motor's poles."""

    frequency: str
    poles: str
    result: str = ""
    note: str = ""


class Monitoring(Table, frozen=True, kw_only=True):
    """Monitored values, in the order of a print-out."""

    values: list[MonitoringValue]
    speed_from: SpeedFormula | None = None
    note: str = ""


class FaultCode(Table, frozen=True, kw_only=True):
    """A fault of the drive."""

    raw: Annotated[int, Meta(ge=0, le=0xFFFF)]
    code: str
    name: str
    cause: str = ""
    remedy: str = ""


class AfterReset(Table, frozen=True, kw_only=True):
    """The effect of a fault reset for one command channel; the first row that holds is used."""

    by: Literal["line", "others"] | None = None
    """The command channel; absent: any, even an unknown one."""
    when: list[When] = []
    """Conditions; all must hold."""
    text: str
    """The effect in sentences, for the question, the Faults screen, `reset` and `status`."""
    source: str = ""
    confidence: Confidence = "manual"


class InputBits(Table, frozen=True, kw_only=True):
    """The word that shows which inputs are closed at the terminals."""

    parameter: str
    mask: WordAddress = 0xFFFF
    """Bits that are inputs."""


class Faults(Table, frozen=True, kw_only=True):
    """Registers of faults, and the meaning of their codes."""

    parameter: str = ""
    """The parameter that contains the present or last fault."""
    shows_last: bool = False
    """True if it keeps the last fault after the fault is cleared."""
    history: list[str] = []
    stored: list[list[str]] = []
    """Values that the drive stores for each fault of its history, in the same order."""
    stored_from: list[str] = []
    """Live parameters that the stored values are taken from, in the order of each list of `stored`.
    Empty texts stand for values without one."""
    held: list[str] = []
    """Parameters that keep their value at the trip while the drive is in fault."""
    codes: list[FaultCode] = []
    help: list[FaultHelp] = []
    """Help on faults; a file of the folder `help` contains it if a family has many."""
    help_file: Identifier | None = None
    """Name of that file, without .toml, if it is not the profile's id."""
    reset_ready: StatusBit | None = None
    """The bit that shows that a reset can work."""
    after_reset: list[AfterReset] = []
    """The effect of a reset, one sentence per command channel."""
    inputs: InputBits | None = None
    """Inputs at the terminals; absent if Modbus does not show them."""
    none: int = 0
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"


class Reaction(Table, frozen=True, kw_only=True):
    """Reaction of the drive to loss of communication."""

    raw: RawWord
    code: str = ""
    name: str
    does: str
    trips: bool
    motor_keeps_running: bool = False
    never_set: bool = False
    """True if it hides communication loss; Drive Panel never sets it, only the keypad can."""


class CommunicationFault(Table, frozen=True, kw_only=True):
    """The drive's communication monitoring."""

    timeout: str
    other_timeouts: list[str] = []
    """Timeouts of other ports of the drive; the port of this line is unknown."""
    off: int | None = None
    """Raw timeout that switches monitoring off."""
    reaction: str = ""
    reactions: list[Reaction] = []
    starts: str
    """Start of monitoring, in words."""
    starts_confidence: Confidence = "manual"
    """Certainty of that; `unverified` if no document states it."""
    needs_write: bool = False
    """True if it begins only after a command or reference was written."""
    begins_with: RawWord | None = None
    """A first command word that starts monitoring and moves nothing, if a command starts it."""
    fault: int | None = None
    warnings: list[str] = []
    note: str = ""
    source: str = ""
