"""Plan of a restore: the writes, and why the rest is omitted; pure functions."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Literal

from .edits import Edits

ItemKind = Literal["write", "equal", "skip"]
SkipReason = Literal[
    "",
    "no setting",
    "forbidden",
    "unverified",
    "line",
    "rating",
    "range",
    "rounding",
    "absent",
    "unknown",
    "no counterpart",
]


@dataclass(frozen=True, slots=True)
class Options:
    """Options of a restore."""

    line_settings: bool = False
    """Write address, baud rate and format as well, although this may cut the present line."""
    rating: bool = False
    """Write motor and rating data even if the rating differs."""
    confirmed: frozenset[str] = frozenset()
    """Codes of unverified parameters that the user has confirmed."""
    rounded: bool = False
    """Write values even if rounding changes them."""


NO_OPTIONS = Options()


@dataclass(frozen=True, slots=True)
class Held:
    """The drive's present values."""

    raws: Mapping[str, int]
    absent: Mapping[str, str] = field(default_factory=dict)
    """Reason by code, for parameters that cannot be read."""
    lacking: Collection[str] = ()
    """Codes that the drive reported as missing."""
    reference: str = ""
    """Reference reported by the drive; empty if unknown."""


@dataclass(frozen=True, slots=True)
class RestoreItem:
    """One parameter of the set with its result."""

    code: str
    kind: ItemKind
    reason: SkipReason = ""
    text: str = ""
    """Why it is not written, or a remark."""
    old: str = ""
    new: str = ""


@dataclass(frozen=True, slots=True)
class RestorePlan:
    """Planned writes in `edits`, and every item with its reason."""

    items: tuple[RestoreItem, ...]
    edits: Edits
    same_rating: bool | None
    """None if one side does not report its model."""
    needs_stop: bool
    """True if at least one write requires the motor stopped."""
    across: bool
    """True if the set is of another family: only what certainly means the same is carried over."""
    mapped_by: str = ""
    """Source of the table between the two families; empty if none is known."""

    def items_of_kind(self, kind: ItemKind) -> list[RestoreItem]:
        return [item for item in self.items if item.kind == kind]

    def count(self, kind: ItemKind) -> int:
        """Return the number of items of one kind; items that are not settings do not count."""
        return sum(1 for item in self.items_of_kind(kind) if item.reason != "no setting")
