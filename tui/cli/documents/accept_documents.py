"""JSON documents of `drivepanel accept`."""

from __future__ import annotations

from typing import Literal

from .document import DocumentPart, DriveDocument


class AcceptanceCheckField(DocumentPart):
    """A value of a step, with its limit."""

    name: str
    value: str
    limit: str
    passed: bool


class AcceptanceStepField(DocumentPart):
    """A step of the test."""

    number: int
    kind: str
    name: str
    outcome: Literal["passed", "failed", "not run"]
    text: str | None
    seconds: float
    checks: list[AcceptanceCheckField]
    curve: str | None
    """Name of the SVG file of its run."""


class AcceptDocument(DriveDocument, kw_only=True):
    """`accept`: the result of an acceptance test."""

    command: Literal["accept"] = "accept"
    name: str
    passed: bool
    why_not: str | None
    begun: str
    ended: str
    ended_by: str | None
    by: str
    panel: str
    profile_version: str
    identity: dict[str, str]
    file: str
    file_hash: str
    settings_hash: str | None
    settings_hash_after: str | None
    folder: str | None
    """Folder with the files of the result; null if the test had not begun."""
    steps: list[AcceptanceStepField]
