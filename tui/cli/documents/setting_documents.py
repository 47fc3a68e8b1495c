"""Documents about what a drive holds: settings, sets, blocks, what was taught."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import UNSET, UnsetType

from .drive_documents import Document, DriveDocument
from .parts import ComparedSettingField, EditField, PlanItemField


class WriteDocument(DriveDocument, kw_only=True):
    """`write`: the result of each setting."""

    command: Literal["write"]
    dry_run: bool
    results: list[EditField]
    saved: bool
    after_reset: list[str]
    unsaved: list[str]
    messages: list[str]


class RestoreDocument(DriveDocument, kw_only=True):
    """`restore`: the plan, and the result of each setting."""

    command: Literal["restore"]
    dry_run: bool
    plan: list[PlanItemField]
    same_rating: bool | None
    needs_stop: bool
    across: bool
    results: list[EditField]
    saved: bool
    left: list[str]
    messages: list[str]


class BackupDocument(DriveDocument, kw_only=True):
    """`backup`: the file, and what could not be read."""

    command: Literal["backup"]
    file: str
    parameters: int
    all: bool
    absent: dict[str, str]
    messages: list[str]


class ReportDocument(DriveDocument, kw_only=True):
    """`report`: the file."""

    command: Literal["report"]
    file: str
    parameters: int
    absent: dict[str, str]
    messages: list[str]


class CompareDocument(Document, kw_only=True):
    """`compare`: rows that differ, all with --all."""

    command: Literal["compare"]
    a: str
    b: str
    profile: str
    equal: bool
    rows: list[ComparedSettingField]


class BlocksDocument(DriveDocument, kw_only=True):
    """`block`: slots and what they bring, or why there are none."""

    command: Literal["block"]
    blocks: list[dict[str, Any]]
    monitoring_us: dict[str, int] | UnsetType = UNSET
    why: str | UnsetType = UNSET
    reads: list[dict[str, Any]] | UnsetType = UNSET


class BlockChangeDocument(DriveDocument, kw_only=True):
    """`block` with --dry-run: what would be written."""

    command: Literal["block"]
    dry_run: Literal[True]
    changes: list[dict[str, str]]


class BlockFileDocument(DriveDocument, kw_only=True):
    """`block save`: the file."""

    command: Literal["block"]
    file: str
    slots: int


class LessonDocument(DriveDocument, kw_only=True):
    """`teach` with a VALUE: the result of the reading."""

    command: Literal["teach"]
    code: str
    lesson: str
    text: str
    taught: dict[str, Any] | None


class TaughtDocument(DriveDocument, kw_only=True):
    """`teach`: what is taught."""

    command: Literal["teach"]
    taught: dict[str, Any]
    reference: str | None


class TeachChangeDocument(DriveDocument, kw_only=True):
    """`teach` with --forget, --reference or --no-reference."""

    command: Literal["teach"]
    text: str
    reference: str | None
