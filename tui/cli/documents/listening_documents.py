"""Documents of `listen`: the traffic on a line, and the conclusions."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .document import Document, DocumentPart

HowIdentified = Literal["named", "identified", "remembered", "likely"]


class HeardValueField(DocumentPart):
    """One value that was read, or written (`written`)."""

    address: int
    raw: int
    value: int | float
    unit: str
    text: str
    written: bool


class HeardExchangeDocument(Document, kw_only=True):
    """`listen`: one request with its result; `request` and `reply` are hexadecimal."""

    command: Literal["listen"] = "listen"
    event: Literal["exchange"] = "exchange"
    time: str
    line: str
    device: Annotated[int, Meta(description="0 for all devices at once.")]
    profile: str | None
    how: Annotated[HowIdentified | None, Meta(description="Why it is taken for that.")]
    others: Annotated[list[str], Meta(description="Profiles that are as likely.")]
    function: int
    name: str
    answer: Literal["ok", "exception", "none", "damaged", "broadcast", "again", "unasked"]
    exception: int | None
    meaning: str | None
    turnaround_ms: float | None
    asked: list[str]
    values: dict[str, HeardValueField]
    request: str
    reply: str
    text: str


class NoiseField(DocumentPart):
    """Bytes that form no frame."""

    places: int
    bytes: int


class SilencesField(DocumentPart):
    """Observance of the silences between frames, if that can be judged."""

    judged: bool
    broken_frames: int
    longest_ms: float
    too_soon: int
    together: Annotated[
        int,
        Meta(description="Frames read at once with the one before: their silence is not known."),
    ]


class HeardWriteField(DocumentPart):
    """One parameter that the master writes; `every` is in seconds, null of a single time."""

    commands: Annotated[bool, Meta(description="True if it decides what the motor does.")]
    times: int
    every: float | None
    raw: int
    text: str


class HeardReadField(DocumentPart):
    """One read of the master."""

    function: int
    address: int
    words: int
    times: int
    every: float | None


class PlannedReadField(DocumentPart):
    """One read of a shorter plan."""

    function: int
    address: int
    words: int


class FeedingField(DocumentPart):
    """A communication timeout against the longest pause; seconds, null where it is off."""

    code: str
    seconds: float | None
    known: Literal["heard", "factory"]
    begun: bool
    longest_pause: float
    fed: bool | None
    margin: float | None


class ShorterField(DocumentPart):
    """Reads that bring the same values as those of the master's cycle, in less time."""

    codes: list[str]
    requests_now: int
    ms_now: float
    requests: list[PlannedReadField]
    ms: float


class HeardDriveField(DocumentPart):
    """Traffic of one drive."""

    device: int
    profile: str | None
    how: HowIdentified | None
    others: list[str]
    requests: int
    per_second: float | None
    longest_pause: float
    answered: int
    unanswered: int
    damaged: int
    answered_twice: int
    exceptions: dict[str, int]
    turnaround_ms: float | None
    commanded: bool
    writes: dict[str, HeardWriteField]
    reads: list[HeardReadField]
    timeout: FeedingField | None
    shorter: ShorterField | None


class HeardSummaryDocument(Document, kw_only=True):
    """`listen`: the summary so far."""

    command: Literal["listen"] = "listen"
    event: Literal["summary"] = "summary"
    time: str
    line: str
    seconds: float
    exchanges: int
    frames: int
    bytes: int
    load: float | None
    crossed: Annotated[
        int,
        Meta(
            description="Requests that began while another waited for its answer: a second master."
        ),
    ]
    noise: NoiseField
    silences: SilencesField
    drives: list[HeardDriveField]
    text: list[str]
