"""Evidence from one drive about the statements of a profile: its file, and what it proves here.

`drivepanel profiles confirm` and `--prove` write the file. In the folder `evidence` of the
configuration, it raises the confidence of the parameters whose displayed value a person has
compared, and of the commands that the drive has followed without its motor.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from ..errors import DriveError
from ..small_file import read_small
from .schema import (
    Chart,
    Confidence,
    EvidenceFinding,
    EvidenceSubject,
    OrderId,
    Parameter,
    ProfileData,
    ProfileEvidence,
)

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


COMMAND_TABLES = (
    "functions", "reading", "charts", "references", "channels", "control_sources", "signal_paths",
    "enumerations", "parameters",
)  # fmt: skip
"""Tables of a profile that its commands depend on."""
_NO_FACTS = frozenset({"confidence", "limit_grounds", "source", "note"})


def command_statement(data: ProfileData) -> str:
    """Return the SHA-256 of everything in a profile that its commands depend on, in hexadecimal.

    Certainty and sources are not part of it, because evidence changes them.
    """
    facts = [_facts(msgspec.to_builtins(getattr(data, table))) for table in COMMAND_TABLES]
    return sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def _facts(value: Any) -> Any:
    """Return a value without its empty fields, so that a new field of the form changes no hash."""
    if isinstance(value, list):
        return [_facts(item) for item in value]
    if not isinstance(value, dict):
        return value
    empty: tuple[object, ...] = (None, "", [], {})
    return {
        key: _facts(item)
        for key, item in value.items()
        if key not in _NO_FACTS and item is not False and item not in empty
    }


def finding_name(chart: Chart, id: OrderId) -> str:
    """Return the name of a command in findings."""
    return f"{chart.id} {id}"


Judged = tuple[EvidenceFinding, ProfileEvidence]
PROVING: frozenset[EvidenceSubject] = frozenset({"value", "command", "reference"})


def with_evidence(data: ProfileData, known: Iterable[ProfileEvidence]) -> ProfileData:
    """Return a profile with the confidence of its facts by evidence of this site.

    A displayed value that a person compared proves a parameter; one that differed makes it
    unverified. A test of the commands proves those that worked, as long as nothing that they depend
    on changes in the profile. The newest evidence counts, and only of real drives.
    """
    latest: dict[tuple[EvidenceSubject, str], Judged] = {}
    for evidence in known:
        if evidence.profile != data.profile.id or evidence.tested.kind != "drive":
            continue
        if evidence.is_of_another_family:
            continue
        for found in evidence.findings:
            if found.subject in PROVING and found.result != "open":
                latest[found.subject, found.name] = (found, evidence)
    if not latest:
        return data
    data = _with_commands(data, latest)
    shared = {e.id: e.values for e in data.enumerations}
    parameters = []
    for parameter in data.parameters:
        own = {**shared.get(parameter.enumeration, {}), **parameter.values}
        if (known_here := latest.get(("value", parameter.code))) is not None:
            names = ((int(raw), text) for raw, text in own.items())
            if known_here[0].statement == statement_of(parameter, names):
                parameter = _judged(parameter, *known_here)
        parameters.append(parameter)
    return msgspec.structs.replace(data, parameters=parameters)


def _with_commands(
    data: ProfileData, latest: Mapping[tuple[EvidenceSubject, str], Judged]
) -> ProfileData:
    """Return a profile with the confidence of its commands, and of the words that they need."""
    here = {key: judged for key, judged in latest.items() if key[0] != "value"}
    statement = command_statement(data) if here else ""
    here = {key: judged for key, judged in here.items() if judged[0].statement == statement}
    if not here:
        return data
    words = {name: judged for (subject, name), judged in here.items() if subject == "reference"}
    charts = []
    for chart in data.charts:
        orders = []
        for order in chart.orders:
            if (judged := here.get(("command", finding_name(chart, order.id)))) is not None:
                order = msgspec.structs.replace(order, confidence=_confidence(judged[0]))
                if judged[0].result == "confirmed":
                    words |= dict.fromkeys((chart.status, order.parameter or chart.command), judged)
            orders.append(order)
        charts.append(msgspec.structs.replace(chart, orders=orders))
    parameters = [_judged(p, *words[p.code]) if p.code in words else p for p in data.parameters]
    return msgspec.structs.replace(data, charts=charts, parameters=parameters)


def _confidence(found: EvidenceFinding) -> Confidence:
    return "site" if found.result == "confirmed" else "unverified"


def _judged(parameter: Parameter, found: EvidenceFinding, evidence: ProfileEvidence) -> Parameter:
    drive = " ".join(filter(None, (evidence.tested.reference, evidence.tested.firmware)))
    what = "confirmed" if found.result == "confirmed" else "contradicted"
    source = f"{parameter.source}; {what} on {drive or 'a drive'}, {evidence.date[:10]}"
    return msgspec.structs.replace(parameter, confidence=_confidence(found), source=source)
