"""JSON of `journal`: writes, trips, runs and lost links."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .document import Document, DocumentPart


class JournalEntryField(DocumentPart):
    """A write, a trip that was seen, or a proof; `read_back` is what the drive held in the end."""

    time: str
    line: str
    device: int
    profile: str
    code: str
    address: int
    old_raw: int | None
    old: str
    new_raw: int
    new: str
    answer: str
    read_back: int | None
    why: str
    kind: Literal["write", "fault", "read-back", "proof", "reset"]
    of: str
    drive: str
    eeprom: Annotated[
        Literal["", "write", "save"],
        Meta(description="`write` if the value may go to EEPROM, `save` if all settings do."),
    ]
    within: Annotated[
        float,
        Meta(description="Seconds by which the time may differ; 0 if it was noted at once."),
    ]


class DamagedLineField(DocumentPart):
    """A damaged line of the journal, with its beginning."""

    file: str
    line: int
    text: str


class TripField(DocumentPart):
    """A trip of a drive; a time is null if it was not seen."""

    line: str
    device: int
    code: str
    name: str
    seen: Annotated[str, Meta(description="The first time that the drive was seen in the fault.")]
    tripped: str | None
    reset: str | None


class RunField(DocumentPart):
    """A run of a motor, from the status words that were recorded."""

    line: str
    device: int
    profile: str
    begun: str
    ended: Annotated[str, Meta(description="The end, or the last reading if the end was not seen.")]
    begin_seen: Annotated[bool, Meta(description="False if the motor ran when it was first read.")]
    end_seen: Annotated[bool, Meta(description="False if the motor ran when it was last read.")]
    within: Annotated[
        float, Meta(description="Seconds by which the times may differ: from reading to reading.")
    ]
    direction: Literal["forward", "reverse"] | None
    reference: Annotated[
        str | None,
        Meta(
            description="At the begin; null if it was not read. A reverse run has it without a"
            " sign, unless the sign changed."
        ),
    ]
    least: str | None
    most: Annotated[
        str | None, Meta(description="Extent of the reference; null if it did not change.")
    ]
    who: Annotated[
        str | None, Meta(description="The program that began it; null for another source.")
    ]


class LostLinkField(DocumentPart):
    """A time in which a line was lost, or a drive did not answer."""

    line: str
    device: Annotated[int | None, Meta(description="Null for the whole line.")]
    begun: str
    ended: Annotated[str | None, Meta(description="Null if it was still lost.")]
    reason: str


class JournalDocument(Document, kw_only=True):
    """`journal`: writes to drives from this computer, trips, runs, lost links; oldest first.

    `unread` are the records that could not be read, with the reason.
    """

    command: Literal["journal"] = "journal"
    journal: str
    entries: list[JournalEntryField]
    damaged: list[DamagedLineField]
    trips: list[TripField]
    runs: list[RunField]
    lost: list[LostLinkField]
    unread: list[str]
