"""The state chart of a drive: its states, and what may be ordered in them."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .base import BitNumber, Confidence, Identifier, RawWord, Table, When, WordAddress

StateKind = Literal[
    "starting", "blocked", "ready", "stopped", "running", "stopping", "fault", "unknown"
]


class State(Table, frozen=True, kw_only=True):
    """A state of the drive, recognized in a status word; the first that fits counts."""

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
    """Command word that makes it; absent if the drive does so on its own."""
    edge_bit: BitNumber | None = None
    name: str = ""


class DirectionBit(Table, frozen=True, kw_only=True):
    """A status bit that shows the direction of rotation."""

    parameter: str
    bit: BitNumber
    reverse: Literal[0, 1] = 1


class StatusBit(Table, frozen=True, kw_only=True):
    """A status bit with a meaning of its own and the value at which it holds."""

    parameter: str
    bit: BitNumber
    value: Literal[0, 1] = 1


class ChannelBits(Table, frozen=True, kw_only=True):
    """Some bits of a word that show who commands the drive."""

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
    """Command to a drive, as words that are written one after another.

    Of several orders with one id the first counts whose states and conditions hold.
    """

    id: OrderId
    name: str
    words: list[RawWord]
    parameter: str = ""
    """Register of the words; the chart's command word if empty."""
    states: list[Identifier] = []
    """States in which it may be given; any where empty."""
    when: list[When] = []
    """Raw values that must be known and hold."""
    broadcast: bool = False
    """True where its word can start no motor on any drive that hears it."""
    clears: list[str] = []
    """Words that go back to their initial values by it."""
    follows: str = ""
    """Further consequences, shown before it is given; sentences."""
    note: str = ""
    confidence: Confidence = "manual"


class Interlock(Table, frozen=True, kw_only=True):
    """Condition of a command that can move the motor."""

    parameter: str
    mask: WordAddress = 0xFFFF
    values: list[int]
    """Raw values, behind the mask, with which it may be given."""
    orders: list[OrderId] = []
    """Orders that it holds for; those that run or brake where empty."""
    when: list[When] = []
    """Raw values with which it counts at all."""
    text: str
    """Problem otherwise, as a sentence."""
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
    """A state chart: how the status word shows the state, and how commands change it."""

    id: Identifier
    name: str
    kind: Identifier = "plain"
    """Behavior of a simulated drive beyond its states and commands."""
    runs_in: Identifier | None = None
    """The running state to which a start leads through the transitions, a command at a time;
    without it the words of a command are written unchanged."""
    when: When | None = None
    """Condition; absent: always, or if no other applies."""
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


class ScaleWhen(When, frozen=True, kw_only=True):
    """A condition on another word, without which references count in another scale."""

    otherwise: str
    """Problem if the condition is not met, and the remedy, as sentences."""


class ReferenceWay(Table, frozen=True, kw_only=True):
    """A way to give the drive its frequency or speed."""

    parameter: str
    kind: Literal["frequency", "speed"]
    signed: bool = False
    feedback: str = ""
    scale_when: ScaleWhen | None = None
    """With which raw value of another word it has the scale of this profile."""
    note: str = ""


class TeachableReference(Table, frozen=True, kw_only=True):
    """A word of unknown scale that takes the reference once that scale was taught and confirmed."""

    parameter: str
    bits: WordAddress = 0
    """Bits of the chart's command word that choose it; set with each command to run."""
    most: str = ""
    """Parameter that holds the highest reference, once it was taught in the same unit."""
    note: str = ""
    source: str = ""
    confidence: Confidence = "unverified"
