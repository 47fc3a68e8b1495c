"""The JSON Schema of what `--json` prints.

`python -m tui.cli.documents.json_schema` prints it; a copy is docs/cli.schema.json. Tests
hold what the commands print against it. Fields are added, never renamed, while `schema` stays 1.
"""

from __future__ import annotations

import json
import sys

import msgspec

from .drive_documents import (
    CommandDocument,
    CountersDocument,
    CycleDocument,
    ErrorDocument,
    HoldDocument,
    IdentityDocument,
    ProveDocument,
    ReadDocument,
    RunDocument,
    ScanEndDocument,
    ScanFamiliesDocument,
    ScanHitDocument,
    ScanSlowDocument,
    ScanUnclearDocument,
    StatusDocument,
    StopDocument,
)
from .listening_documents import HeardExchangeDocument, HeardSummaryDocument
from .other_documents import (
    BundleDocument,
    CheckDocument,
    InputsDocument,
    JournalDocument,
    LinesDocument,
    PortDocument,
    ProfileBegun,
    ProfileDocument,
    ProfileFolder,
    ProfileShown,
    PublishReady,
    ServeReady,
    SimulationReady,
    WiringDocument,
)
from .setting_documents import (
    BackupDocument,
    BlockChangeDocument,
    BlockFileDocument,
    BlocksDocument,
    CompareDocument,
    LessonDocument,
    ReportDocument,
    RestoreDocument,
    TaughtDocument,
    TeachChangeDocument,
    WriteDocument,
)
from .why_document import WhyDocument

DOCUMENTS: tuple[type[msgspec.Struct], ...] = (
    ErrorDocument, ReadDocument, CycleDocument, IdentityDocument, StatusDocument, RunDocument,
    HoldDocument, ProveDocument,
    ScanFamiliesDocument, ScanSlowDocument, ScanHitDocument, ScanUnclearDocument, ScanEndDocument,
    CommandDocument, StopDocument, WriteDocument, RestoreDocument, BackupDocument, ReportDocument,
    CompareDocument, BlocksDocument,
    BlockChangeDocument, BlockFileDocument, LessonDocument, TaughtDocument, TeachChangeDocument,
    PortDocument, ProfileDocument,
    ProfileShown, WiringDocument, CheckDocument, ProfileBegun, ProfileFolder, SimulationReady,
    InputsDocument,
    ServeReady,
    PublishReady,
    JournalDocument, LinesDocument, HeardExchangeDocument, HeardSummaryDocument, WhyDocument,
    CountersDocument,
    BundleDocument,
)  # fmt: skip
"""Every document; a list of them is printed for ports, profiles, checks and several drives."""


def documents_schema() -> str:
    """The JSON Schema of one document, as it is committed."""
    references, parts = msgspec.json.schema_components(DOCUMENTS, ref_template="#/$defs/{name}")
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Drive Panel, --json",
        "anyOf": list(references),
        "$defs": dict(sorted(parts.items())),
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def document_of(text: str) -> msgspec.Struct:
    """The document in a text, as the first of the forms that fit; raises ValueError."""
    wrong = []
    for form in DOCUMENTS:
        try:
            found: msgspec.Struct = msgspec.json.decode(text, type=form)
        except msgspec.ValidationError as error:
            wrong.append(f"{form.__name__}: {error}")
        else:
            return found
    raise ValueError("; ".join(wrong))


if __name__ == "__main__":
    sys.stdout.write(documents_schema())
