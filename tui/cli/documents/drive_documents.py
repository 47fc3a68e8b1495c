"""Documents about a drive: identity, state, and commands."""

from __future__ import annotations

from typing import Literal

import msgspec
from msgspec import UNSET, UnsetType

from tui.bus.api import Contact

from .counter_parts import (
    CountingTestField,
    DifferenceField,
    DriveCountersField,
    LastMinutesField,
    LoadField,
    OurCountersField,
)
from .parts import (
    AlarmField,
    ControlField,
    FaultField,
    FirstWordField,
    LeftBehindDocument,
    ModelField,
    OldTimeoutField,
    StateField,
    TimeoutField,
    ValueField,
    WatchedValueField,
)


class Document(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """Fields common to all JSON documents."""

    schema: Literal[1]
    command: str | None


class DriveDocument(Document, kw_only=True):
    """A document about one drive on the LINE as it was typed."""

    line: str
    device: int
    profile: str | None
    timeout: TimeoutField | UnsetType | None = UNSET


class ErrorDocument(Document, kw_only=True):
    """An error that ended the command, or that of one of several drives."""

    error: str
    status: int
    line: str | UnsetType = UNSET
    device: int | UnsetType = UNSET


class ReadDocument(DriveDocument, kw_only=True):
    """`read`: values by code."""

    command: Literal["read"]
    values: dict[str, ValueField]


class CycleTime(msgspec.Struct, forbid_unknown_fields=True):
    """Seconds from one cycle of a drive to the next."""

    seconds: float
    """As they were."""
    wished: float
    """As `--every` asks for them."""


class CycleDocument(DriveDocument, kw_only=True):
    """`watch`: one cycle."""

    command: Literal["watch"]
    time: str
    values: dict[str, WatchedValueField]
    state: str | None
    direction: str | None
    error: str | None
    contact: Contact
    cycle: CycleTime


class IdentityDocument(DriveDocument, kw_only=True):
    """`identify`: who a drive says it is."""

    command: Literal["identify"]
    vendor: str
    reference: str
    version: str
    name: str
    model: ModelField | None


class StatusDocument(DriveDocument, kw_only=True):
    """`status`: what a drive does and who commands it."""

    command: Literal["status"]
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
    values: dict[str, ValueField | None]
    unread: list[str]


class RunDocument(Document, kw_only=True):
    """`run`: one event."""

    command: Literal["run"]
    time: str
    device: int
    event: Literal[
        "control", "reference", "order", "state", "ended", "stopping", "stopped", "left-running"
    ]
    text: str
    state: str | UnsetType | None = UNSET
    direction: str | UnsetType | None = UNSET
    fault: str | UnsetType | None = UNSET
    values: dict[str, ValueField | None] | UnsetType = UNSET
    error: str | UnsetType | None = UNSET
    timeout: TimeoutField | UnsetType | None = UNSET


class HoldDocument(Document, kw_only=True):
    """`hold`: one event."""

    command: Literal["hold"]
    time: str
    line: str
    device: int
    event: Literal["holding", "lost", "back", "fault"]
    text: str
    timeout: TimeoutField | UnsetType | None = UNSET


class WatchingFamilyField(msgspec.Struct, forbid_unknown_fields=True):
    """A family that reacts when polling stops after the first request."""

    profile: str
    name: str
    timeout: str
    """The parameter that sets its timeout."""
    sure: bool
    """True if a document says so."""


class LineSettingField(msgspec.Struct, forbid_unknown_fields=True):
    """Baud and format of a line."""

    baud: int
    format: str


class ScanFamiliesDocument(Document, kw_only=True):
    """`scan`: who may be there and watches the line, before the first request."""

    command: Literal["scan"]
    line: str
    event: Literal["families"]
    families: list[WatchingFamilyField]
    text: str


class ScanHitDocument(Document, kw_only=True):
    """`scan`: a drive that answered; baud and format are null over a network."""

    command: Literal["scan"]
    line: str
    event: Literal["hit"]
    device: int
    baud: int | None
    format: str | None
    vendor: str
    reference: str
    version: str
    name: str
    profile: str | None
    candidates: list[str]
    """Profiles that may fit, the likeliest first."""
    sure: Literal["identified", "likely", "unknown"]
    by: str | None
    """Source of the identity: a function, or a read; null if unknown."""


class ScanUnclearDocument(Document, kw_only=True):
    """`scan`: bytes from an address that are not an answer; it may be taken twice."""

    command: Literal["scan"]
    line: str
    event: Literal["unclear"]
    device: int
    baud: int | None
    format: str | None
    text: str


class ScanSlowDocument(Document, kw_only=True):
    """`scan`: the likely settings are through; those that are left take so many seconds."""

    command: Literal["scan"]
    line: str
    event: Literal["slow"]
    settings: list[LineSettingField]
    seconds: float
    text: str


class ScanEndDocument(Document, kw_only=True):
    """`scan`: the end; `done` is false where it was ended before."""

    command: Literal["scan"]
    line: str
    event: Literal["ended"]
    done: bool
    found: int
    addresses: str
    settings: list[LineSettingField]
    """Those that were tried, in this order."""
    not_tried: int
    held_back: str | None
    """Why others were not tried; null where nothing kept them back."""
    remarks: list[str]
    """Troubles of the line that the search has shown: an echo, refusals of a gateway."""
    text: str


class ProveDocument(DriveDocument, kw_only=True):
    """`prove`: the silences between which the drive has reacted, and what is set; times in ms."""

    command: Literal["prove"]
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

    command: Literal["counters"]
    counted_by: str | None
    seconds: float
    ours: OurCountersField
    since_opened: OurCountersField
    last_minute: LastMinutesField
    load: LoadField
    drive: list[DriveCountersField]
    differences: list[DifferenceField]
    agree: bool
    trouble: str | None
    test: CountingTestField
    reset: bool


class CommandDocument(DriveDocument, kw_only=True):
    """`reference`, `reset`: the result of the command."""

    command: Literal["reference", "reset"]
    text: str
    messages: list[str]


class StopDocument(DriveDocument, kw_only=True):
    """`stop`: the result for one drive; a list with --all or several -d."""

    command: Literal["stop"]
    stopped: bool
    text: str
    status: int
    first: list[FirstWordField] | UnsetType = UNSET
    given_back: str | UnsetType = UNSET
