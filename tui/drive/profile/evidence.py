"""Evidence from one drive about the statements of a profile: its file, and what it proves here.

`drivepanel profiles confirm` writes the file. In the folder `evidence` of the configuration, it
raises the confidence of the parameters whose displayed value a person has compared.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from pathlib import Path

import msgspec

from ..errors import DriveError
from ..small_file import read_small
from .schema import Confidence, EvidenceFinding, Parameter, ProfileData, ProfileEvidence

LONGEST_EVIDENCE = 4_000_000
"""Most bytes of a file."""

log = logging.getLogger(__name__)


class EvidenceError(DriveError):
    """A file is not evidence; the text names the file and the fault."""


def read_evidence(path: Path) -> ProfileEvidence:
    """Read a file. Raises EvidenceError."""
    try:
        return msgspec.json.decode(read_small(path, LONGEST_EVIDENCE), type=ProfileEvidence)
    except OSError as error:
        raise EvidenceError(f"{path}: cannot be read: {error.strerror or error}.") from error
    except (ValueError, RecursionError) as error:
        raise EvidenceError(f"{path}: not evidence of Drive Panel: {error}.") from error


def all_evidence(folder: Path) -> list[ProfileEvidence]:
    """Return the evidence of a folder, oldest first; a file that cannot be read is logged."""
    found = []
    for path in sorted(folder.glob("*.json")):
        try:
            found.append(read_evidence(path))
        except EvidenceError as error:
            log.warning("%s", error)
    return sorted(found, key=lambda evidence: evidence.date)


def evidence_text(evidence: ProfileEvidence) -> str:
    """Return the content of a file."""
    return json.dumps(msgspec.to_builtins(evidence), indent=1, ensure_ascii=False) + "\n"


def statement_of(parameter: Parameter, names: Iterable[tuple[int, str]]) -> str:
    """Return everything in the profile that the displayed value of a parameter depends on."""
    facts: tuple[object, ...] = (
        parameter.function, parameter.address, parameter.type, parameter.low_word_first,
        parameter.mask, parameter.shift, parameter.unit, parameter.scale, parameter.scale_by,
        parameter.unit_by, parameter.full_scale, parameter.base, parameter.rating, sorted(names),
    )  # fmt: skip
    if parameter.type == "ascii":
        facts = (*facts, parameter.words, parameter.low_byte_first)
    return msgspec.json.encode(facts).decode()


def with_evidence(data: ProfileData, known: Iterable[ProfileEvidence]) -> ProfileData:
    """Return a profile with the confidence of its parameters by evidence of this site.

    A displayed value that a person compared proves a parameter; one that differed makes it
    unverified. The newest evidence counts, and only of real drives.
    """
    latest: dict[str, tuple[EvidenceFinding, ProfileEvidence]] = {}
    for evidence in known:
        if evidence.profile != data.profile.id or evidence.tested.kind != "drive":
            continue
        if evidence.is_of_another_family:
            continue
        for found in evidence.findings:
            if found.subject == "value" and found.result != "open":
                latest[found.name] = (found, evidence)
    if not latest:
        return data
    shared = {e.id: e.values for e in data.enumerations}
    parameters = []
    for parameter in data.parameters:
        own = {**shared.get(parameter.enumeration, {}), **parameter.values}
        if (known_here := latest.get(parameter.code)) is not None:
            names = ((int(raw), text) for raw, text in own.items())
            if known_here[0].statement == statement_of(parameter, names):
                parameter = _judged(parameter, *known_here)
        parameters.append(parameter)
    return msgspec.structs.replace(data, parameters=parameters)


def _judged(parameter: Parameter, found: EvidenceFinding, evidence: ProfileEvidence) -> Parameter:
    drive = " ".join(filter(None, (evidence.tested.reference, evidence.tested.firmware)))
    what = "confirmed" if found.result == "confirmed" else "contradicted"
    source = f"{parameter.source}; {what} on {drive or 'a drive'}, {evidence.date[:10]}"
    confidence: Confidence = "site" if found.result == "confirmed" else "unverified"
    return msgspec.structs.replace(parameter, confidence=confidence, source=source)
