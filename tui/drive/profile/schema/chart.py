"""The state chart of a drive: its states and the commands allowed in them."""

from __future__ import annotations

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
)

StateKind = Literal[
    "starting", "blocked", "ready", "stopped", "running", "stopping", "fault", "unknown"
]


class State(Table, frozen=True, kw_only=True):
    """State of the drive, derived from a status word; the first match applies."""

    id: Identifier
    name: str
    kind: StateKind
    mask: LongWord
    value: LongWord
    also: list[When] = []
    """Further words that must fit; the state is unknown until they are read."""


class Transition(Table, frozen=True, kw_only=True):
    """A command that takes the drive from one state to another."""

    number: str = ""
    source: Identifier
    target: Identifier
    command: CommandBits | None = None
    """Command word that triggers it; absent if the drive does so on its own."""
    edge_bit: LongBitNumber | None = None
    name: str = ""


class DirectionBit(Table, frozen=True, kw_only=True):
    """A status bit that shows the direction of rotation."""

    parameter: str
    bit: LongBitNumber
    reverse: Literal[0, 1] = 1


class StatusBit(Table, frozen=True, kw_only=True):
    """Status bit with its own meaning, and the value for which it applies."""

    parameter: str
    bit: LongBitNumber
    value: Literal[0, 1] = 1


class ChannelBits(Table, frozen=True, kw_only=True):
    """Bits of a word that show the command channel."""

    parameter: str
    shift: Annotated[int, Meta(ge=0, le=15)]
    mask: Annotated[int, Meta(ge=1, le=0xFFFF)]
    """Mask applied after the shift."""
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


class OrderWait(Table, frozen=True, kw_only=True):
    """A wait after a word of a command, before its next word."""

    states: list[Identifier] = []
    """States of which one must be reached; empty: only the time passes."""
    ms: Annotated[int, Meta(ge=0, le=5000)] | None = None
    """Milliseconds to wait, with `states` at most (default: 2000)."""

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

    id: OrderId
    name: str
    words: list[CommandBits]
    waits: list[OrderWait] = []
    """Waits between the words: the first one after the first word."""
    parameter: str = ""
    """Register of the words; empty: the chart's command word."""
    states: list[Identifier] = []
    """States in which it is allowed; empty: any."""
    when: list[When] = []
    """Conditions that must be known and hold."""
    broadcast: bool = False
    """True if its word cannot start a motor on any drive that receives it."""
    clears: list[str] = []
    """Words that it resets to their initial values."""
    follows: str = ""
    """Further consequences, shown before it is sent; sentences."""
    note: str = ""
    confidence: Confidence = "manual"


class Interlock(Table, frozen=True, kw_only=True):
    """Condition of a command that can move the motor."""

    parameter: str
    mask: LongWord = 0xFFFF
    values: list[int]
    """Masked raw values with which the command is allowed."""
    orders: list[OrderId] = []
    """Commands that it applies to; empty: those that run or brake."""
    when: list[When] = []
    """Conditions for the interlock."""
    text: str
    """Problem if it is not met, as a sentence."""
    remedy: str = ""


class OptionChoice(Table, frozen=True, kw_only=True):
    """One setting of an option: the masked bits and their name."""

    bits: LongWord
    name: str


class CommandOption(Table, frozen=True, kw_only=True):
    """Bits of a command word that are kept between commands."""

    id: Identifier
    name: str
    parameter: str
    mask: LongWord
    choices: list[OptionChoice]
    stopped_only: bool = False
    note: str = ""
    confidence: Confidence = "manual"


class Chart(Table, frozen=True, kw_only=True):
    """A state chart: how the status word shows the state, and how commands change it."""

    id: Identifier
    name: str
    kind: Identifier = "plain"
    """Behavior of a simulated drive beyond its states and commands."""
    runs_in: Identifier | None = None
    """The running state that a start reaches through the transitions, one command at a time;
    absent: the words of a command are written unchanged."""
    when: When | None = None
    """Condition for the chart; absent: always, or if no other applies."""
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

    @property
    def status_codes(self) -> tuple[str, ...]:
        """Codes of the words that show the state: the status word first."""
        further = (when.parameter for state in self.states for when in state.also)
        return tuple(dict.fromkeys((self.status, *further)))


class CommandExample(Table, frozen=True, kw_only=True):
    """A complete command word and its effect, for readers of raw words."""

    word: LongWord
    does: str
    note: str = ""
    confidence: Confidence = "manual"


class ScaleWhen(When, frozen=True, kw_only=True):
    """A condition on another word; if it is not met, references have another scale."""

    otherwise: str
    """Problem if the condition is not met, and the remedy, as sentences."""


class ReferenceWay(Table, frozen=True, kw_only=True):
    """A way to give the drive its frequency or speed."""

    parameter: str
    kind: Literal["frequency", "speed"]
    signed: bool = False
    reverse: Literal["command", "negative"] = "command"
    """Selection of the reverse direction: by the command, or by a negative reference."""
    feedback: str = ""
    scale_when: ScaleWhen | None = None
    """Condition for the scale of this profile."""
    note: str = ""


class TeachableReference(Table, frozen=True, kw_only=True):
    """A word of unknown scale that takes the reference once its scale is learned and confirmed."""

    parameter: str
    bits: WordAddress = 0
    """Bits of the chart's command word that select it; set with each run command."""
    most: str = ""
    """Parameter that contains the highest reference, once learned in the same unit."""
    note: str = ""
    source: str = ""
    confidence: Confidence = "unverified"
