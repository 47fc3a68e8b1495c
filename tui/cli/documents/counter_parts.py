"""Objects inside the document of `counters`."""

from __future__ import annotations

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
