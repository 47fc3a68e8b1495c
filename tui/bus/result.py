"""Result of an exchange, over any kind of line."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

StrayKind = Literal["late", "copy", ""]
"""A frame beside the awaited reply: a late reply, a second copy of one, or not known."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A stretch of received bytes: a whole frame of anybody, or bytes that form none."""

    data: bytes
    whole: bool

    @property
    def device(self) -> int:
        """The device of a whole frame."""
        return self.data[0]

    @property
    def pdu(self) -> bytes:
        """Function and data of a whole frame."""
        return self.data[1:-2]


class ResultKind(Enum):
    """Result of an exchange, by kind."""

    REPLY = "reply"
    EXCEPTION = "exception"
    DAMAGED = "damaged"
    WRONG = "wrong"
    NOTHING = "nothing"
    UNSURE = "unsure"
    """One copy of the request came back: its answer, or the adapter's echo."""


@dataclass(slots=True)
class ExchangeResult:
    """The end of an exchange, with everything that was received; times on the line's clock."""

    kind: ResultKind
    pdu: bytes = b""
    exception: int = 0
    detail: str = ""
    received: bytes = b""
    strays: list[Piece] = field(default_factory=list)
    """Whole frames that are neither the reply nor an echo."""
    instead: Piece | None = None
    """Over Modbus TCP: the reply of this transaction, if it is not that of its request."""
    resynchronised: bool = False
    """True if the reply was found behind or between other bytes."""
    recognized: bool = False
    """Of damaged bytes: whether they are surely what is left of the reply."""
    sent: float = 0.0
    """When the last byte of the request left."""
    end: float = 0.0
    """When the last byte came, or the time was up."""
    turnaround: float = 0.0
    """Seconds from the end of the request to the start of its reply."""
