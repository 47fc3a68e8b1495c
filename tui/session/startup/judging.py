"""Rows of a step, and what prevents it from being done; pure functions."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from decimal import Decimal
from typing import Literal, NamedTuple

from tui.drive.errors import DriveError
from tui.drive.profile.profile import Profile
from tui.drive.sentences import any_of
from tui.drive.settings.writable import is_setting
from tui.drive.shown import raw_of_text, shown

from .progress import StepRecord
from .steps import GuideField, GuideStep

PLATE_REFERENCE = "Reference on the nameplate"
TURNED, RUN, TEST, FILE, RETEST = "Turned", "Run", "Test", "File", "Tested again"
NOT_AS_SET = "NOT AS SET"
"""Part of the result of a test after which the drive did not react as set."""
AS_REQUIRED, OTHER_WAY, NOT_AT_ALL = "as required", "the other way", "it did not turn"
TICKED = "yes"
RowKind = Literal[
    "parameter", "plate", "field", "reference", "run", "turned", "speed", "stop", "test",
    "save", "backup", "report", "retest", "done", "deficient", "skip",
]  # fmt: skip


class StepRow(NamedTuple):
    """One row of a step, on which Enter acts."""

    kind: RowKind
    key: str
    """Code of a parameter, or the key of what is recorded."""
    field: GuideField | None = None

    @property
    def required(self) -> bool:
        """True if the step is not done without an entry of this row."""
        if self.field is not None:
            return not self.field.optional
        return self.kind in ROWS_WITH_ENTRY


ROWS_WITH_ENTRY = {"plate", "reference", "run", "speed", "stop", "test", "backup", "retest"}
_PLAIN_NUMBER = re.compile(r"[0-9]{1,9}([.,][0-9]{1,6})?")
LEAST_REFERENCE = 8
"""Fewest letters and digits of a reported reference that a nameplate may continue."""
NEEDS_REST = {"direction", "stops", "speeds", "loss"}
"""Kinds of steps that run the motor: it must be at standstill before they are done."""
MOTOR_RUNS = "Not done: the motor is not known to be at standstill. Stop it first."


class StepFacts(NamedTuple):
    """Facts about the drive that decide if a step is done."""

    profile: Profile
    raws: Mapping[str, int]
    """Current values only."""
    absent: Collection[str]
    """Codes that the drive does not have."""
    staged: Collection[str]
    unsaved: Collection[str]
    at_rest: bool
    """True if the motor is known to be at standstill."""
    identity: str
    """Reference and model that the drive reports; empty if it reports none."""


def step_rows(step: GuideStep, record: StepRecord) -> list[StepRow]:
    """Return the rows of a step, in their order."""
    results: tuple[RowKind, ...] = ("done", "deficient", "skip")
    return [*_work_rows(step, record), *(StepRow(kind, kind) for kind in results)]


def _work_rows(step: GuideStep, record: StepRecord) -> Iterator[StepRow]:
    if step.kind == "identity":
        yield StepRow("reference", PLATE_REFERENCE)
    yield from (StepRow("plate", code) for code in step.plate)
    codes = dict.fromkeys((*step.parameters, *step.expect))
    yield from (StepRow("parameter", code) for code in codes if code not in step.plate)
    yield from (StepRow("field", field.name, field) for field in step.fields)
    match step.kind:
        case "direction":
            yield StepRow("run", RUN)
            yield from (StepRow("turned", way) for way in (AS_REQUIRED, OTHER_WAY, NOT_AT_ALL))
            if step.reverse:
                yield StepRow("parameter", step.reverse)
        case "speeds":
            yield from (StepRow("speed", f"{hertz:g} Hz") for hertz in step.hz)
        case "stops":
            yield from (StepRow("stop", method) for method in step.methods)
        case "loss":
            yield StepRow("test", TEST)
        case "save" | "report":
            yield StepRow(step.kind, step.kind)
        case "backup":
            yield StepRow("backup", FILE)
    if record.state == "deficient":
        yield StepRow("retest", RETEST)


def field_fault(field: GuideField, text: str) -> str:
    """Return the error in what was typed for a field; empty if it can be recorded."""
    if not text.strip():
        return f"Enter the {field.name.lower()}."
    if field.kind == "number" and _number(text) is None:
        return f"'{text.strip()}' is not a number. Use digits, for example 12.5."
    return ""


def _number(text: str) -> Decimal | None:
    """Return a plain number; an exponent could make it too long to print."""
    found = _PLAIN_NUMBER.fullmatch(text.strip())
    return Decimal(found[0].replace(",", ".")) if found else None


def plate_raw(facts: StepFacts, code: str, text: str) -> int:
    """Return the raw value of a number on a nameplate. Raises DriveError."""
    profile = facts.profile
    return raw_of_text(profile, profile[code], text, facts.raws, facts.absent).raw


def plate_fault(facts: StepFacts, code: str, typed: str) -> str:
    """Return how the drive's value differs from the nameplate; empty if it does not."""
    if code not in facts.raws:
        return f"{code} has not been read."
    try:
        wanted = plate_raw(facts, code, typed)
    except DriveError as refused:
        return str(refused)
    if wanted == facts.raws[code]:
        return ""
    held = shown(facts.profile, facts.profile[code], facts.raws[code], facts.raws, facts.absent)
    return f"{code}: the nameplate says {typed}, the drive has {held.display}."


def reference_fault(facts: StepFacts, typed: str) -> str:
    """Return how the drive's identity differs from its nameplate; empty if it does not.

    A drive that reports no reference cannot be compared.
    """
    known = [_letters(part) for part in re.split(r"[\s,]+", facts.identity)]
    plate = _letters(typed)
    # a nameplate may add a suffix to the reported reference; a part of it is another drive
    if not facts.identity or any(
        plate == part or (len(part) >= LEAST_REFERENCE and plate.startswith(part)) for part in known
    ):
        return ""
    return f"The nameplate says {typed}, the drive reports {facts.identity}."


def _letters(text: str) -> str:
    return "".join(letter for letter in text.casefold() if letter.isalnum())


def why_not_done(step: GuideStep, record: StepRecord, facts: StepFacts) -> str:
    """Return what prevents a step from being done; empty if nothing does."""
    return next(_hindrances(step, record, facts), "")


def _hindrances(step: GuideStep, record: StepRecord, facts: StepFacts) -> Iterator[str]:
    for row in step_rows(step, record):
        entry = record.entries.get(row.key, "")
        if row.required and not entry:
            name = facts.profile[row.key].name if row.kind == "plate" else row.key
            yield f"Not done: {name} is not recorded. Press Enter on it."
        if row.kind in ("plate", "parameter") and row.key not in facts.absent:
            yield from _parameter(step, row, facts)
        if row.kind == "plate" and (fault := plate_fault(facts, row.key, entry)):
            yield f"Not done: {fault}"
        if row.kind == "reference" and (fault := reference_fault(facts, entry)):
            yield f"Not done: {fault}"
        if row.kind == "test" and NOT_AS_SET in entry:
            yield "Not done: the drive did not react as set. Record a deficiency."
        if row.field is not None:
            yield from _field(row.field, entry, record)
    if step.kind == "direction" and record.entries.get(TURNED) != AS_REQUIRED:
        yield "Not done: it is not recorded that the motor turned as required."
    if step.kind in NEEDS_REST and not facts.at_rest:
        yield MOTOR_RUNS
    if step.kind == "save" and facts.unsaved:
        yield f"Not done: {len(facts.unsaved)} settings are not saved. Press S."


def _parameter(step: GuideStep, row: StepRow, facts: StepFacts) -> Iterator[str]:
    code = row.key
    if code in facts.staged:
        yield f"Not done: {code} is staged, not written. Press Enter on it, then w."
    if code not in facts.raws:
        yield f"Not done: {code} has not been read."
    elif (wanted := step.expect.get(code)) and facts.raws[code] not in wanted:
        parameter = facts.profile[code]
        names = [shown(facts.profile, parameter, raw, facts.raws).display for raw in wanted]
        held = shown(facts.profile, parameter, facts.raws[code], facts.raws).display
        yield f"Not done: {code} is {held}; it must be {any_of(names)}."


def _field(field: GuideField, entry: str, record: StepRecord) -> Iterator[str]:
    if field.kind == "tick" and not field.optional and entry != TICKED:
        yield f"Not done: {field.name} is not ticked."
    least = _number(record.entries.get(field.least, "")) if field.least else None
    number = _number(entry)
    if least is not None and number is not None and number < least:
        text = f"{number} {field.unit} is below the typed limit of"
        yield f"Not done: {text} {least} {field.unit}. Record a deficiency."


def setting_raws(step: GuideStep, facts: StepFacts) -> dict[str, int]:
    """Return the settings of a step, as they are now."""
    profile = facts.profile
    known = [code for code in step.codes if code in facts.raws]
    return {code: facts.raws[code] for code in known if is_setting(profile, profile[code])}


def changed_codes(step: GuideStep, record: StepRecord, raws: Mapping[str, int]) -> list[str]:
    """Return the settings of a done step that have another value now."""
    if record.state != "done":
        return []
    return [code for code, raw in record.raws.items() if code in raws and raws[code] != raw]
