"""The JSON Schema of what `--json` prints.

`python -m tui.cli.documents.json_schema` prints it; a copy is docs/cli.schema.json. Tests
hold what the commands print against it. Fields are added, never renamed, while `schema` stays 1.
"""

from __future__ import annotations

import json
import sys

import msgspec

from .of_drives import (
    CommandTold,
    CountersTold,
    CycleTold,
    ErrorTold,
    HoldTold,
    IdentityTold,
    ProveTold,
    ReadTold,
    RunTold,
    ScanEndTold,
    ScanFamiliesTold,
    ScanHitTold,
    ScanSlowTold,
    ScanUnclearTold,
    StatusTold,
    StopTold,
)
from .of_listening import HeardExchangeTold, HeardSummaryTold
from .of_others import (
    BundleDocument,
    CheckTold,
    InputsTold,
    JournalTold,
    LinesTold,
    PortTold,
    ProfileBegun,
    ProfileFolder,
    ProfileShown,
    ProfileTold,
    PublishReady,
    ServeReady,
    SimulationReady,
    WiringTold,
)
from .of_settings import (
    BackupTold,
    BlockChangeTold,
    BlockFileTold,
    BlocksTold,
    CompareTold,
    LessonTold,
    ReportTold,
    RestoreTold,
    TaughtTold,
    TeachChangeTold,
    WriteTold,
)
from .why_document import WhyTold

DOCUMENTS: tuple[type[msgspec.Struct], ...] = (
    ErrorTold, ReadTold, CycleTold, IdentityTold, StatusTold, RunTold, HoldTold, ProveTold,
    ScanFamiliesTold, ScanSlowTold, ScanHitTold, ScanUnclearTold, ScanEndTold,
    CommandTold, StopTold, WriteTold, RestoreTold, BackupTold, ReportTold, CompareTold, BlocksTold,
    BlockChangeTold, BlockFileTold, LessonTold, TaughtTold, TeachChangeTold, PortTold, ProfileTold,
    ProfileShown, WiringTold, CheckTold, ProfileBegun, ProfileFolder, SimulationReady, InputsTold,
    ServeReady,
    PublishReady,
    JournalTold, LinesTold, HeardExchangeTold, HeardSummaryTold, WhyTold, CountersTold,
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
