"""The state chart of a drive: its states and the commands allowed in them."""

from typing import Annotated, Literal

from msgspec import Meta

from tui.safety import STEP_TIME

from .base import (
    CommandBits,
    Confidence,
    Identifier,
    LongBitNumber,
    LongWord,
    Table,
    When,
    WordAddress,
    about,
)

StateKind = Literal[
    "starting", "blocked", "ready", "stopped", "running", "stopping", "fault", "unknown"
]


class State(Table, frozen=True, kw_only=True):
    """State of the drive, derived from a status word; the first match applies."""

    id: Identifier
    name: str
    kind: Annotated[StateKind, about("Meaning of the state, in the same terms for every family.")]
    mask: LongWord
    value: Annotated[LongWord, about("Masked word while the drive is in this state.")]
    also: Annotated[
        list[When],
        about("Further words that must fit; the state is unknown until they are read."),
    ] = []


class Transition(Table, frozen=True, kw_only=True):
    """A command that takes the drive from one state to another."""

    number: Annotated[str, about("Number in the manual.")] = ""
    source: Annotated[Identifier, about("State before the transition.")]
    target: Annotated[Identifier, about("State after the transition.")]
    command: Annotated[
        CommandBits | None,
        about("Command word that triggers it; absent if the drive does so on its own."),
    ] = None
    edge_bit: Annotated[
        LongBitNumber | None,
        about("Bit whose rising edge triggers it; absent if the whole word does."),
    ] = None
    name: Annotated[str, about("Name of the command or event in the manual.")] = ""


class DirectionBit(Table, frozen=True, kw_only=True):
    """A status bit that shows the direction of rotation."""

    parameter: str
    bit: LongBitNumber
    reverse: Annotated[
        Literal[0, 1], about("Value of the bit while the motor runs in reverse.")
    ] = 1


class StatusBit(Table, frozen=True, kw_only=True):
    """Status bit with its own meaning, and the value for which it applies."""

    parameter: str
    bit: LongBitNumber
    value: Annotated[Literal[0, 1], about("Value of the bit for which the meaning applies.")] = 1


class ChannelBits(Table, frozen=True, kw_only=True):
    """Bits of a word that show the command channel."""

    parameter: str
    shift: Annotated[int, Meta(ge=0, le=15)]
    mask: Annotated[int, Meta(ge=1, le=0xFFFF), about("Mask applied after the shift.")]
    names: Annotated[
        dict[str, str], about("Command channels by the value of those bits, in decimal.")
    ]


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


class OrderWait(Table, frozen=True, kw_only=True):
    """A wait after a word of a command, before its next word."""

    states: Annotated[
        list[Identifier],
        about("States of which one must be reached; empty: only the time passes."),
    ] = []
    ms: Annotated[
        Annotated[int, Meta(ge=0, le=5000)] | None,
        about("Milliseconds to wait, with `states` at most (default: 2000)."),
    ] = None

    @property
    def seconds(self) -> float:
        """The wait in seconds; the longest one if it is for a state."""
        if self.ms is None:
            return STEP_TIME if self.states else 0.0
        return self.ms / 1000


class Order(Table, frozen=True, kw_only=True):
    """Command to a drive, as words that are written in sequence.

    Of several with the same id, the first whose states and conditions hold is used.
    """

    id: Annotated[OrderId, about("Command that the words carry out.")]
    name: str
    words: Annotated[list[CommandBits], about("Words written in sequence.")]
    waits: Annotated[
        list[OrderWait],
        about("Waits between the words: the first one after the first word."),
    ] = []
    parameter: Annotated[str, about("Register of the words; empty: the chart's command word.")] = ""
    states: Annotated[list[Identifier], about("States in which it is allowed; empty: any.")] = []
    when: Annotated[list[When], about("Conditions that must be known and hold.")] = []
    broadcast: Annotated[
        bool,
        about("True if its word cannot start a motor on any drive that receives it."),
    ] = False
    clears: Annotated[list[str], about("Words that it resets to their initial values.")] = []
    follows: Annotated[str, about("Further consequences, shown before it is sent; sentences.")] = ""
    note: str = ""
    confidence: Confidence = "manual"


class Interlock(Table, frozen=True, kw_only=True):
    """Condition of a command that can move the motor."""

    parameter: str
    mask: LongWord = 0xFFFF
    values: Annotated[list[int], about("Masked raw values with which the command is allowed.")]
    orders: Annotated[
        list[OrderId],
        about("Commands that it applies to; empty: those that run or brake."),
    ] = []
    when: Annotated[list[When], about("Conditions for the interlock.")] = []
    text: Annotated[str, about("Problem if it is not met, as a sentence.")]
    remedy: Annotated[str, about("Remedy, as a sentence.")] = ""


class OptionChoice(Table, frozen=True, kw_only=True):
    """One setting of an option: the masked bits and their name."""

    bits: Annotated[LongWord, about("Masked bits of the option.")]
    name: str


class CommandOption(Table, frozen=True, kw_only=True):
    """Bits of a command word that are kept between commands."""

    id: Identifier
    name: str
    parameter: str
    mask: LongWord
    choices: Annotated[list[OptionChoice], about("Settings of the option.")]
    stopped_only: Annotated[
        bool, about("True if it can be changed only with the motor stopped.")
    ] = False
    note: str = ""
    confidence: Confidence = "manual"


class Chart(Table, frozen=True, kw_only=True):
    """A state chart: how the status word shows the state, and how commands change it."""

    id: Identifier
    name: str
    kind: Annotated[
        Identifier,
        about("Behavior of a simulated drive beyond its states and commands."),
    ] = "plain"
    runs_in: Annotated[
        Identifier | None,
        about(
            "The running state that a start reaches through the transitions, one "
            "command at a time; absent: the words of a command are written unchanged."
        ),
    ] = None
    when: Annotated[
        When | None,
        about("Condition for the chart; absent: always, or if no other applies."),
    ] = None
    status: Annotated[str, about("Code of the status word.")]
    command: Annotated[
        str, about("Code of the command word; empty if the drive cannot be commanded.")
    ] = ""
    states: Annotated[list[State], about("States in order of evaluation; the first match applies.")]
    transitions: Annotated[
        list[Transition], about("Commands and events that lead from state to state.")
    ] = []
    orders: Annotated[list[Order], about("Commands available to the user, as words.")] = []
    interlocks: Annotated[
        list[Interlock], about("Conditions for a command that can move the motor.")
    ] = []
    options: Annotated[
        list[CommandOption],
        about("Bits of a command word that are kept between commands."),
    ] = []
    direction: Annotated[
        DirectionBit | None, about("Bit that shows the direction of rotation.")
    ] = None
    reached: Annotated[
        StatusBit | None, about("Bit that shows that the reference has been reached.")
    ] = None
    alarm: Annotated[StatusBit | None, about("Bit that shows an alarm.")] = None
    local: Annotated[
        StatusBit | None, about("Bit that shows that the drive is under local control.")
    ] = None
    channel: Annotated[ChannelBits | None, about("Bits that show the command channel.")] = None
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"

    @property
    def status_codes(self) -> tuple[str, ...]:
        """Codes of the words that show the state: the status word first."""
        further = (when.parameter for state in self.states for when in state.also)
        return tuple(dict.fromkeys((self.status, *further)))


class CommandExample(Table, frozen=True, kw_only=True):
    """A complete command word and its effect, for readers of raw words."""

    word: Annotated[LongWord, about("Complete command word.")]
    does: Annotated[str, about("Effect of the word.")]
    note: str = ""
    confidence: Confidence = "manual"


class ScaleWhen(When, frozen=True, kw_only=True):
    """A condition on another word; if it is not met, references have another scale."""

    otherwise: Annotated[
        str, about("Problem if the condition is not met, and the remedy, as sentences.")
    ]


class ReferenceWay(Table, frozen=True, kw_only=True):
    """A way to give the drive its frequency or speed."""

    parameter: str
    kind: Annotated[Literal["frequency", "speed"], about("Type of reference: frequency or speed.")]
    signed: Annotated[bool, about("True if a negative reference runs the motor in reverse.")] = (
        False
    )
    reverse: Annotated[
        Literal["command", "negative"],
        about("Selection of the reverse direction: by the command, or by a negative reference."),
    ] = "command"
    feedback: Annotated[
        str, about("Code of the word that shows the reference accepted by the drive.")
    ] = ""
    scale_when: Annotated[ScaleWhen | None, about("Condition for the scale of this profile.")] = (
        None
    )
    note: str = ""


class TeachableReference(Table, frozen=True, kw_only=True):
    """A word of unknown scale that takes the reference once its scale is learned and confirmed."""

    parameter: str
    bits: Annotated[
        WordAddress,
        about("Bits of the chart's command word that select it; set with each run command."),
    ] = 0
    most: Annotated[
        str,
        about("Parameter that contains the highest reference, once learned in the same unit."),
    ] = ""
    note: str = ""
    source: str = ""
    confidence: Confidence = "unverified"
