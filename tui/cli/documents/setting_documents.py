"""Documents about settings, sets, blocks and learned scales of a drive."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import UNSET, Meta, UnsetType

from .document import Document, DocumentPart, DriveDocument
from .parts import ComparedSettingField, EditField, PlanItemField, ValueField


class WriteDocument(DriveDocument, kw_only=True):
    """`write`: the result of each setting."""

    command: Literal["write"] = "write"
    dry_run: bool
    results: list[EditField]
    saved: bool
    after_reset: list[str]
    unsaved: list[str]
    messages: list[str]


class RestoreDocument(DriveDocument, kw_only=True):
    """`restore`: the plan, and the result of each setting."""

    command: Literal["restore"] = "restore"
    dry_run: bool
    plan: list[PlanItemField]
    same_rating: bool | None
    needs_stop: bool
    across: bool
    mapped_by: str | None
    """Source of the table between the two families; null if there is none."""
    results: list[EditField]
    saved: bool
    left: list[str]
    messages: list[str]


class BackupDocument(DriveDocument, kw_only=True):
    """`backup`: the file, and what could not be read."""

    command: Literal["backup"] = "backup"
    file: str
    parameters: int
    all: bool
    absent: dict[str, str]
    messages: list[str]
    recipe: Annotated[
        str | UnsetType, Meta(description="The file of recipes; only with --recipe.")
    ] = UNSET
    machine: Annotated[
        str | UnsetType, Meta(description="The set of the drives of one family, for --recipe.")
    ] = UNSET


class ReportDocument(DriveDocument, kw_only=True):
    """`report`: the file."""

    command: Literal["report"] = "report"
    file: str
    parameters: int
    absent: dict[str, str]
    messages: list[str]


class CompareDocument(Document, kw_only=True):
    """`compare`: rows that differ, all with --all."""

    command: Literal["compare"] = "compare"
    a: str
    b: str
    profile: str
    equal: bool
    rows: list[ComparedSettingField]


class RecipeDriveField(DocumentPart):
    """A drive compared with its recipe."""

    device: int
    profile: str
    settings: int
    """Number of settings in the recipe."""
    differs: int | None
    """Number that differ; null if the drive was not compared."""
    error: str | None
    left: list[str]
    """Codes in the set of the machine that belong to a drive, and do not count."""
    rows: list[ComparedSettingField]


class RecipesDocument(Document, kw_only=True):
    """`compare` with a recipe file: each drive; rows that differ, all with --all."""

    command: Literal["compare"] = "compare"
    file: str
    name: str | None
    line: str
    equal: bool
    drives: list[RecipeDriveField]


class SlotField(DocumentPart):
    """One slot of a block."""

    slot: str
    holds: Annotated[int | None, Meta(description="Raw content of the slot; null if not read.")]
    code: str | None
    number: str | None
    address: int | None
    raw: int | None
    text: str
    direct: Annotated[
        ValueField | None, Meta(description="The same parameter, read directly; null if not read.")
    ]
    verdict: str
    force: str | None
    brings: str | None


class BlockField(DocumentPart):
    """One block or scanner with its slots."""

    id: str
    name: str
    direction: Literal["read", "write"]
    address: int
    effective: str
    trouble: str | None
    request: Annotated[str | None, Meta(description="The frame that reads or writes it, in hex.")]
    slots: list[SlotField]


class NeighborReadField(DocumentPart):
    """One read of neighboring parameters; times in microseconds on the wire."""

    address: int
    count: int
    codes: list[str]
    beside: list[str]
    us: int
    one_by_one_us: int


class MonitoringTimeField(DocumentPart):
    """Time of a cycle of the monitoring set on the wire, in microseconds."""

    direct: int
    with_blocks: int


class BlocksDocument(DriveDocument, kw_only=True):
    """`block`: slots and what they bring, or why there are none."""

    command: Literal["block"] = "block"
    blocks: list[BlockField]
    monitoring_us: MonitoringTimeField | UnsetType = UNSET
    why: str | UnsetType = UNSET
    reads: list[NeighborReadField] | UnsetType = UNSET


class SlotChangeField(DocumentPart):
    """Mapping of one slot before and after."""

    slot: str
    old: str
    new: str


class BlockChangeDocument(DriveDocument, kw_only=True):
    """`block` with --dry-run: what would be written."""

    command: Literal["block"] = "block"
    dry_run: Literal[True] = True
    changes: list[SlotChangeField]


class BlockFileDocument(DriveDocument, kw_only=True):
    """`block save`: the file."""

    command: Literal["block"] = "block"
    file: str
    slots: int


class ScaleField(DocumentPart):
    """Value of one count of a raw word."""

    scale: float
    unit: str | None
    signed: Annotated[bool | None, Meta(description="Null until a reading shows it.")]


class ReadingField(DocumentPart):
    """A raw word with the value that the drive's display showed."""

    raw: int
    shown: float
    unit: str | None


class TaughtField(DocumentPart):
    """Learned scale of one parameter, with its readings."""

    scale: ScaleField | None
    looks: list[ReadingField]


class LessonDocument(DriveDocument, kw_only=True):
    """`teach` with a VALUE: the result of the reading."""

    command: Literal["teach"] = "teach"
    code: str
    lesson: str
    text: str
    taught: ScaleField | None


class TaughtDocument(DriveDocument, kw_only=True):
    """`teach`: learned scales by code."""

    command: Literal["teach"] = "teach"
    taught: dict[str, TaughtField]
    reference: str | None


class TeachChangeDocument(DriveDocument, kw_only=True):
    """`teach` with --forget, --reference or --no-reference."""

    command: Literal["teach"] = "teach"
    text: str
    reference: str | None
