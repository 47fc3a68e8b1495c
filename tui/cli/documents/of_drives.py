"""Documents about a drive: what it says, does and was told to do."""

from __future__ import annotations

from typing import Literal

import msgspec
from msgspec import UNSET, UnsetType

from tui.bus.api import Contact

from .counter_parts import (
    CountingTestTold,
    DifferenceTold,
    DriveCountersTold,
    LastMinutesField,
    LoadTold,
    OurCountersTold,
)
from .parts import (
    AlarmTold,
    ControlTold,
    FaultTold,
    FirstWordTold,
    LeftBehindDocument,
    ModelTold,
    OldTimeoutTold,
    StateTold,
    TimeoutTold,
    ValueTold,
    WatchedValueTold,
)


class DocumentTold(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """What every document begins with."""

    schema: Literal[1]
    command: str | None


class OfDriveTold(DocumentTold, kw_only=True):
    """A document about one drive on the LINE as it was typed."""

    line: str
    device: int
    profile: str | None
    timeout: TimeoutTold | UnsetType | None = UNSET


class ErrorTold(DocumentTold, kw_only=True):
    """An error that ended the command, or that of one of several drives."""

    error: str
    status: int
    line: str | UnsetType = UNSET
    device: int | UnsetType = UNSET


class ReadTold(OfDriveTold, kw_only=True):
    """`read`: values by code."""

    command: Literal["read"]
    values: dict[str, ValueTold]


class CycleTime(msgspec.Struct, forbid_unknown_fields=True):
    """Seconds from one cycle of a drive to the next."""

    seconds: float
    """As they were."""
    wished: float
    """As `--every` asks for them."""


class CycleTold(OfDriveTold, kw_only=True):
    """`watch`: one cycle."""

    command: Literal["watch"]
    time: str
    values: dict[str, WatchedValueTold]
    state: str | None
    direction: str | None
    error: str | None
    contact: Contact
    cycle: CycleTime


class IdentityTold(OfDriveTold, kw_only=True):
    """`identify`: who a drive says it is."""

    command: Literal["identify"]
    vendor: str
    reference: str
    version: str
    name: str
    model: ModelTold | None


class StatusTold(OfDriveTold, kw_only=True):
    """`status`: what a drive does and who commands it."""

    command: Literal["status"]
    state: StateTold
    direction: str | None
    fault: FaultTold | None
    alarms: list[str]
    alarm: AlarmTold | None
    commanded_by: str | None
    reference_from: str | None
    switched_by: list[str]
    commandable: bool
    why_not: str | None
    control: ControlTold | None
    watch: OldTimeoutTold | None
    left_behind: LeftBehindDocument | None
    values: dict[str, ValueTold | None]
    unread: list[str]


class RunTold(DocumentTold, kw_only=True):
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
    values: dict[str, ValueTold | None] | UnsetType = UNSET
    error: str | UnsetType | None = UNSET
    timeout: TimeoutTold | UnsetType | None = UNSET


class HoldTold(DocumentTold, kw_only=True):
    """`hold`: one event."""

    command: Literal["hold"]
    time: str
    line: str
    device: int
    event: Literal["holding", "lost", "back", "fault"]
    text: str
    timeout: TimeoutTold | UnsetType | None = UNSET


class WatchingFamilyTold(msgspec.Struct, forbid_unknown_fields=True):
    """A family that acts when it was asked once and is asked no more."""

    profile: str
    name: str
    timeout: str
    """The parameter that sets its timeout."""
    sure: bool
    """Whether a document says so."""


class LineSettingTold(msgspec.Struct, forbid_unknown_fields=True):
    """Baud and format of a line."""

    baud: int
    format: str


class ScanFamiliesTold(DocumentTold, kw_only=True):
    """`scan`: who may be there and watches the line, before the first request."""

    command: Literal["scan"]
    line: str
    event: Literal["families"]
    families: list[WatchingFamilyTold]
    text: str


class ScanHitTold(DocumentTold, kw_only=True):
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
    """What told who it is: a function, or a read; null where nothing did."""


class ScanUnclearTold(DocumentTold, kw_only=True):
    """`scan`: what came from an address is no answer; it may be taken twice."""

    command: Literal["scan"]
    line: str
    event: Literal["unclear"]
    device: int
    baud: int | None
    format: str | None
    text: str


class ScanSlowTold(DocumentTold, kw_only=True):
    """`scan`: the likely settings are through; those that are left take so many seconds."""

    command: Literal["scan"]
    line: str
    event: Literal["slow"]
    settings: list[LineSettingTold]
    seconds: float
    text: str


class ScanEndTold(DocumentTold, kw_only=True):
    """`scan`: the end; `done` is false where it was ended before."""

    command: Literal["scan"]
    line: str
    event: Literal["ended"]
    done: bool
    found: int
    addresses: str
    settings: list[LineSettingTold]
    """Those that were tried, in this order."""
    not_tried: int
    held_back: str | None
    """Why others were not tried; null where nothing kept them back."""
    remarks: list[str]
    """Troubles of the line that the search has shown: an echo, refusals of a gateway."""
    text: str


class ProveTold(OfDriveTold, kw_only=True):
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


class CountersTold(OfDriveTold, kw_only=True):
    """`counters`: what was exchanged with a drive, as counted here and by the drive."""

    command: Literal["counters"]
    counted_by: str | None
    seconds: float
    ours: OurCountersTold
    since_opened: OurCountersTold
    last_minute: LastMinutesField
    load: LoadTold
    drive: list[DriveCountersTold]
    differences: list[DifferenceTold]
    agree: bool
    trouble: str | None
    test: CountingTestTold
    reset: bool


class CommandTold(OfDriveTold, kw_only=True):
    """`reference`, `reset`: what the command came to."""

    command: Literal["reference", "reset"]
    text: str
    messages: list[str]


class StopTold(OfDriveTold, kw_only=True):
    """`stop`: what became of one drive; a list with --all or several -d."""

    command: Literal["stop"]
    stopped: bool
    text: str
    status: int
    first: list[FirstWordTold] | UnsetType = UNSET
    given_back: str | UnsetType = UNSET
