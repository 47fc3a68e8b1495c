"""Common parts of a profile's tables: kinds of numbers and texts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from msgspec import Meta, Struct

WordAddress = Annotated[int, Meta(ge=0, le=0xFFFF)]
RawWord = Annotated[int, Meta(ge=-0x8000, le=0xFFFF)]
CommandBits = Annotated[int, Meta(ge=-0x8000, le=0xFFFFFFFF)]
"""A command word of 16 or 32 bits; a negative one has 16."""
ReadCount = Annotated[int, Meta(ge=1, le=125)]
WriteCount = Annotated[int, Meta(ge=1, le=123)]
ExceptionByte = Annotated[int, Meta(ge=1, le=255)]
DeviceAddress = Annotated[int, Meta(ge=0, le=255)]
DecimalText = Annotated[str, Meta(pattern=r"^[0-9]+(\.[0-9]+)?$")]
SignedDecimalText = Annotated[str, Meta(pattern=r"^-?[0-9]+(\.[0-9]+)?$")]
Identifier = Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_-]*$")]
BitNumber = Annotated[int, Meta(ge=0, le=15)]
LongBitNumber = Annotated[int, Meta(ge=0, le=31)]
LongWord = Annotated[int, Meta(ge=0, le=0xFFFFFFFF)]
"""The bits of one word or of two."""

Confidence = Literal[
    "site", "manual", "manual+public", "public-x2", "public", "analogy", "unverified"
]
"""Certainty of a fact, best first; below `public` it is shown as unverified. `site` is proved by
evidence of this site, and never in a file."""

Effective = Literal["at-once", "after-reset"]


class Table(Struct, frozen=True, forbid_unknown_fields=True):
    """One table of a profile: frozen, and an unknown key in it is an error."""


class When(Table, frozen=True, kw_only=True):
    """A condition on another parameter's raw value."""

    parameter: str
    mask: LongWord | None = None
    """Bits of the word that are evaluated; absent: all."""
    values: list[int]

    def holds(self, raws: Mapping[str, int]) -> bool | None:
        """Return True if it holds, given raw values by code; None if its word is unknown."""
        raw = raws.get(self.parameter)
        if raw is None:
            return None
        return (raw if self.mask is None else raw & self.mask) in self.values
