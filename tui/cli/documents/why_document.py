"""The document of `why`."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .document import DocumentPart, DriveDocument
from .parts import HeardField

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
