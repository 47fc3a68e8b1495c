"""Objects inside the documents of `--json`."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import UNSET, Meta, UnsetType

from .document import DocumentPart


class TurnaroundField(DocumentPart):
    """Replies with a turnaround up to so many ms and beyond the one before; null: any longer."""

    up_to_ms: int | None
    count: int


class OurCountersField(DocumentPart):
    """Counts of this program; `exceptions` by their code, `turnarounds` as a histogram."""

    frames: int
    replies: int
    timeouts: int
    checksum: int
    wrong: int
    repeats: int
    exceptions: dict[str, int]
    bytes_out: int
    bytes_in: int
    busy_seconds: float
    turnarounds: list[TurnaroundField]


class LastMinuteField(DocumentPart):
    """Replies of the last minute, and the share of good ones, 0 to 1; null without a reply.

    `silent` are those missed by a drive that has not answered since, not part of a line's share.
    """

    share: float | None
    good: int
    lost: int
    silent: int
    damaged: int
    foreign: int
    strays: int


class LastMinutesField(DocumentPart):
    """The last minute of the line, and of the drive."""

    line: LastMinuteField
    device: LastMinuteField


class LoadField(DocumentPart):
    """Shares of the time, 0 to 1, in which the line was busy: at all, and with this drive."""

    line: float | None
    device: float | None


class DriveCountersField(DocumentPart):
    """A pair of the drive's counters as it reports them, and its counts since the first reading."""

    name: str
    frames: int
    checksum_errors: int
    saturated: bool
    frames_since: int
    checksum_errors_since: int
    counts_this_line: bool | None


class DifferenceField(DocumentPart):
    """Something that the counters show; `count` frames at least."""

    kind: str
    count: int
    text: str


class CountingTestField(DocumentPart):
    """Frames that were sent to be counted."""

    frames: int
    answered: int


QualityText = Literal["good", "stale", "bad"]
OutcomeText = Literal[
    "done", "sent", "changed", "not-taken", "drive-refused", "refused", "unknown",
    "not-sent", "held-back", "waits", "would-write",
]  # fmt: skip


class LeftBehindDocument(DocumentPart):
    """A motor whose program has exited, or does not answer, and that no program commands."""

    program: str
    pid: int
    exited: bool
    left_running: bool
    since: str
    text: str


class ValueField(DocumentPart):
    """One value; `raw` and `value` are null where there is none."""

    address: int
    raw: int | None
    value: int | float | None
    unit: str
    text: str
    taught: bool
    quality: QualityText
    unsure: bool | UnsetType = UNSET


class StatusWordField(DocumentPart):
    """A command or status word; `bits` are the names of its bits that are 1.

    `texts` are what its bits mean, at 1 and at 0.
    """

    code: str
    address: int
    raw: int
    text: str
    bits: list[str]
    texts: list[str]


class WatchedValueField(ValueField, kw_only=True):
    """One value of a cycle; `time` is when it was read, null where it never was."""

    time: str | None
    error: str | None


class HeardField(DocumentPart):
    """Traffic while a drive was polled; counts are of requests unless stated otherwise."""

    asked: int
    answered: int
    late: int
    echoed: int
    damaged: int
    garbage_bytes: int
    exceptions: list[int]
    functions: Annotated[
        list[int], Meta(description="Functions that came where another was asked for.")
    ]
    others: Annotated[list[int], Meta(description="Addresses that answered in the drive's place.")]
    framing_errors: int
    parity_errors: int
    breaks: int
    turnaround_ms: float | None
    latency_timer_ms: Annotated[
        int | None, Meta(description="Of the adapter; null if it does not report one.")
    ]


class FirstWordField(DocumentPart):
    """A word that a stop sent before the drive was identified."""

    address: int
    word: int
    families: list[str]
    answer: str


class ModelField(DocumentPart):
    """A drive's model by its own code word."""

    code: int | None
    text: str
    reference: str | None
    voltage: str | None
    power_kw: int | float | str | None
    variant: str | None
    class_b: bool | None


class StateField(DocumentPart):
    """The state of a drive's chart."""

    id: str
    name: str
    kind: str


class EditField(DocumentPart):
    """Result of one setting."""

    code: str
    typed: str | None
    old: str | None
    old_raw: int | None
    new: str
    new_raw: int
    rounded: bool
    outcome: OutcomeText
    held: int | None
    text: str


class PlanItemField(DocumentPart):
    """One parameter of a set, and its result."""

    code: str
    kind: Literal["write", "equal", "skip"]
    reason: str | None
    text: str | None
    old: str | None
    new: str | None


class ComparedSettingField(DocumentPart):
    """One parameter on both sides."""

    code: str
    name: str
    group: str
    a: str
    b: str
    raw_a: int | None
    raw_b: int | None
    differs: bool
    remark: str | None


class FaultField(DocumentPart):
    """The fault of a drive, with causes and checks."""

    raw: int | None
    code: str | None
    name: str | None
    causes: list[str]
    checks: list[str]
    ruled_out: list[ExcludedPart]
    supported: list[ExcludedPart]
    look_at: list[LookField]
    confidence: str | None
    source: str | None
    reset: ResetField | None


class AlarmField(DocumentPart):
    """The first alarm of a drive without a fault, with causes and checks."""

    name: str
    causes: list[str]
    checks: list[str]
    ruled_out: list[ExcludedPart]
    supported: list[ExcludedPart]
    look_at: list[LookField]
    confidence: str | None
    source: str | None


class ExcludedPart(DocumentPart):
    """A cause or a check that the value of a parameter rules out or supports."""

    text: str
    code: str
    reason: str
    source: str
    """Source of the rule; empty if it has none."""
    confidence: str


class LookField(DocumentPart):
    """A parameter that a fault points at."""

    code: str
    name: str
    why: str
    value: ValueField | None


class ResetField(DocumentPart):
    """Reset of a fault."""

    way: str | None
    confidence: str
    possible_now: bool | None
    wait_s: float | None
    follows: str


class ControlField(DocumentPart):
    """Holder of the control, and the commands that change it."""

    taken: bool | None
    take: str | None
    give_back: str | None


class EepromCountField(DocumentPart):
    """Writes to EEPROM from this computer, of one parameter or of all settings."""

    count: int
    first: str | None
    last: str | None
    last_hour: int
    frequent: Annotated[bool, Meta(description="True if the next write is warned about.")]


class EepromField(DocumentPart):
    """Writes to the EEPROM of a drive from this computer."""

    life: Annotated[
        int | None, Meta(description="Writes that it lasts for; null if no document states it.")
    ]
    saves: EepromCountField
    writes: Annotated[
        dict[str, EepromCountField], Meta(description="By code: parameters written one by one.")
    ]


class OldTimeoutField(DocumentPart):
    """The communication timeout in the older form of `status`; `timeout` replaces it."""

    timeout_s: float
    reaction: str | None
    does: str | None
    begun: bool | None
