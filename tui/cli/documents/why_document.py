"""The document of `why`."""

from __future__ import annotations

from typing import Literal

import msgspec

from .drive_documents import DriveDocument
from .parts import HeardField


class MeasuredReads(msgspec.Struct, forbid_unknown_fields=True):
    """Counts of the short reads of a drive that `why` makes; shares are those of `asked`."""

    asked: int
    answered: int
    lost: int
    damaged: int
    late: int
    duplicated: int
    foreign: int
    unreached: int
    """Refusals of a gateway that did not reach the drive: exceptions 0A and 0B."""
    behind: int
    second: int
    """Second replies to one request, with other values."""
    seconds: float


class WhyDocument(DriveDocument, kw_only=True):
    """`why`: the rung that fails, `answers` where none does, in a sentence; what to do next."""

    command: Literal["why"]
    rung: str
    answers: bool
    """True if the drive answers and nothing is wrong: status 0, else 3."""
    certainty: Literal["certain", "likely", "possible"]
    others: list[str]
    """Other possible causes; empty if it is certain."""
    text: str
    next: list[str]
    seen: HeardField
    measured: MeasuredReads | None
