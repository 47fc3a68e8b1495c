"""The JSON of `why` and `counters` about one drive, for a bundle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from .output import JSON_SCHEMA, drive_json

if TYPE_CHECKING:
    from tui.session.bundle.subject import DriveDocuments
    from tui.session.counters.watch import CountersNow
    from tui.session.diagnosis.diagnosis import Diagnosis
    from tui.session.drive import DriveSession


def drive_documents() -> DriveDocuments:
    """Return the JSON documents of both commands."""
    from tui.session.bundle.subject import DriveDocuments

    return DriveDocuments(_why, _counters)


def _why(line: str, device: int, session: DriveSession | None, found: Diagnosis) -> dict[str, Any]:
    from ..commands.why import why_json

    profile = found.sight.profile
    about = {
        "line": line,
        "device": device,
        "profile": profile.id if profile is not None else None,
        "timeout": None,
    }
    about |= drive_json(line, session) if session is not None else {}
    return {"schema": JSON_SCHEMA, "command": "why", **about, **why_json(found)}


def _counters(
    line: str, session: DriveSession, found: CountersNow, sent: Mapping[str, int]
) -> dict[str, Any]:
    from ..commands.counters import counters_json

    about = {"schema": JSON_SCHEMA, "command": "counters", **drive_json(line, session)}
    return {**about, **counters_json(found), "test": dict(sent), "reset": False}
