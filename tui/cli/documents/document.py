"""Base of the documents that `--json` prints.

A document names its command in its field `command`, and is found by it: `json_schema` collects all
subclasses of `Document`. A field that may be missing has the default UNSET; all others are printed.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypedDict

import msgspec
from msgspec import UNSET, Meta, UnsetType


class DocumentPart(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """An object whose every field is listed here."""


class Document(DocumentPart, kw_only=True):
    """Fields common to all JSON documents."""

    schema: Literal[1] = 1
    command: str | None


class TimeoutField(DocumentPart):
    """The communication timeout of a drive; all null if the drive does not report it."""

    seconds: float | None
    reaction: str | None
    fault: str | None
    begun: bool | None


class DriveFields(TypedDict):
    """The drive that a document is about, on the LINE as it was typed."""

    line: str
    device: int
    profile: str | None
    timeout: TimeoutField | None


class DriveDocument(Document, kw_only=True):
    """A document about one drive on the LINE as it was typed."""

    line: str
    device: int
    profile: str | None
    timeout: TimeoutField | UnsetType | None = UNSET


class ErrorDocument(Document, kw_only=True):
    """An error that ended the command, or that of one of several drives or lines."""

    command: Annotated[str | None, Meta(description="Null if the words name no command.")]
    line: str | UnsetType = UNSET
    device: int | UnsetType = UNSET
    error: str
    status: int
