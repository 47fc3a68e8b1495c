"""JSON of `profiles confirm`."""

from __future__ import annotations

from typing import Literal

from .document import Document, DocumentPart


class FindingField(DocumentPart):
    """Result for one statement of a profile, as in the file of evidence."""

    subject: Literal["identity", "address", "range", "value", "frame"]
    name: str
    statement: str
    result: Literal["confirmed", "contradicted", "open"]
    seen: str


class ConfirmDocument(Document, kw_only=True):
    """`profiles confirm`: what a drive shows about its profile."""

    command: Literal["profiles"] = "profiles"
    profile: str
    file: str
    tested_on: Literal["drive", "simulated", "unknown"]
    reference: str
    firmware: str
    confirmed: int
    contradicted: int
    open: int
    findings: list[FindingField]
