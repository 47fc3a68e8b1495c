"""Monitored values of a drive, its faults, and its communication monitoring."""

from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, Identifier, RawWord, Table, When, WordAddress, about
from .chart import StatusBit
from .fault_help import FaultHelp


class MonitoringValue(Table, frozen=True, kw_only=True):
    """One value of the monitoring set."""

    parameter: str
    rate: Annotated[
        Literal["fast", "slow", "on-change"],
        about("Read in every cycle, in every tenth, or when the state has changed."),
    ] = "fast"
    low: Annotated[str, about("Lower end of the bar, in the value's unit.")] = ""
    high: Annotated[
        str,
        about(
            "Upper end of the bar, in the value's unit, or the code of a parameter "
            "that contains it."
        ),
    ] = ""


class SpeedFormula(Table, frozen=True, kw_only=True):
    """Speed in rpm from the raw output frequency and the motor's poles."""

    frequency: Annotated[str, about("Code of the output frequency.")]
    poles: Annotated[str, about("Code of the number of poles.")]
    result: Annotated[str, about("Code of the word that contains the result.")] = ""
    note: str = ""


class Monitoring(Table, frozen=True, kw_only=True):
    """Monitored values, in the order of a print-out."""

    values: Annotated[list[MonitoringValue], about("Monitored values in the order of a printout.")]
    speed_from: Annotated[SpeedFormula | None, about("Formula for the drive's speed.")] = None
    note: str = ""


class FaultCode(Table, frozen=True, kw_only=True):
    """A fault of the drive."""

    raw: Annotated[int, Meta(ge=0, le=0xFFFF)]
    code: Annotated[str, about("Code on the drive's display.")]
    name: str
    cause: Annotated[str, about("Cause of the fault.")] = ""
    remedy: str = ""


class AfterReset(Table, frozen=True, kw_only=True):
    """The effect of a fault reset for one command channel; the first row that holds is used."""

    by: Annotated[
        Literal["line", "others"] | None,
        about("The command channel; absent: any, even an unknown one."),
    ] = None
    when: Annotated[list[When], about("Conditions; all must hold.")] = []
    text: Annotated[
        str,
        about(
            "The effect in sentences, for the question, the Faults screen, `reset` and `status`."
        ),
    ]
    source: str = ""
    confidence: Confidence = "manual"


class InputBits(Table, frozen=True, kw_only=True):
    """The word that shows which inputs are closed at the terminals."""

    parameter: str
    mask: Annotated[WordAddress, about("Bits that are inputs.")] = 0xFFFF


class Faults(Table, frozen=True, kw_only=True):
    """Registers of faults, and the meaning of their codes."""

    parameter: Annotated[str, about("The parameter that contains the present or last fault.")] = ""
    shows_last: Annotated[
        bool, about("True if it keeps the last fault after the fault is cleared.")
    ] = False
    history: Annotated[
        list[str],
        about("Codes of past faults, latest first; the first may be `parameter`."),
    ] = []
    stored: Annotated[
        list[list[str]],
        about("Values that the drive stores for each fault of its history, in the same order."),
    ] = []
    stored_from: Annotated[
        list[str],
        about(
            "Live parameters that the stored values are taken from, in the order of "
            "each list of `stored`. Empty texts stand for values without one."
        ),
    ] = []
    held: Annotated[
        list[str],
        about("Parameters that keep their value at the trip while the drive is in fault."),
    ] = []
    codes: Annotated[list[FaultCode], about("Meaning of each raw fault code.")] = []
    help: Annotated[
        list[FaultHelp],
        about("Help on faults; a file of the folder `help` contains it if a family has many."),
    ] = []
    help_file: Annotated[
        Identifier | None,
        about("Name of that file, without .toml, if it is not the profile's id."),
    ] = None
    reset_ready: Annotated[StatusBit | None, about("The bit that shows that a reset can work.")] = (
        None
    )
    after_reset: Annotated[
        list[AfterReset],
        about("The effect of a reset, one sentence per command channel."),
    ] = []
    inputs: Annotated[
        InputBits | None,
        about("Inputs at the terminals; absent if Modbus does not show them."),
    ] = None
    none: Annotated[int, about("Raw value that means no fault.")] = 0
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"


class Reaction(Table, frozen=True, kw_only=True):
    """Reaction of the drive to loss of communication."""

    raw: RawWord
    code: Annotated[str, about("Code in the manual.")] = ""
    name: str
    does: Annotated[str, about("Reaction of the drive, in words.")]
    trips: Annotated[bool, about("True if the drive trips.")]
    motor_keeps_running: Annotated[bool, about("True if the motor keeps running.")] = False
    never_set: Annotated[
        bool,
        about(
            "True if it hides communication loss; Drive Panel never sets it, only the keypad can."
        ),
    ] = False


class CommunicationFault(Table, frozen=True, kw_only=True):
    """The drive's communication monitoring."""

    timeout: Annotated[str, about("Code of the timeout parameter.")]
    other_timeouts: Annotated[
        list[str],
        about("Timeouts of other ports of the drive; the port of this line is unknown."),
    ] = []
    off: Annotated[int | None, about("Raw timeout that switches monitoring off.")] = None
    reaction: Annotated[str, about("Code of the parameter that selects the reaction.")] = ""
    reactions: Annotated[list[Reaction], about("Reaction for each value.")] = []
    starts: Annotated[str, about("Start of monitoring, in words.")]
    starts_confidence: Annotated[
        Confidence, about("Certainty of that; `unverified` if no document states it.")
    ] = "manual"
    needs_write: Annotated[
        bool, about("True if it begins only after a command or reference was written.")
    ] = False
    begins_with: Annotated[
        RawWord | None,
        about(
            "A first command word that starts monitoring and moves nothing, if a command starts it."
        ),
    ] = None
    fault: Annotated[int | None, about("Raw code of the resulting fault.")] = None
    warnings: Annotated[list[str], about("Warnings on communication loss.")] = []
    note: str = ""
    source: str = ""
