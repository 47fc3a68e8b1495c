"""The JSON of `why` and `counters` about one drive, for a bundle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tui.session.bundle.subject import DriveDocuments
    from tui.session.counters.watch import CountersNow
    from tui.session.diagnosis.diagnosis import Diagnosis
    from tui.session.drive import DriveSession

    from ..documents.document import Document


def drive_documents() -> DriveDocuments:
    """Return the JSON documents of both commands."""
    from tui.session.bundle.subject import DriveDocuments

    return DriveDocuments(_why, _counters)


def _why(line: str, device: int, session: DriveSession | None, found: Diagnosis) -> dict[str, Any]:
    from ..commands.why import why_document
    from .output import drive_fields

    fields = drive_fields(line, session) if session is not None else None
    return as_object(why_document(line, device, fields, found))


def _counters(
    line: str, session: DriveSession, found: CountersNow, sent: Mapping[str, int]
) -> dict[str, Any]:
    from ..commands.counters import counters_document
    from .output import drive_fields

    fields = drive_fields(line, session)
    return as_object(
        counters_document(fields, found, sent["frames"], sent["answered"], reset=False)
    )


def as_object(document: Document) -> dict[str, Any]:
    """A document as a plain object."""
    import msgspec

    found: dict[str, Any] = msgspec.to_builtins(document)
    return found
