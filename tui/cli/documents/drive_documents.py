"""Documents about a drive: identity, state, commands, evidence, and why it does not answer."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import UNSET, Meta, UnsetType

from tui.bus.api import Contact

from .document import Document, DocumentPart, DriveDocument, TimeoutField
from .parts import (
    AlarmField,
    ControlField,
    CountingTestField,
    DifferenceField,
    DriveCountersField,
    EepromField,
    FaultField,
    FirstWordField,
    HeardField,
    LastMinutesField,
    LeftBehindDocument,
    LoadField,
    ModelField,
    OldTimeoutField,
    OurCountersField,
    StateField,
    StatusWordField,
    ValueField,
    WatchedValueField,
)


class FindingField(DocumentPart):
    """Result for one statement of a profile, as in the file of evidence."""

    subject: Literal["identity", "address", "range", "value", "frame", "command", "reference"]
    name: str
    statement: str
    result: Literal["confirmed", "contradicted", "open"]
    seen: str


class ConfirmDocument(Document, kw_only=True):
    """`profiles confirm`: what a drive shows about its profile."""

    command: Literal["profiles"] = "profiles"
    profile: str
    file: str
    tested_on: Literal["drive", "simulated", "unknown"]
    reference: str
    firmware: str
    confirmed: int
    contradicted: int
    open: int
    findings: list[FindingField]


PrintedRunEvent = Literal[
    "control", "reference", "order", "state", "ended", "stopping", "stopped", "left-running"
]
HoldEvent = Literal["holding", "lost", "back", "fault"]
Certainty = Literal["identified", "likely", "unknown"]


class ReadDocument(DriveDocument, kw_only=True):
    """`read`: values by code."""

    command: Literal["read"] = "read"
    values: dict[str, ValueField]


class CycleTime(DocumentPart):
    """Seconds from one cycle of a drive to the next."""

    seconds: Annotated[float, Meta(description="As they were.")]
    wished: Annotated[float, Meta(description="As `--every` asks for them.")]


class CycleDocument(Document, kw_only=True):
    """`watch`: one cycle."""

    command: Literal["watch"] = "watch"
    time: str
    line: str
    device: int
    profile: str | None
    timeout: TimeoutField | UnsetType | None = UNSET
    values: dict[str, WatchedValueField]
    state: str | None
    direction: str | None
    error: str | None
    contact: Contact
    cycle: CycleTime


class IdentityDocument(DriveDocument, kw_only=True):
    """`identify`: the drive's identity."""

    command: Literal["identify"] = "identify"
    vendor: str
    reference: str
    version: str
    name: str
    model: ModelField | None
    candidates: Annotated[list[str], Meta(description="Profiles that fit the drive.")]


class StatusDocument(DriveDocument, kw_only=True):
    """`status`: a drive's state, and its commander."""

    command: Literal["status"] = "status"
    state: StateField
    direction: str | None
    fault: FaultField | None
    alarms: list[str]
    alarm: AlarmField | None
    commanded_by: str | None
    reference_from: str | None
    switched_by: list[str]
    commandable: bool
    why_not: str | None
    control: ControlField | None
    watch: OldTimeoutField | None
    left_behind: LeftBehindDocument | None
    words: dict[str, StatusWordField | None]
    values: dict[str, ValueField | None]
    unread: list[str]
    eeprom: EepromField | None


class RunDocument(Document, kw_only=True):
    """`run`: one event."""

    command: Literal["run"] = "run"
    time: str
    device: int
    event: PrintedRunEvent
    text: str
    timeout: TimeoutField | UnsetType | None = UNSET
    state: str | UnsetType | None = UNSET
    direction: str | UnsetType | None = UNSET
    fault: str | UnsetType | None = UNSET
    values: dict[str, ValueField | None] | UnsetType = UNSET
    error: str | UnsetType | None = UNSET


class HoldDocument(Document, kw_only=True):
    """`hold`: one event."""

    command: Literal["hold"] = "hold"
    time: str
    line: str
    device: int
    event: HoldEvent
    text: str
    timeout: TimeoutField | UnsetType | None = UNSET


class WatchingFamilyField(DocumentPart):
    """A family that reacts when polling stops after the first request."""

    profile: str
    name: str
    timeout: Annotated[str, Meta(description="The parameter that sets its timeout.")]
    sure: Annotated[bool, Meta(description="True if a document says so.")]


class LineSettingField(DocumentPart):
    """Baud and format of a line."""

    baud: int
    format: str


class ScanFamiliesDocument(Document, kw_only=True):
    """`scan`: who may be there and watches the line, before the first request."""

    command: Literal["scan"] = "scan"
    line: str
    event: Literal["families"] = "families"
    families: list[WatchingFamilyField]
    text: str


class ScanHitDocument(Document, kw_only=True):
    """`scan`: a drive that answered; baud and format are null over a network."""

    command: Literal["scan"] = "scan"
    line: str
    event: Literal["hit"] = "hit"
    device: int
    baud: int | None
    format: str | None
    vendor: str
    reference: str
    version: str
    name: str
    profile: str | None
    candidates: Annotated[
        list[str], Meta(description="Profiles that may fit, the likeliest first.")
    ]
    sure: Certainty
    by: Annotated[
        str | None,
        Meta(description="Source of the identity: a function, or a read; null if unknown."),
    ]


class ScanUnclearDocument(Document, kw_only=True):
    """`scan`: bytes from an address that are not an answer; it may be taken twice."""

    command: Literal["scan"] = "scan"
    line: str
    event: Literal["unclear"] = "unclear"
    device: int
    baud: int | None
    format: str | None
    text: str


class ScanSlowDocument(Document, kw_only=True):
    """`scan`: the likely settings are done; the remaining ones take this many seconds."""

    command: Literal["scan"] = "scan"
    line: str
    event: Literal["slow"] = "slow"
    settings: list[LineSettingField]
    seconds: float
    text: str


class ScanEndDocument(Document, kw_only=True):
    """`scan`: the end; `done` is false where it was ended before."""

    command: Literal["scan"] = "scan"
    line: str
    event: Literal["ended"] = "ended"
    done: bool
    found: int
    addresses: str
    settings: Annotated[
        list[LineSettingField], Meta(description="Those that were tried, in this order.")
    ]
    not_tried: int
    held_back: Annotated[
        str | None,
        Meta(description="Why others were not tried; null where nothing kept them back."),
    ]
    remarks: Annotated[
        list[str],
        Meta(description="Troubles that the search has shown, such as refusals of a gateway."),
    ]
    text: str


class ProveDocument(DriveDocument, kw_only=True):
    """`prove`: the silences between which the drive has reacted, and what is set; times in ms."""

    command: Literal["prove"] = "prove"
    configured_ms: int
    not_before_ms: int
    not_after_ms: int | None
    measured_ms: int | None
    reaction: str | None
    seen: str | None
    fault: str | None
    turning: bool
    as_set: bool
    text: str
    changed: str | None
    reset: bool


class CountersDocument(DriveDocument, kw_only=True):
    """`counters`: what was exchanged with a drive, as counted here and by the drive."""

    command: Literal["counters"] = "counters"
    counted_by: str | None
    seconds: float
    ours: OurCountersField
    since_opened: OurCountersField
    last_minute: LastMinutesField
    load: LoadField
    drive: list[DriveCountersField]
    differences: list[DifferenceField]
    agree: Annotated[
        bool | None, Meta(description="Null if the drive's own counters were not compared.")
    ]
    trouble: str | None
    test: CountingTestField
    reset: bool


class CommandDocument(DriveDocument, kw_only=True):
    """`reference`, `reset`: the result of the command."""

    command: Literal["reference", "reset"]
    text: str
    messages: list[str]


class StopDocument(Document, kw_only=True):
    """`stop`: the result for one drive; a list with --all or several -d.

    `stopped` is true if the output is at 0 Hz and the drive is not enabled.
    """

    command: Literal["stop"] = "stop"
    line: str
    device: int
    profile: str | None
    first: list[FirstWordField] | UnsetType = UNSET
    stopped: bool
    may_coast: Annotated[
        bool | UnsetType,
        Meta(description="Nothing brakes the motor, which may still turn; only if `stopped`."),
    ] = UNSET
    text: str
    status: int
    timeout: TimeoutField | UnsetType | None = UNSET
    given_back: str | UnsetType = UNSET


CertaintyText = Literal["certain", "likely", "possible"]


class MeasuredReads(DocumentPart):
    """Counts of the short reads of a drive that `why` makes; shares are those of `asked`."""

    asked: int
    answered: int
    lost: int
    damaged: int
    late: int
    duplicated: int
    foreign: int
    unreached: Annotated[
        int,
        Meta(
            description="Refusals of a gateway that did not reach the drive: exceptions 0A and 0B."
        ),
    ]
    behind: int
    second: Annotated[int, Meta(description="Second replies to one request, with other values.")]
    seconds: float
    stray: Annotated[
        int, Meta(description="Intact replies with bytes before or after them that form no frame.")
    ]


class WhyDocument(DriveDocument, kw_only=True):
    """`why`: the failing check (`answers` if none), the cause in a sentence, and the next steps."""

    command: Literal["why"] = "why"
    rung: str
    answers: Annotated[
        bool, Meta(description="True if the drive answers and nothing is wrong: status 0, else 3.")
    ]
    certainty: CertaintyText
    others: Annotated[list[str], Meta(description="Other possible causes; empty if it is certain.")]
    text: str
    next: list[str]
    measured: MeasuredReads | None
    seen: HeardField
